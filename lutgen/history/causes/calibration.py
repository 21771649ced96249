"""Calibration: the channels' gains and curves in the graphics card; black keeps its light, primaries their colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes import Cause

if TYPE_CHECKING:
    from lutgen.history.pair import SessionPair


def _prior(pair: SessionPair) -> float:
    # Where both files hold their curves, the comparison is made behind these curves already.
    return -8.0 if pair.curves_known else 0.0


def _bends(pair: SessionPair) -> bool:
    return pair.recalibrated or (pair.bent and not pair.curves_known)


CAUSE = Cause(
    name="calibration",
    meaning="another calibration was loaded",
    test="read a session with the calibration reset (straight curves), or in which the curves are written to the file",
    display="unchanged",
    moves=frozenset({"curve"}),
    ways=(("gains",),),
    prior=_prior,
    loose=0.006,
    bends=_bends,
)
