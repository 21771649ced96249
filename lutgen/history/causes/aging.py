"""True aging: light falls over months, blue first, black along with it; primaries keep nearly their colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes._cause import Cause

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.history.pair import Pair

#: Days in which no display ages so that a colorimeter sees it, and from which it may.
_TOO_SHORT, LONG = 7.0, 60.0

#: Loss that no display exceeds, in nepers: at once, and per year. Backlights lose half in 10 000 to 50 000 hours.
_SUDDEN, _FASTEST = 0.1, 1.2

#: The channel that loses least loses this share of what the one does that loses most: they share a backlight, and an
#: emitter of organic red or green lasts some times as long as blue, not for ever.
_TOGETHER = 0.15


#: Loss per year, in nepers, up to which a display that dims without changing colour is as likely to age as to be turned
#: down: half in 10 000 hours, on day and night.
_USUAL = 0.6


def may_have_dimmed(change: float, pair: Pair) -> bool:
    """Whether a change of all light by one factor, its natural logarithm, may be age: slow, and over months."""
    if pair.days is None:
        return change < 0
    lost = -change if pair.days > 0 else change
    return abs(pair.days) >= LONG and 0 < lost <= _USUAL * abs(pair.days) / 365.25


def _prior(pair: Pair) -> float:
    if pair.days is None:
        return -1.0
    if abs(pair.days) < _TOO_SHORT:
        return -20.0
    return 3.0 if abs(pair.days) >= LONG else -3.0


def _sound(values: Mapping[str, Array], pair: Pair) -> bool:
    aged = values["aged"]
    if pair.days is not None and pair.days < 0:
        aged = -aged
    slow = pair.days is None or -float(aged.mean()) <= _SUDDEN + _FASTEST * abs(pair.days) / 365.25
    together = aged.max() <= 0.02 + _TOGETHER * aged.min()
    return bool(slow and together and aged[2] <= min(aged[0], aged[1]) + 0.02)


CAUSE = Cause(
    name="aging",
    meaning="the display itself has aged",
    whose="display",
    test="read again in some months with settings, calibration and instrument untouched: aging goes on",
    ways=(("aged",),),
    prior=_prior,
    sound=_sound,
    loose=0.006,
)
