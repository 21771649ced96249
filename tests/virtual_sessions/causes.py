"""Labelled differences between two sessions, each at several sizes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_sessions.display import Panel, State, chart, csv_text, panel, read, ti3_text

if TYPE_CHECKING:
    from tests.virtual_sessions.display import Array

#: Cause → sizes.
SIZES: dict[str, tuple[float, ...]] = {
    "same": (0.0,),
    "brightness": (0.5, 0.8, 1.3),
    "calibration": (0.05, 0.1, 0.2),
    "curve": (1.08, 1.2),
    "tables": (0.05, 0.15),
    "ambient": (0.15, 0.5, 2.0),
    "instrument": (0.03, 0.06, 0.12),
    "hdr": (0.6, 1.0),
    "dynamic": (0.3, 0.6),
    "drift": (0.03, 0.06, 0.15),
    "aging": (0.1, 0.25, 0.5),
    "another-display": (0.0,),
    "gamut-mode": (0.1, 0.2),
    "signal-range": (0.85, 0.7),
}

#: The name of the cause in a verdict.
LABELS = {"curve": "calibration", "tables": "calibration", "dynamic": "hdr"}


@dataclass(frozen=True)
class Case:
    """Two sessions as text, the days between them, and the cause of their difference."""

    before: str
    after: str
    days: int
    label: str


def case(cause: str, size: float, seed: int) -> Case:
    """Simulate one pair of sessions.

    The light of a session repeats within 0.5 %, the readings of an instrument within 0.05 to 0.3 %.
    """
    rng = np.random.default_rng([seed, *cause.encode(), int(1000 * size)])
    display = panel(rng)
    noise, floor = rng.uniform(0.0005, 0.003), rng.uniform(0.001, 0.008)
    code = chart(steps=int(rng.integers(8, 18)))
    usual = State(brightness=float(np.exp(rng.normal(0.0, 0.005))))
    state = _state(cause, size, display, rng)
    again = replace(state, brightness=state.brightness * float(np.exp(rng.normal(0.0, 0.005))))
    other = panel(rng) if cause == "another-display" else _mixed(display, size) if cause == "gamut-mode" else display
    one = read(display, usual, code, rng, noise=noise, floor=floor)
    two = read(other, again, code, rng, noise=noise, floor=floor)
    days = int(rng.integers(200, 2000)) if cause in {"aging", "another-display"} or rng.random() < 0.5 else 0
    if cause == "tables":
        texts = [
            ti3_text(code, xyz, "Tue Mar 04 10:12:00 2025", ends)
            for xyz, ends in ((one, usual.gains), (two, again.gains))
        ]
    else:
        texts = [csv_text(code, xyz) for xyz in (one, two)]
    return Case(texts[0], texts[1], days, LABELS.get(cause, cause))


def _state(cause: str, size: float, display: Panel, rng: np.random.Generator) -> State:
    room = np.array([(0.95, 1.0, 1.09), (1.1, 1.0, 0.36), (0.99, 1.0, 0.64)][int(rng.integers(3))])
    gains = 1.0 - size * rng.permutation([0.0, 0.5, 1.0])
    fallen = 1.0 - size * np.array([0.85, 0.9, 1.15]) * rng.uniform(0.95, 1.05, 3)
    way = 1.0 if rng.random() < 0.5 else -1.0
    states = {
        "brightness": State(brightness=size),
        "calibration": State(gains=gains),
        "tables": State(gains=gains),
        "curve": State(curve=size),
        "ambient": State(ambient=size * room),
        "instrument": State(matrix=_correction(size, display, rng)),
        "hdr": State(hdr=size),
        "dynamic": State(dynamic=size),
        "signal-range": State(clip=size),
        "drift": State(drift=size * way),
        "aging": State(aged=fallen, yellowed=1.0 - 0.02 * size * np.array([0.0, 0.2, 1.0])),
    }
    return states.get(cause, State())


def _mixed(display: Panel, size: float) -> Panel:
    """Return a panel whose preset mixes each primary from all three; white does not change.

    An sRGB preset on a panel of wider gamut mixes the primaries in this way.
    """
    share = size * np.array([[0.0, 0.7, 0.3], [0.5, 0.0, 0.2], [0.05, 0.3, 0.0]])
    return replace(display, channels=(np.eye(3) + share - np.diag(share.sum(axis=0))).astype(float) @ display.channels)


def _correction(size: float, display: Panel, rng: np.random.Generator) -> Array:
    """Return a correction for another kind of backlight: all primaries move towards white, or away from it."""
    whole = display.channels.sum(axis=0)
    sign = 1.0 if rng.random() < 0.5 else -1.0
    share = display.channels[:, 1] / display.channels[:, 1].sum()
    moved = display.channels + sign * size * (share[:, np.newaxis] * whole - display.channels) * rng.uniform(
        0.6, 1.4, (3, 1)
    )
    return np.asarray(moved.T @ np.linalg.inv(display.channels.T) * rng.uniform(0.97, 1.03))
