"""Another gamut mode (sRGB, Adobe RGB, native): primaries are mixtures of the panel's; black and additivity stay."""

import numpy as np

from lutgen.history.causes import Cause
from lutgen.history.pair import SessionPair

#: Smallest Δu'v' of the second most moved primary: modes of one gamut differ by less, and aging moves only blue.
_TWO_MOVE = 0.006

#: The same limit if white has not moved (shift below `_STANDS_STILL` of the largest shift), because all modes have the
#: same white.
_TWO_MOVE_ALONE, _STANDS_STILL = 0.003, 0.2


def _is_possible(pair: SessionPair) -> bool:
    *primaries, white = pair.shift
    _, second, largest = sorted(primaries)
    moved = bool({"blue", "colour"} & pair.moved) and second >= _TWO_MOVE
    alone = second >= _TWO_MOVE_ALONE and white <= _STANDS_STILL * largest
    return bool((moved or alone) and "sum" not in pair.moved)


def _prior(pair: SessionPair) -> float:
    if not _is_possible(pair):
        return -np.inf
    if pair.other_settings:
        return 2.0
    recorded = pair.before.settings and pair.after.settings
    return -2.0 if recorded else 0.0


CAUSE = Cause(
    name="gamut-mode",
    meaning="another preset (gamut mode) of the display was chosen",
    test="put the display's preset or colour space back as it was and read the primaries again",
    display="unchanged",
    moves=frozenset({"blue", "colour", "curve"}),
    possible=_is_possible,
    ways=(("gamut",), ("scale", "gamut")),
    prior=_prior,
)
