"""``campaign``: a real session at hour 0, and simulated sessions of the same display at later hours."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.real import aging, drives, lights, outside
from tests.generators.real.designs import COLUMNS, DESIGNS, Reading, plan, without
from tests.generators.real.noise import SOURCE
from tests.generators.real.response import display
from tests.generators.real.scene import LIFE_H, Scene
from tests.generators.real.sessions import BASES
from tests.generators.truth import Truth

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tests.generators.real.response import Display
    from tests.generators.real.sessions import Array

_DRIVE = {**drives.KINDS, **drives.OUTSIDE}
_EMITTED = {**lights.EMITTED, **lights.OUTSIDE_EMITTED}
_SEEN = {**lights.SEEN, **outside.KINDS}

KINDS: tuple[str, ...] = (*lights.EMITTED, *drives.KINDS, *lights.SEEN, *lights.INSTRUMENT, *aging.KINDS)
OUTSIDE: tuple[str, ...] = (*drives.OUTSIDE, *lights.OUTSIDE_EMITTED, *outside.KINDS)


@dataclass(frozen=True)
class Habits:
    """The way in which a simulated campaign is written to a file."""

    hours: Array
    names: tuple[str, ...]
    dropped: frozenset[str] = frozenset()
    blank_rest: bool = False
    shuffled: bool = False
    rest_min: float = 60.0
    rest_c: float = 23.0


def campaign(
    seed: int, hidden: Mapping[str, float], *, design: str = "full", habits: int = 0, base: str | None = None
) -> Truth:
    """Simulate a campaign on a real display; only its hour 0 is measured.

    The light has no noise except the noise of the real session; ``instrument_noise`` draws further noise. A display
    with a hidden effect of the catalogue's second table (effects that are visible only against hour 0) has no other
    aging. All other displays age by ``aging.healthy``.

    Parameters
    ----------
    seed
        Determines the real session (unless ``base`` is given), the aging, and the parameters of each effect.
    hidden
        Effect of KINDS or OUTSIDE → strength; 1 is a typical size.
    design
        "full", "grey", "colour" or "few".
    habits
        Number of the way to write the campaign; 0 is the plain way.
    base
        Name of a session of BASES.

    Raises
    ------
    ValueError
        An effect or design is unknown.
    MissingSessionsError
        The sessions are not in LUTGEN_REAL_DATA.

    """
    if unknown := set(hidden) - set(KINDS) - set(OUTSIDE):
        raise ValueError(f"No effect {sorted(unknown)}; pick of {', '.join((*KINDS, *OUTSIDE))}.")
    if design not in DESIGNS:
        raise ValueError(f"No design {design!r}; pick one of {', '.join(DESIGNS)}.")
    name = base or BASES[int(_rng(seed, "base").integers(len(BASES)))]
    screen = display(name)
    written = _habits(habits, 5 if design == "few" else 10)
    readings: list[Reading] = []
    session: list[int] = []
    for number in range(len(written.hours)):
        draws = _rng(seed, f"plan {number}")
        chosen = without(plan(screen, design, draws, written.rest_c), set(written.dropped))
        if written.shuffled:  # except that the cold readings come first
            mixed = [chosen[place] for place in draws.permutation(len(chosen))]
            chosen = sorted(mixed, key=lambda reading: reading.warmup_min or np.inf)
        readings += chosen
        session += [number] * len(chosen)
    which = np.array(session)
    scene = _scene(screen, readings, written, which)
    return Truth(
        hours=scene.hours,
        drive=scene.drive,
        xyz_cd_m2=_light(scene, np.array([reading.patch for reading in readings]), seed, hidden),
        conditions=_logged(readings, written, design),
        session=tuple(written.names[number] for number in session),
        order=scene.order,
        note=tuple(reading.note for reading in readings),
        metadata={"display": re.sub("_+", " ", name), "luminance": "free", "source": SOURCE.format(name)},
        hidden=dict(hidden),
    )


def _light(scene: Scene, patch: Array, seed: int, hidden: Mapping[str, float]) -> Array:
    """Return the light (n, 3) in cd/m² at the instrument: readings of hour 0, changed by aging and hidden effects."""
    screen = scene.display
    chosen = {kind: strength for kind, strength in hidden.items() if strength != 0}
    drive = scene.drive
    for kind in [kind for kind in _DRIVE if kind in chosen]:
        drive = _DRIVE[kind](scene, drive, chosen[kind], _rng(seed, kind))
    xyz = screen.xyz_cd_m2[patch]
    if drive is not scene.drive:
        xyz = xyz + screen.light(np.clip(drive, 0.0, 1.0)) - screen.light(scene.drive)
    for kind in [kind for kind in _EMITTED if kind in chosen]:
        xyz = _EMITTED[kind](scene, xyz, chosen[kind], _rng(seed, kind))

    hours, which = np.unique(scene.hours, return_inverse=True)
    decays = [kind for kind in aging.KINDS if kind in chosen]
    matrices = np.tile(np.eye(3), (len(hours), 1, 1)) if decays else aging.healthy(screen, hours, _rng(seed, "aging"))
    for kind in decays:
        matrices = aging.KINDS[kind](screen, hours, chosen[kind], _rng(seed, kind)) @ matrices
    aged = matrices[which]
    xyz = np.einsum("nij,nj->ni", aged, xyz)

    for kind in [kind for kind in _SEEN if kind in chosen]:
        xyz = _SEEN[kind](scene, xyz, chosen[kind], _rng(seed, kind))
    xyz = np.where(scene.capped[:, None], 0.0, np.maximum(xyz, 0.0))
    for kind in [kind for kind in lights.INSTRUMENT if kind in chosen]:
        xyz = lights.INSTRUMENT[kind](scene, xyz, chosen[kind], _rng(seed, kind))
    return np.asarray(xyz)


def _scene(screen: Display, readings: list[Reading], written: Habits, which: Array) -> Scene:
    rest = _rest(written)
    true = {column: _column(readings, column, rest[column]) for column in COLUMNS}
    order = np.concatenate([np.arange(count, dtype=float) for count in np.bincount(which)])
    return Scene(
        display=screen,
        hours=written.hours[which],
        drive=screen.drive[[reading.patch for reading in readings]],
        order=order,
        rest_min=written.rest_min,
        rest_c=written.rest_c,
        capped=np.array([reading.note == "lens cap" for reading in readings]),
        **{**true, "surround": np.nan_to_num(true["surround"])},
    )


def _rest(written: Habits) -> dict[str, float]:
    at_rest = (0.5, 0.5, 0.0, written.rest_min, written.rest_c, 1.0, np.nan)
    return dict(zip(COLUMNS, at_rest, strict=True))


def _column(readings: list[Reading], column: str, rest: float) -> Array:
    values = [getattr(reading, column) for reading in readings]
    return np.array([rest if value is None else value for value in values], dtype=np.float64)


def _logged(readings: list[Reading], written: Habits, design: str) -> dict[str, Array]:
    """Return the columns of the file: those that vary. Rest is its value, or a blank cell if the habit says so."""
    if design != "full":
        return {}
    rest = {column: np.nan if written.blank_rest else value for column, value in _rest(written).items()}
    return {column: _column(readings, column, rest[column]) for column in COLUMNS if column not in written.dropped}


def _habits(number: int, count: int) -> Habits:
    """Return the habits with this number; 0 is the plain way."""
    steps = np.linspace(0.0, 1.0, count)
    if number == 0:
        hours = np.round(LIFE_H * steps)
        return Habits(hours, tuple(f"hour {hour:.0f}" for hour in hours))
    rng = _rng(number, "habits")
    bent = [steps, steps**2, np.concatenate([[0.0], np.sort(rng.uniform(0.03, 0.97, count - 2)), [1.0]])]
    hours = np.round(LIFE_H * bent[int(rng.integers(3))] / 10.0) * 10.0
    hours = hours + np.arange(count)  # two dates never share an hour
    styles = [
        [f"S{place:02d}" for place in range(1, count + 1)],
        [f"check {place}" for place in range(1, count + 1)],
        [f"{hour:.0f} h" for hour in hours],
    ]
    droppable = [("temperature_c",), ("surround", "window"), ("warmup_min",), ("u", "v"), ("ambient_lx",)]
    dropped = frozenset(column for group in droppable if rng.random() < 0.2 for column in group)
    return Habits(
        hours=hours,
        names=tuple(styles[int(rng.integers(3))]),
        dropped=dropped,
        blank_rest=bool(rng.random() < 0.3),
        shuffled=bool(rng.random() < 0.4),
        rest_min=float(rng.choice([45.0, 60.0, 90.0, 120.0])),
        rest_c=float(rng.choice([20.0, 21.5, 23.0, 25.0])),
    )


def _rng(seed: int, purpose: str) -> np.random.Generator:
    """Return a separate random generator for each purpose, so that a hidden effect changes no other random numbers."""
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])
