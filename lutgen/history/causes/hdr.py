"""HDR tone mapping or dynamic contrast: curve, contrast and additivity change together; no fixed setting does this."""

from lutgen.history.causes import Cause
from lutgen.history.pair import SessionPair

#: Change of white over the sum of the primaries that proves HDR without a second moved fact.
_NOT_ADDITIVE = 0.06

#: Change of a curve at equal drive, in ΔL*, as large as by HDR.
_STRONGLY_BENT = 6.0


def _proof(pair: SessionPair) -> str:
    """Return a sentence if additivity changed much or with another fact, or curve and contrast both changed; or ""."""
    moved = pair.moved
    if pair.seen is None or not {"sum", "curve"} & moved:
        return ""
    before, after = pair.additivity
    much = len(moved) > 1 or abs(after - before) >= _NOT_ADDITIVE
    if not ("sum" in moved and much) and not {"curve", "contrast"} <= moved:
        return ""
    return ", ".join(pair.describe(fact) for fact in ("sum", "curve", "colour", "blue", "contrast") if fact in moved)


CAUSE = Cause(
    name="hdr",
    noun="HDR",
    meaning="HDR or dynamic contrast was on in one of the two",
    test="switch HDR and dynamic contrast off in system and display, and read the same chart again",
    display="cannot tell",
    moves=frozenset({"blue", "colour", "curve", "sum", "contrast"}),
    possible=lambda pair: bool({"sum", "contrast"} & pair.moved),
    proof=_proof,
    rank=4,
    alone=False,
    bends=lambda pair: abs(pair.bend or 0.0) >= _STRONGLY_BENT and not pair.recalibrated,
)
