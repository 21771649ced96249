"""Calibration: the channels' gains and curves in the graphics card; black keeps its light, primaries their colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.history.causes._cause import Cause

if TYPE_CHECKING:
    from lutgen.history.pair import Pair


def _prior(pair: Pair) -> float:
    # Where both files hold their curves, what these do is taken off already.
    return -8.0 if pair.curves_known else 0.0


CAUSE = Cause(
    name="calibration",
    meaning="another calibration was loaded",
    whose="settings",
    test="read a session with the calibration reset (straight curves), or in which the curves are written to the file",
    ways=(("gains",),),
    prior=_prior,
    loose=0.006,
)
