"""The signal's range or the contrast: levels at an end of a ramp show one light in one session, several in another.

A cable that carries 16 to 235 to an input that takes 0 to 255 for full range crushes nothing; the other way round both
ends are clipped. A contrast, or a channel's gain, that is set too high clips the bright end.
"""

from __future__ import annotations

from lutgen.history.causes import Cause

CAUSE = Cause(
    name="signal-range",
    meaning="levels are clipped in one of the two: another range of the signal, contrast or gain",
    test="set the card's output and the display's input to full range, contrast to its default, and read greys near "
    "white and black again",
    display="cannot tell",
    moves=frozenset({"curve", "contrast"}),
    possible=lambda pair: bool(pair.clipped_otherwise),
    proof=lambda pair: pair.clipped_otherwise,
    rank=5,
)
