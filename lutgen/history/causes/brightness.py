"""Brightness: one factor of all light, including black; a preset may also set the channels' gains and the curve.

A lamp that is dimmed to a small part of its light is colder, which changes its colour and the primaries a little.
"""

import numpy as np

from lutgen.history.causes import Cause, Values
from lutgen.history.pair import COLOUR_MOVED, LEAP, SessionPair

#: Smallest change of all light, as a natural logarithm, with which a lamp's own colour changes.
_FAR = np.log(2.0)


def _sound(values: Values, pair: SessionPair) -> bool:
    if "matrix" not in values:
        return True
    far = abs(float(values["scale"][0])) >= _FAR
    return far and pair.largest_shift < COLOUR_MOVED and not pair.other_instrument


def _rival(names: tuple[str, ...], values: Values, pair: SessionPair) -> str:
    """Return the parameter of another explanation, a gain of the instrument, that a setting may cause; or ""."""
    if pair.other_instrument or len(names) > 1:
        return ""
    if "step" in values:
        return "step" if abs(float(values["step"][0])) >= LEAP else ""
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
