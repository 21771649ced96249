"""Brightness: all light by one factor, black too; a preset may set the channels' gains and the curve besides.

A lamp that is dimmed to a small part of its light is colder, and its own colour moves a little, primaries with it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.causes import Cause
from lutgen.history.pair import COLOUR_MOVED

if TYPE_CHECKING:
    from lutgen.history.causes import Values
    from lutgen.history.pair import SessionPair

#: Change of all light, in natural logarithms, that a wrong correction alone hardly makes.
_LEAP = 0.15


#: Factor of all light, as a natural logarithm, from which on a lamp's own colour moves with it.
_FAR = np.log(2.0)


def _sound(values: Values, pair: SessionPair) -> bool:
    if "matrix" not in values:
        return True
    far = abs(float(values["scale"][0])) >= _FAR
    return far and pair.largest_shift < COLOUR_MOVED and not pair.other_instrument


def _rival(names: tuple[str, ...], values: Values, pair: SessionPair) -> str:
    """A change of all light that the instrument explains may be a setting instead."""
    if pair.other_instrument or len(names) > 1:
        return ""
    if "step" in values:
        return "step" if abs(float(values["step"][0])) >= _LEAP else ""
    return "gauge" if "gauge" in values else ""


CAUSE = Cause(
    name="brightness",
    meaning="the display's brightness or preset was changed",
    test="put brightness and preset back as they were and read white and black again",
    display="unchanged",
    moves=frozenset({"curve"}),
    ways=(("scale",), ("gains",), ("scale", "gains"), ("scale", "matrix")),
    prior=lambda pair: 2.0 if pair.other_settings else 0.0,
    sound=_sound,
    loose=0.006,
    bends=lambda pair: pair.bent and not pair.recalibrated,
    rival=_rival,
    over_time="step",
)
