"""The patches of the real session that are read at an hour, and their simulated conditions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.real.response import Display

    Indices = NDArray[np.intp]

DESIGNS = ("full", "grey", "colour", "few")
COLUMNS = ("u", "v", "ambient_lx", "warmup_min", "temperature_c", "window", "surround")
_WHITE, _BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
_PRIMARIES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Reading:
    """One planned reading: the index of a measured patch, and the conditions that differ from rest (None is rest)."""

    patch: int
    u: float | None = None
    v: float | None = None
    ambient_lx: float | None = None
    warmup_min: float | None = None
    temperature_c: float | None = None
    window: float | None = None
    surround: float | None = None
    note: str = ""


def plan(display: Display, design: str, rng: np.random.Generator, rest_c: float) -> list[Reading]:
    """Return the readings of one simulated hour in the order of reading.

    Cold readings come first; the colour points are spread over the session. Ramps, greys and mixtures are drawn again
    at each hour: one patch from each interval of the session's levels.
    """
    points = [Reading(display.patch(drive)) for drive in (_WHITE, *_PRIMARIES, _BLACK)]
    sets = _kinds(display)
    counts = {
        "full": {"grey": 12, "red": 8, "green": 8, "blue": 8, "two": 8, "mixture": 18},
        "grey": {"grey": 24},
        "colour": {"grey": 12, "red": 8, "green": 8, "blue": 8, "two": 10, "mixture": 24},
        "few": {"grey": 6, "red": 3, "green": 3, "blue": 3, "two": 3, "mixture": 7},
    }[design]
    drawn = [Reading(patch) for kind, count in counts.items() for patch in _spread(sets[kind], count, rng)]
    drawn = [drawn[place] for place in rng.permutation(len(drawn))]
    half = len(drawn) // 2
    if design == "few":
        return [*points, *drawn]
    around = _conditions(display, rest_c) if design == "full" else []
    cold = [reading for reading in around if reading.warmup_min is not None]
    warm = [reading for reading in around if reading.warmup_min is None]
    return [*cold, *points, *drawn[:half], *points, *drawn[half:], *warm, *points]


def without(readings: list[Reading], columns: set[str]) -> list[Reading]:
    """Return the readings that need none of these columns; drop the others, which only the column explains."""
    at_rest = dict.fromkeys(columns)
    return [reading for reading in readings if reading == replace(reading, **at_rest)]  # type: ignore[arg-type]


def _conditions(display: Display, rest_c: float) -> list[Reading]:
    white, black = display.patch(_WHITE), display.patch(_BLACK)
    red, green, blue = (display.patch(primary) for primary in _PRIMARIES)
    grey = display.patch((0.5, 0.5, 0.5))
    yellow, magenta = display.patch((1.0, 1.0, 0.0)), display.patch((1.0, 0.0, 1.0))
    places = [(u, v) for v in (0.1, 0.5, 0.9) for u in (0.1, 0.5, 0.9)]
    corners = [(u, v) for u, v in places if u != 0.5 and v != 0.5]
    rooms = [(black, 50.0), (black, 150.0), (black, 400.0), (grey, 50.0), (grey, 400.0), (white, 150.0)]
    cold = [(white, 1.0), (grey, 3.0), (white, 5.0), (white, 11.0), (grey, 20.0), (white, 35.0)]
    warmed = rest_c + 7.0
    return [
        *(Reading(white, u=u, v=v) for u, v in places),
        *(Reading(grey, u=u, v=v) for u, v in corners),
        *(Reading(patch, ambient_lx=lux) for patch, lux in rooms),
        Reading(black, ambient_lx=0.0, note="shrouded"),
        *(Reading(patch, warmup_min=minutes) for patch, minutes in cold),
        *(Reading(patch, window=0.1, surround=0.0) for patch in (white, red, green, blue, yellow, magenta)),
        *(Reading(patch, window=0.1, surround=1.0) for patch in (white, black, grey)),
        Reading(white, window=0.4, surround=0.0),
        *(Reading(patch, temperature_c=warmed) for patch in (white, grey, red, blue)),
        Reading(black, note="lens cap"),
    ]


def _kinds(display: Display) -> dict[str, Indices]:
    """Return the indices of the session's patches by kind, sorted by level."""
    drive = display.drive
    low, high = drive.min(axis=1), drive.max(axis=1)
    inner = (high > 0.001) & (low < 0.999)
    spread = high - low
    lit = (drive > 0.001).sum(axis=1)
    alone = [(lit == 1) & (drive[:, channel] > 0.001) & (drive[:, channel] < 0.999) for channel in range(3)]
    chosen = {
        "grey": inner & (spread < 1e-3),
        "red": alone[0],
        "green": alone[1],
        "blue": alone[2],
        "two": lit == 2,
        "mixture": (lit == 3) & (spread >= 1e-3),
    }
    return {kind: np.flatnonzero(mask)[np.argsort(high[mask], kind="stable")] for kind, mask in chosen.items()}


def _spread(patches: Indices, count: int, rng: np.random.Generator) -> list[int]:
    """Return ``count`` patches, one from each of ``count`` equal intervals; return all patches if there are fewer."""
    if len(patches) <= count:
        return [int(patch) for patch in patches]
    return [int(rng.choice(stretch)) for stretch in np.array_split(patches, count)]
