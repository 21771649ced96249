"""Six habits of laboratories in writing a campaign. They differ in the logged columns and in the values at rest.

0  every column that varies, rest as in ``plan.REST``, one numbered session per hour
1  sessions named by date, every 2000 h, 60 minutes after power-on in every row (so a warm-up is not visible)
2  5 lx and about 24.3 °C in every row, rest of u, v, surround blank (so no readings with a lamp or in a warmer room)
3  a window of 0.9 is rest; the rows of a session are shuffled, ``order`` keeps the order of reading
4  three sessions at one hour, on three days, each with one replicate of the colour points
5  rest is blank everywhere, patches are read in random order, the hours have gaps
"""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.plan import CONDITIONS, REST, WARM_ROOM, Plan, changed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from tests.generators.spectral.plan import Reading

HABITS = 6
NEUTRAL = dict(zip(CONDITIONS, REST, strict=True))

#: Hours of reading by habit; those of habit 5 have gaps early and late.
HOURS: Sequence[Sequence[float]] = (
    (0, 150, 500, 1200, 2500, 4500, 7500, 11000, 14500, 18000),
    (0, 2000, 4000, 6000, 8000, 10000, 12000, 14000, 16000, 18000),
    (0, 510, 1020, 2040, 3980, 6030, 9010, 12070, 15020, 18000),
    (0, 1000, 3000, 5000, 7000, 9000, 11500, 13500, 16000, 18000),
    (0, 250, 1000, 2000, 3500, 6000, 9000, 12000, 15000, 18000),
    (0, 60, 200, 800, 1000, 5000, 5500, 9500, 17000, 18000),
)
FEW = (0.0, 4500.0, 9000.0, 13500.0, 18000.0)


def hours(design: str, habit: int) -> NDArray[np.float64]:
    """Return the hours of reading, (hours,)."""
    return np.array(FEW if design == "few" else HOURS[habit], dtype=float)


def sessions(habit: int) -> int:
    """Return the number of sessions at one hour."""
    return 3 if habit == 4 else 1


def left_out(reading: Reading, habit: int) -> bool:
    """Return whether a laboratory with this habit never takes this reading."""
    return (habit == 1 and reading.warmup_min != NEUTRAL["warmup_min"]) or (
        habit == 2 and (reading.ambient_lx > 0 or reading.temperature_c == WARM_ROOM)
    )


def in_truth(plan: Plan, habit: int, rng: np.random.Generator) -> Plan:
    """Return the plan with the conditions and the order of reading of the habit."""
    n = len(plan.order)
    if habit == 1:
        return changed(plan, warmup_min=np.full(n, 60.0))
    if habit == 2:
        covered = np.array([note != "" for note in plan.note])
        jitter = np.round(24.3 + rng.normal(0, 0.15, size=n), 1)
        return changed(plan, ambient_lx=np.where(covered, 0.0, 5.0), temperature_c=jitter)
    if habit == 3:
        window = plan.conditions["window"]
        return changed(plan, window=np.where(window == 1.0, 0.9, window))
    if habit == 5:
        return replace(plan, order=_mixed(plan, rng))
    return plan


def _mixed(plan: Plan, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a random order of reading in each session; the warm-up readings come first, the room readings last."""
    chance = rng.random(len(plan.order))
    stage = np.where(plan.conditions["warmup_min"] < NEUTRAL["warmup_min"], 0, 1)
    stage = np.where(plan.conditions["temperature_c"] == WARM_ROOM, 2, stage)
    chance = np.where(stage == 0, plan.order / len(chance), chance)
    order = np.empty(len(chance))
    order[np.lexsort((chance, stage, plan.session))] = np.arange(len(chance), dtype=float)
    return order


def logged(plan: Plan, habit: int) -> dict[str, NDArray[np.float64]]:
    """Return the columns of the file; NaN is a blank cell."""
    varying = {name: column for name, column in plan.conditions.items() if np.ptp(column) > 0}
    if habit == 1:
        return {**varying, "warmup_min": plan.conditions["warmup_min"]}
    if habit == 2:
        blank = {name: _blank(column, name) for name, column in varying.items() if name in {"u", "v", "surround"}}
        return {**varying, **blank, "ambient_lx": np.full(len(plan.order), 5.0)}
    if habit == 3:
        return {**varying, "window": plan.conditions["window"]}
    if habit == 5:
        return {name: _blank(column, name) for name, column in varying.items()}
    return varying


def _blank(column: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    return np.where(column == NEUTRAL[name], np.nan, column)


def names(plan: Plan, habit: int) -> tuple[str, ...]:
    """Return the names of the sessions: numbers, or dates (ten hours of operation per day)."""
    if habit in {0, 3}:
        return tuple(f"s{k:02d}" for k in plan.session)
    start, per_hour = date(2019, 3, 4), sessions(habit)
    days = [int(plan.hours[k // per_hour] // 10) + k % per_hour for k in range(len(plan.hours) * per_hour)]
    return tuple((start + timedelta(days=days[k])).isoformat() for k in plan.session)


def rows(plan: Plan, habit: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Return the order of the rows in the table: habit 3 shuffles the rows of a session."""
    chance = rng.random(len(plan.order)) if habit == 3 else plan.order
    return np.asarray(np.lexsort((chance, plan.session)))


def metadata(panel: str, seed: int, design: str, habit: int) -> Mapping[str, str]:
    """Return the ``# key: value`` lines; the first line says that the readings are simulated."""
    return {
        "simulated": f"spectral simulator, seed {seed}, design {design}, habit {habit}; no display was measured",
        "display": panel,
        "luminance": "free",
    }
