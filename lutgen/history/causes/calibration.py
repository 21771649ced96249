"""Calibration: gains and curves of the channels in the graphics card; black and the colours of primaries stay."""

from lutgen.history.causes import Cause

CAUSE = Cause(
    name="calibration",
    meaning="another calibration was loaded",
    test="read a session with the calibration reset (straight curves), or in which the curves are written to the file",
    display="unchanged",
    moves=frozenset({"curve"}),
    ways=(("gains",),),
    # If both files hold their curves, the comparison has removed the effect of these curves already.
    prior=lambda pair: -8.0 if pair.curves_known else 0.0,
    loose=0.006,
    bends=lambda pair: pair.recalibrated or (pair.bent and not pair.curves_known),
)
