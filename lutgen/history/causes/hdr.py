"""HDR tone mapping or dynamic contrast: curve, contrast and additivity change together, as no fixed setting does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.causes._cause import Cause

if TYPE_CHECKING:
    from lutgen.history.pair import Pair

#: Change of a curve in L*, of white over the sum of the primaries, of a primary's u'v', and of contrast as a factor,
#: from which each is a sign. Two make the cause, for each alone has a harmless one ...
_BEND, _ADDITIVITY, _COLOUR, _CONTRAST = 3.0, 0.04, 0.01, 1.8

#: ... but for a sum of the primaries that changed by this much.
NOT_ADDITIVE = 0.06


def hdr_signs(pair: Pair) -> list[str]:
    """Say what changed of the sum of the primaries or the curve, and what else did where one of them has."""
    before, after = pair.additivity
    signs = []
    if abs(after - before) >= _ADDITIVITY and max(abs(after - 1.0), abs(before - 1.0)) >= _ADDITIVITY:
        signs.append(f"white over red + green + blue went from {before:.3f} to {after:.3f}")
    if pair.bend is not None and abs(pair.bend) >= _BEND:
        signs.append(f"the transfer curve moved by ΔL* {pair.bend:+.1f}")
    if not signs:
        return []
    moved = float(np.hypot(*pair.shift[:3].T).max())
    if moved >= _COLOUR:
        signs.append(f"a primary moved by Δu'v' {moved:.3f}")
    if pair.contrast and abs(np.log(pair.contrast[1] / pair.contrast[0])) >= np.log(_CONTRAST):
        signs.append(f"contrast went from {pair.contrast[0]:.0f} to {pair.contrast[1]:.0f}")
    return signs


def _seen(pair: Pair) -> str:
    if pair.seen is None:
        return ""
    signs = hdr_signs(pair)
    before, after = pair.additivity
    return ", ".join(signs) if len(signs) > 1 or abs(after - before) >= NOT_ADDITIVE else ""


CAUSE = Cause(
    name="hdr",
    meaning="HDR or dynamic contrast was on in one of the two",
    whose="settings",
    test="switch HDR and dynamic contrast off in system and display, and read the same chart again",
    seen=_seen,
)
