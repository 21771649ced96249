"""The range of the signal, or contrast: levels at an end of a ramp are clipped in one session and distinct in another.

A signal of 16 to 235 on an input that expects 0 to 255 clips nothing; a signal of 0 to 255 on an input that expects 16
to 235 clips both ends. A contrast, or a channel's gain, that is set too high clips the bright end.
"""

from lutgen.history.causes import Cause

CAUSE = Cause(
    name="signal-range",
    meaning="levels are clipped in one of the two: another range of the signal, contrast or gain",
    test="set the card's output and the display's input to full range, contrast to its default, and read greys near "
    "white and black again",
    display="cannot tell",
    moves=frozenset({"curve", "contrast"}),
    possible=lambda pair: bool(pair.clipping_difference),
    proof=lambda pair: pair.clipping_difference,
    rank=5,
)
