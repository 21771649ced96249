"""Warm-up or automatic brightness: the light drifted during the session."""

from lutgen.errors import listed
from lutgen.history.causes import Cause
from lutgen.history.pair import SessionPair
from lutgen.history.steadiness import FEWEST_SHARED, shared, steadiness
from lutgen.numerals import in_percent

_HOW = {
    "repeats": "as patches that were read again show",
    "order": "as patches of both sessions show by the order in which they were read",
}


def _proof(pair: SessionPair) -> str:
    changes = [
        f"within {whose} luminance changed by {in_percent(each.change, 1, signed=True)}, {_HOW[each.by]}"
        for each, whose in zip(pair.drifts, ("the reference", "the session"), strict=True)
        if each.drifted
    ]
    return f"{listed(changes)}; levels of this pair are uncertain by as much" if changes else ""


def _may_be_hidden(pair: SessionPair) -> bool:
    """Whether a drift would not show: one session repeats no bright patch, and the sessions share few patches."""
    few = shared(*pair.sessions)[0].size < FEWEST_SHARED
    return few and any(steadiness(each) is None for each in pair.sessions)


CAUSE = Cause(
    name="drift",
    meaning="the display warmed up or dimmed itself while it was read",
    test="switch automatic brightness off, let it warm up for half an hour, and read white every ten patches",
    display="cannot tell",
    moves=frozenset({"sum"}),
    possible=_may_be_hidden,
    proof=_proof,
    rank=1,
)
