"""A session of another display in the campaign: its primaries differ, including red and green."""

from lutgen.history.causes import Cause, Values
from lutgen.history.pair import LEAP, SessionPair

#: Smallest ΔL* between native curves that suggests two panels.
_BEND = 2.0


def _colour(pair: SessionPair) -> str:
    return f"a primary moved by Δu'v' {pair.largest_shift:.3f}" if {"blue", "colour"} & pair.moved else ""


def _sign(pair: SessionPair) -> str:
    """Return a clause if red or green, or blue and the curve, moved and the records do not name one display; or ""."""
    other_curve = pair.bend is not None and abs(pair.bend) >= _BEND
    moved = "colour" in pair.moved or ("blue" in pair.moved and other_curve)
    if not moved or pair.named_alike or (pair.other_instrument and not other_curve):
        return ""
    return f"{_colour(pair)}, and the transfer curve by ΔL* {pair.bend:+.1f}" if other_curve else _colour(pair)


def _rival(names: tuple[str, ...], values: Values, pair: SessionPair) -> str:
    """Return the parameter of another explanation, a matrix or a step, that another panel may cause; or ""."""
    changed = next((name for name in ("matrix", "gamut") if name in values), "")
    if changed and (_sign(pair) or (len(names) > 1 and not pair.named_alike)):
        return changed
    leapt = abs(float(values["step"][0])) >= LEAP if "step" in values and len(names) == 1 else False
    return "step" if leapt and not pair.other_instrument and not pair.named_alike else ""


CAUSE = Cause(
    name="another-display",
    meaning="the session is of another display",
    test="look at the serial number, and read both displays on one day with one instrument",
    display="cannot tell",
    moves=frozenset({"blue", "colour", "curve", "contrast"}),
    possible=lambda pair: bool(_sign(pair)),
    proof=lambda pair: pair.other_display and ", and ".join(filter(None, (pair.other_display, _colour(pair)))),
    rank=3,
    sign=_sign,
    rival=_rival,
)
