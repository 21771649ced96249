"""Measurement designs: the patches of a session, from four colours to the complete set of a patient engineer.

``tips`` reads W, R, G, B three times · ``greys`` adds black and nine greys · ``colours`` adds ramps, secondaries and
mixtures · ``full`` adds positions, room light with a shrouded repeat, cold readings, windows, a lens cap, a hot room,
and two hours between sessions at which no tips are read.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_display.readings import LENS_CAP, REFERENCE_C, SHROUDED, Readings, at_rest, joined

if TYPE_CHECKING:
    from tests.virtual_display.spectra import Array

DESIGNS = ("tips", "greys", "colours", "full")

#: Hours of the sessions: dense in the first 1000 h, where lamps and OLEDs settle, then wider.
HOURS = (0.0, 300.0, 1000.0, 2500.0, 4500.0, 6000.0, 8500.0, 11_500.0, 14_500.0, 18_000.0)

#: Hours between sessions at which ``full`` reads greys, ramps and mixtures but no tips. The neighbouring sessions are
#: near, so that the tips between them lie on the paper's straight line.
OFF_KNOT_HOURS = (1700.0, 5200.0)

TIPS = ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
BLACK = (0.0, 0.0, 0.0)
GREY_LEVELS = (0.08, 0.15, 0.25, 0.35, 0.47, 0.6, 0.7, 0.8, 0.9)
RAMP_LEVELS = (0.15, 0.3, 0.45, 0.6, 0.75, 0.9)
SECONDARY_LEVELS = (0.55, 1.0)
SECONDARIES = ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0))
POSITIONS = (0.1, 0.5, 0.9)
AMBIENT_LX = (40.0, 120.0, 400.0)
COLD_MINUTES = (2.0, 5.0, 10.0, 20.0, 40.0)
WINDOW = 0.1
HOT_K = 8.0


def _grey(level: float) -> tuple[float, float, float]:
    return (level, level, level)


def mixtures(seed: int, count: int = 24) -> Array:
    """Mixtures of all three channels, one quarter of them rather saturated, (count, 3), rounded to three digits."""
    rng = np.random.default_rng([seed, 0x3147])
    drive = rng.uniform(0.1, 1.0, (count, 3))
    drive[np.arange(0, count, 4), rng.integers(0, 3, len(range(0, count, 4)))] *= 0.25
    return np.round(drive, 3)


def readings(design: str, hours: tuple[float, ...], seed: int) -> Readings:
    """Return all readings of a campaign, in reading order. ``seed`` determines the mixtures and temperatures."""
    if design not in DESIGNS:
        raise ValueError(f"no design {design!r}. Pick one of: {', '.join(DESIGNS)}.")
    colours = mixtures(seed)
    between = [hour for hour in OFF_KNOT_HOURS if design == "full" and hours[0] < hour < hours[-1]]
    sessions = [(hour, True) for hour in hours] + [(hour, False) for hour in between if hour not in hours]
    parts = [_session(design, hour, colours) if tips else _between(hour, colours) for hour, tips in sorted(sessions)]
    return _with_temperatures(joined(parts), seed)


def _session(design: str, hour: float, colours: Array) -> Readings:
    """Return one session. Cold readings come first. The tips are spread over it, like a repeated check patch."""
    tips = [*TIPS, BLACK] if design != "tips" else [*TIPS]
    blocks: dict[str, list[tuple[float, float, float]]] = {
        "tips": [],
        "greys": [_grey(level) for level in GREY_LEVELS],
        "colours": _ramps() + _secondaries() + [(float(r), float(g), float(b)) for r, g, b in colours],
    }
    body: list[tuple[float, float, float]] = []
    for name in DESIGNS[: DESIGNS.index("colours" if design == "full" else design) + 1]:
        body += blocks[name]
    half = len(body) // 2
    warm = at_rest([*tips, *body[:half], *tips, *body[half:], *tips], hour)
    return joined([_cold(hour), warm, *_extras(hour, colours)]) if design == "full" else warm


def _between(hour: float, colours: Array) -> Readings:
    greys = [_grey(level) for level in GREY_LEVELS]
    return at_rest([*greys, *_ramps(), *(tuple(colour) for colour in colours)], hour)


def _ramps() -> list[tuple[float, float, float]]:
    return [(level * r, level * g, level * b) for (r, g, b), level in product(TIPS[1:], RAMP_LEVELS)]


def _secondaries() -> list[tuple[float, float, float]]:
    return [(level * r, level * g, level * b) for (r, g, b), level in product(SECONDARIES, SECONDARY_LEVELS)]


def _cold(hour: float) -> Readings:
    patches = at_rest([_grey(level) for _ in COLD_MINUTES for level in (1.0, 0.6)], hour)
    return replace(patches, warmup_min=np.repeat(COLD_MINUTES, 2))


def _extras(hour: float, colours: Array) -> list[Readings]:
    return [_positions(hour), *_room(hour), *_windows(hour), _capped(hour), _hot(hour, colours)]


def _positions(hour: float) -> Readings:
    places = [(u, v) for v, u in product(POSITIONS, POSITIONS) if (u, v) != (0.5, 0.5)]
    patches = at_rest([_grey(level) for _ in places for level in (1.0, 0.6)], hour)
    u, v = np.repeat(np.array(places), 2, axis=0).T
    return replace(patches, u=u, v=v)


def _room(hour: float) -> list[Readings]:
    """Black and a dark grey in room light, then the same patches behind a shroud."""
    lit = at_rest([patch for _ in AMBIENT_LX for patch in (BLACK, _grey(0.25))], hour)
    dark = at_rest([BLACK, _grey(0.25)], hour)
    return [replace(lit, ambient_lx=np.repeat(AMBIENT_LX, 2)), replace(dark, note=(SHROUDED,) * 2)]


def _windows(hour: float) -> list[Readings]:
    """Small windows on black, then black and a dark grey on white."""
    on_black = at_rest([*TIPS, *SECONDARIES, *(_grey(level) for level in (0.3, 0.6, 0.8))], hour)
    on_white = at_rest([BLACK, _grey(0.25)], hour)
    return [
        replace(on_black, window=np.full(on_black.n, WINDOW)),
        replace(on_white, window=np.full(2, WINDOW), surround=np.ones(2)),
    ]


def _capped(hour: float) -> Readings:
    return replace(at_rest([BLACK, BLACK], hour), note=(LENS_CAP,) * 2)


def _hot(hour: float, colours: Array) -> Readings:
    """Two greys and two mixtures, no tips, in a room that is 8 K warmer."""
    patches = at_rest([_grey(0.8), _grey(0.47), *(tuple(colour) for colour in colours[1:3])], hour)
    return replace(patches, temperature_c=np.full(4, REFERENCE_C + HOT_K))


def _with_temperatures(patches: Readings, seed: int) -> Readings:
    """The temperature differs by 0.3 K between sessions and drifts by 0.5 K within one, independent of the minutes."""
    rng = np.random.default_rng([seed, 0x7E])
    hours, session = np.unique(patches.hours, return_inverse=True)
    wander = rng.normal(0.0, 0.3, hours.size)[session] + rng.normal(0.0, 0.5, patches.n)
    return replace(patches, temperature_c=np.round(patches.temperature_c + wander, 1))
