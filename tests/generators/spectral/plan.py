"""The readings of a campaign before any light is computed: patches, conditions, hours, order."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

CONDITIONS = ("u", "v", "ambient_lx", "warmup_min", "temperature_c", "window", "surround")
REST = (0.5, 0.5, 0.0, 120.0, 25.0, 1.0, 0.0)
WARM_ROOM = 32.0  # °C

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
PRIMARIES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SECONDARIES = ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0))


@dataclass(frozen=True)
class Reading:
    """One patch under one set of conditions; ``place`` sorts the readings of a session, from 0 (first) to 1 (last)."""

    drive: tuple[float, float, float]
    place: float
    replicate: int = -1  # number of the replicate of a colour point at rest; −1 for all other readings
    u: float = REST[0]
    v: float = REST[1]
    ambient_lx: float = REST[2]
    warmup_min: float = REST[3]
    temperature_c: float = REST[4]
    window: float = REST[5]
    surround: float = REST[6]
    note: str = ""


@dataclass(frozen=True)
class Plan:
    """All readings: columns (n,) of true values; ``hour`` is an index into ``hours``."""

    hours: NDArray[np.float64]
    hour: NDArray[np.intp]
    drive: NDArray[np.float64]
    conditions: dict[str, NDArray[np.float64]]
    session: NDArray[np.intp]
    order: NDArray[np.float64]
    note: tuple[str, ...]


def _grey(level: float) -> tuple[float, float, float]:
    return (level, level, level)


def _ramp(levels: Sequence[float]) -> Iterator[tuple[float, float, float]]:
    for level, (r, g, b) in product(levels, PRIMARIES):
        yield (level * r, level * g, level * b)


def _colour_points(replicates: int) -> Iterator[Reading]:
    for replicate in range(replicates):
        for patch in (WHITE, *PRIMARIES, BLACK):
            yield Reading(patch, place=0.2 + 0.35 * replicate, replicate=replicate)


def _colours(rng: np.random.Generator) -> Iterator[Reading]:
    for patch in _ramp((0.12, 0.25, 0.4, 0.55, 0.7, 0.85)):
        yield Reading(patch, place=0.4)
    for level, patch in product((1.0, 0.75, 0.5), SECONDARIES):
        yield Reading((level * patch[0], level * patch[1], level * patch[2]), place=0.45)
    for r, g, b in np.round(rng.uniform(0.1, 1.0, size=(10, 3)) * 255) / 255:
        yield Reading((r, g, b), place=0.5)


def _circumstances() -> Iterator[Reading]:
    for minutes in (1.0, 5.0, 12.0, 30.0, 60.0):
        yield Reading(WHITE, place=0.001 * minutes, warmup_min=minutes)
    for minutes in (6.0, 32.0):
        yield Reading(_grey(0.5), place=0.001 * minutes, warmup_min=minutes)
    for u, v in product((0.1, 0.5, 0.9), repeat=2):
        if (u, v) != (0.5, 0.5):
            yield Reading(WHITE, place=0.6, u=u, v=v)
            if u != 0.5 and v != 0.5:
                yield Reading(_grey(0.5), place=0.6, u=u, v=v)
    for patch, lux in ((BLACK, 50.0), (BLACK, 150.0), (BLACK, 500.0), (WHITE, 150.0), (_grey(0.25), 150.0)):
        yield Reading(patch, place=0.65, ambient_lx=lux)
    for _ in range(2):
        yield Reading(BLACK, place=0.66, note="shrouded")
    for surround, patch in product((0.0, 0.5, 1.0), (WHITE, _grey(0.5), BLACK, (1.0, 1.0, 0.0))):
        yield Reading(patch, place=0.7, window=0.1, surround=surround)
    for patch in (*PRIMARIES, WHITE, _grey(0.5), BLACK):
        yield Reading(patch, place=0.98, temperature_c=WARM_ROOM)
    yield Reading(BLACK, place=0.99, note="lens cap")


def _few() -> Iterator[Reading]:
    yield from _colour_points(1)
    for level in (0.1, 0.25, 0.4, 0.55, 0.7, 0.85):
        yield Reading(_grey(level), place=0.3)
    for patch in _ramp((0.25, 0.5, 0.75)):
        yield Reading(patch, place=0.4)
    for patch in SECONDARIES:
        yield Reading(patch, place=0.45)
    for u in (0.1, 0.9):
        yield Reading(WHITE, place=0.6, u=u, v=0.1)
    for lux in (100.0, 400.0):
        yield Reading(BLACK, place=0.65, ambient_lx=lux)
    for patch in (WHITE, BLACK):
        yield Reading(patch, place=0.7, window=0.1, surround=1.0)
    yield Reading(BLACK, place=0.99, note="lens cap")


def readings(design: str, rng: np.random.Generator) -> list[Reading]:
    """Return the readings of one hour in the order of reading."""
    if design == "few":
        schedule = list(_few())
    elif design in {"full", "grey", "colour"}:
        schedule = list(_colour_points(3))
        schedule += [Reading(_grey(level), place=0.3) for level in (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)]
        if design != "grey":
            schedule += _colours(rng)
        if design == "full":
            schedule += _circumstances()
    else:
        raise ValueError(f"design {design!r} is none. Pick one of: full, grey, colour, few.")
    return sorted(schedule, key=lambda reading: reading.place)


def plan(hours: NDArray[np.float64], one_hour: Sequence[Reading], *, sessions: int = 1) -> Plan:
    """Return the same readings at every hour, split into ``sessions`` sessions that all contain the colour points."""
    rows: list[Reading] = []
    hour, session = [], []
    for i in range(len(hours)):
        for part in range(sessions):
            chosen = [r for k, r in enumerate(one_hour) if _part(r, k, sessions) == part]
            rows += chosen
            hour += [i] * len(chosen)
            session += [i * sessions + part] * len(chosen)
    return Plan(
        hours=hours,
        hour=np.array(hour),
        drive=np.array([row.drive for row in rows], dtype=float),
        conditions={name: np.array([getattr(row, name) for row in rows], dtype=float) for name in CONDITIONS},
        session=np.array(session),
        order=np.arange(len(rows), dtype=float),
        note=tuple(row.note for row in rows),
    )


def _part(reading: Reading, index: int, sessions: int) -> int:
    """Return the session of a reading: one replicate of the colour points per session; the other readings in turn."""
    return (reading.replicate if reading.replicate >= 0 else index) % sessions


def changed(source: Plan, **conditions: NDArray[np.float64]) -> Plan:
    """Return the plan with some columns of conditions replaced."""
    return replace(source, conditions={**source.conditions, **conditions})
