"""The range of the signal, or contrast: levels at an end of a ramp are clipped in one session and distinct in another.

A signal of 16 to 235 on an input that expects 0 to 255 clips nothing; a signal of 0 to 255 on an input that expects 16
to 235 clips both ends. A contrast, or a channel's gain, that is set too high clips the bright end.
"""

from lutgen.errors import listed
from lutgen.history.causes import Cause
from lutgen.history.pair import SessionPair
from lutgen.history.patches import CHANNELS, black_xyz, ramp
from lutgen.history.transfer import NEAR, Transfer, transfer
from lutgen.readings.session import Session

_WHOSE = ("the reference", "the session")


def _proof(pair: SessionPair) -> str:
    """Return a sentence on levels that are clipped in one session and distinct in the other; or "".

    "" also if the files' calibrations differ, since calibrations clip too.
    """
    if pair.recalibrated:
        return ""
    curves = [_curves(each) for each in pair.sessions]
    sentences = []
    for (mine, theirs), (here, there) in zip((curves, curves[::-1]), (_WHOSE, _WHOSE[::-1]), strict=True):
        places: dict[str, list[str]] = {}
        # Another range of the signal crushes the dark end of all channels; a single dark channel is noise of the meter.
        all_crushed = all(curve.crushed_to is not None for curve in mine.values())
        for name in [each for each in mine if each in theirs]:
            high, low = mine[name].clipped_from, mine[name].crushed_to
            if high is not None and _resolves(theirs[name], high, 1.0 - NEAR):
                places.setdefault(f"from code {high:.2f} up", []).append(name)
            if all_crushed and low is not None and _resolves(theirs[name], NEAR, low):
                places.setdefault(f"up to code {low:.2f}", []).append(name)
        sentences += [
            f"{listed(names)} {'show' if len(names) > 1 else 'shows'} one light {where} in {here}, and not in {there}"
            for where, names in places.items()
        ]
    return "; ".join(sentences)


def _curves(session: Session) -> dict[str, Transfer]:
    curves = {name: transfer(ramp(session, name), black_xyz(session)) for name in CHANNELS}
    return {name: curve for name, curve in curves.items() if curve is not None}


def _resolves(curve: Transfer, low: float, high: float) -> bool:
    """Whether a curve has levels in a range of code values, and none of these levels is clipped."""
    inside = (curve.drive >= low - 1e-6) & (curve.drive <= high + 1e-6)
    clipped = [code for code in (curve.clipped_from, curve.crushed_to) if code is not None]
    return bool(inside.any()) and not any(low - NEAR <= code <= high + NEAR for code in clipped)


CAUSE = Cause(
    name="signal-range",
    meaning="levels are clipped in one of the two: another range of the signal, contrast or gain",
    test="set the card's output and the display's input to full range, contrast to its default, and read greys near "
    "white and black again",
    display="cannot tell",
    moves=frozenset({"curve", "contrast"}),
    possible=lambda pair: bool(_proof(pair)),
    proof=_proof,
    rank=5,
)
