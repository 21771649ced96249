"""True aging: light falls over months, short wavelengths most; black falls with it, or leaks, and curves may drift.

What yellows lies before all channels, a sheet or a lens, or in blue's own light: its filter, its prism, its emitter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.causes import Cause

if TYPE_CHECKING:
    from lutgen.history.causes import Values
    from lutgen.history.pair import SessionPair

#: Days within which a colorimeter sees no aging, and from which on it may.
_TOO_SHORT, LONG = 7.0, 60.0

#: Loss that no display exceeds, in nepers: at once, and per year. Backlights lose half in 10 000 to 50 000 hours.
_SUDDEN, _FASTEST = 0.1, 1.2

#: Loss of the channel that loses least, as a share of that of the channel that loses most: channels share a backlight,
#: and red and green organic emitters last a few times as long as blue ones.
_TOGETHER = 0.15

#: Up to this loss per year, in nepers, a display that dims without a change of colour may have aged as well as been
#: turned down: half in 10 000 hours of continuous operation.
_USUAL = 0.6

#: Δu'v' by which aging moves red or green at most: twice that of the paper's display.
_COLOUR = 0.01


def _long(pair: SessionPair) -> bool:
    return pair.days is None or abs(pair.days) >= LONG


def _may_have_dimmed(change: float, pair: SessionPair) -> bool:
    """Whether a change of all light by one factor, its natural logarithm, may be age: slow, and over months."""
    if pair.days is None:
        return change < 0
    lost = -change if pair.days > 0 else change
    return abs(pair.days) >= LONG and 0 < lost <= _USUAL * abs(pair.days) / 365.25


def _prior(pair: SessionPair) -> float:
    if pair.days is None:
        return -1.0
    if abs(pair.days) < _TOO_SHORT:
        return -np.inf
    return 3.0 if abs(pair.days) >= LONG else -3.0


def _sound(values: Values, pair: SessionPair) -> bool:
    way = -1.0 if pair.days is not None and pair.days < 0 else 1.0
    aged, yellowed = way * values["aged"], way * float(values.get("yellowed", np.zeros(1))[0])
    slow = pair.days is None or -float(aged.mean()) <= _SUDDEN + _FASTEST * abs(pair.days) / 365.25
    # Blue's own filter or emitter fades alone; a backlight does not.
    together = aged.max() <= 0.02 + (0.0 if "faded" in values else _TOGETHER * aged.min())
    return bool(slow and together and aged[2] <= min(aged[0], aged[1]) + 0.02 and yellowed <= 0.01)


def _rival(names: tuple[str, ...], values: Values, pair: SessionPair) -> str:
    """A loss that was explained by one factor, by a meter, or by a matrix beside another cause, may be aging."""
    if "aged" in values:
        return ""
    if "scale" in values and "gains" not in values:
        dimmed = not pair.other_settings and _may_have_dimmed(float(values["scale"][0]), pair)
        return "scale" if dimmed else ""
    if "gauge" in values and len(names) == 1 and not pair.other_instrument:
        change = float(values["gauge"][0])
        lost = change < 0 if pair.days is None or pair.days > 0 else change > 0
        return "gauge" if lost and _long(pair) else ""
    red, green, blue = np.hypot(*pair.shift[:3].T)
    # A matrix that leaves red and green where they were, and moves blue, does what years do.
    alone = len(names) == 1 and "blue" in pair.moved and not pair.other_instrument
    likely = max(red, green) < _COLOUR and (alone or (len(names) > 1 and blue < _COLOUR))
    return "matrix" if "matrix" in values and likely and _long(pair) else ""


CAUSE = Cause(
    name="aging",
    meaning="the display itself has aged",
    test="read again in some months with settings, calibration and instrument untouched: aging goes on",
    display="changed",
    moves=frozenset({"blue", "curve", "contrast"}),
    possible=_long,
    ways=(("aged",), ("aged", "yellowed"), ("aged", "faded")),
    prior=_prior,
    sound=_sound,
    loose=0.006,
    rival=_rival,
    over_time="steady",
    spoils=False,
)
