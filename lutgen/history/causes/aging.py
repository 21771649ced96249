"""True aging: light falls over months, short wavelengths most. Black falls too, or leaks, and curves may drift.

A layer that yellows lies in front of all channels (a sheet, a lens) or only in front of blue (a filter, a prism); an
emitter of blue may fade too.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.history.causes import Cause, Values
from lutgen.history.pair import SessionPair

#: Days. A colorimeter measures no aging within less than the first number; it may measure aging from the second on.
_TOO_SHORT, LONG = 7.0, 60.0

#: Largest possible losses, in nepers: at once, and per year. Backlights lose half in 10 000 to 50 000 hours.
_SUDDEN, _FASTEST = 0.1, 1.2

#: Smallest ratio of the smallest to the largest loss of the channels: channels share a backlight, and red and green
#: organic emitters last a few times as long as blue emitters.
_TOGETHER = 0.15

#: Largest gain of a channel, in nepers, that is an error of the meter.
_EVEN = 0.02

#: Largest loss per year, in nepers, by aging without a change of colour: half in 10 000 hours of continuous operation.
_USUAL = 0.6

#: Smallest loss of each channel, in nepers, that may be aging although a matrix also explains the pair; an assumption.
_LEAST_LOSS = 0.05

#: Largest relative gain of short wavelengths, in nepers, that is an error of the meter.
_BLUER = 0.01

#: Largest Δu'v' of red or green by aging: twice that of the paper's display.
_COLOUR = 0.01


def _long(pair: SessionPair) -> bool:
    return pair.days is None or abs(pair.days) >= LONG


def _loss(change: float, pair: SessionPair) -> float:
    """Return the light that the later session lacks, from a change of all light since the reference (nepers)."""
    return change if pair.days is not None and pair.days < 0 else -change


def _prior(pair: SessionPair) -> float:
    if pair.days is None:
        return -1.0
    if abs(pair.days) < _TOO_SHORT:
        return -np.inf
    return 3.0 if abs(pair.days) >= LONG else -3.0


def _sound(values: Values, pair: SessionPair) -> bool:
    sign = -1.0 if pair.days is not None and pair.days < 0 else 1.0
    aged = sign * values["aged"]
    if pair.holds_luminance:
        aged = aged - _made_up(aged)
    # Light of short wavelengths is lost and does not come back: not in white, and not in the blue channel.
    yellowed = sign * float(values.get("yellowed", np.zeros(1))[0])
    short_of_blue = float(aged[2]) + sign * float(values["faded"][1]) if "faded" in values else 0.0
    slow = pair.days is None or -float(aged.mean()) <= _SUDDEN + _FASTEST * abs(pair.days) / 365.25
    # A filter or emitter of blue may fade alone; a backlight dims all channels.
    together = aged.max() <= _EVEN + (0.0 if "faded" in values else _TOGETHER * aged.min()) + 1e-9
    blue_fades = aged[2] <= min(aged[0], aged[1]) + _EVEN and max(yellowed, short_of_blue) <= _BLUER
    return bool(slow and together and blue_fades)


def _lost(change: Array, pair: SessionPair) -> bool:
    """Whether the light of each channel fell, (3,); under a sensor, whether blue fell most, beside the others."""
    if pair.holds_luminance:
        return bool(change[2] == change.min() < change.max() - _LEAST_LOSS)
    return bool((change < -_LEAST_LOSS).all())


def _made_up(aged: Array) -> float:
    """Return the smallest common loss, in nepers, that a sensor must have made up for if changes (3,) are aging."""
    return float(max(aged.max() - _EVEN - _TOGETHER * aged.min(), 0.0) / (1.0 - _TOGETHER))


def _rival(names: tuple[str, ...], values: Values, pair: SessionPair) -> str:
    """Return the parameter of another explanation (a factor, a meter's gain or a matrix) that may be aging; or ""."""
    if "aged" in values:
        return ""
    if "scale" in values and "gains" not in values:
        most = np.inf if pair.days is None else _USUAL * abs(pair.days) / 365.25
        dimmed = _long(pair) and 0 < _loss(float(values["scale"][0]), pair) <= most
        return "scale" if dimmed and not pair.other_settings else ""
    if "gauge" in values and len(names) == 1 and not pair.other_instrument:
        return "gauge" if _long(pair) and _loss(float(values["gauge"][0]), pair) > 0 else ""
    red, green, blue, _ = pair.shift
    change = pair.light_change
    dimmed = pair.same_instrument and change is not None and bool(_lost(change, pair))
    # A matrix that moves only blue makes the same change as years of aging. So does a matrix that dims all channels of
    # a display, or those that a sensor does not hold, if one instrument read both sessions.
    alone = len(names) == 1 and not pair.other_instrument and ("blue" in pair.moved or dimmed)
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
