"""A misread patch: a window covered the patch, or the instrument slipped. The reading is named and left out."""

from lutgen.history.causes import Cause

CAUSE = Cause(
    name="misreading",
    meaning="a patch was misread",
    test="read the patch again, with no window over it",
    display="unchanged",
    moves=frozenset(),
    beside=lambda pair: "; ".join(pair.misread),
    spoils=False,
)
