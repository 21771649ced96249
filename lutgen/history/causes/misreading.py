"""One patch misread: a window popped up, the instrument slipped. The reading is left out, and named."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes import Cause

if TYPE_CHECKING:
    from lutgen.history.pair import SessionPair


def _beside(pair: SessionPair) -> str:
    return "; ".join(pair.misread)


CAUSE = Cause(
    name="misreading",
    meaning="a patch was misread",
    test="read the patch again, with no window over it",
    display="unchanged",
    moves=frozenset(),
    beside=_beside,
    spoils=False,
)
