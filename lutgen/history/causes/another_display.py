"""A session of another display in the campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.causes._cause import Cause
from lutgen.history.pair import UNKNOWN

if TYPE_CHECKING:
    from lutgen.history.pair import Pair

#: Δu'v' of a primary that neither aging nor a setting explains: only HDR, a wrong correction, or another panel does.
_MOVED = 0.012

#: ΔL* between native curves of two panels.
_BEND = 2.0


def _seen(pair: Pair) -> str:
    moved = float(np.hypot(*pair.shift[:3].T).max()) if pair.seen is not None else 0.0
    colour = f"a primary moved by Δu'v' {moved:.3f}" if moved >= _MOVED else ""
    if pair.other_display:
        return ", and ".join(part for part in (pair.other_display, colour) if part)
    same_name = pair.after.session.display.lower() not in UNKNOWN and not pair.other_display
    same_name = same_name and pair.before.session.display.lower() not in UNKNOWN
    other_curve = pair.bend is not None and abs(pair.bend) >= _BEND
    if not colour or ((same_name or pair.other_instrument) and not other_curve):
        return ""
    return f"{colour}, and the transfer curve by ΔL* {pair.bend:+.1f}" if other_curve else colour


CAUSE = Cause(
    name="another-display",
    meaning="the session is of another display",
    whose="campaign",
    test="look at the serial number, and read both displays on one day with one instrument",
    seen=_seen,
)
