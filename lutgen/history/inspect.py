"""Inspect one session without a model."""

import numpy as np

from lutgen.history import transfer
from lutgen.history.inspection import Inspection
from lutgen.history.patches import CHANNELS, additivity, mean_xyz, primaries, ramp
from lutgen.history.steadiness import left_out, steadiness
from lutgen.history.transfer import calibration
from lutgen.readings.session import Session


def inspect_session(session: Session) -> Inspection:
    """Inspect a session without a model. A figure is None if the session lacks its patches; ``missing`` names these."""
    session, misread = left_out(session)
    white, black = mean_xyz(session, "white"), mean_xyz(session, "black")
    ramps = {name: ramp(session, name) for name in ("grey", *CHANNELS)}
    curves = {name: curve for name, each in ramps.items() if (curve := transfer.transfer(each, black)) is not None}
    return Inspection(
        session=session,
        white=white,
        black=black,
        primaries=primaries(session),
        curves=curves,
        additivity=additivity(session),
        greys=transfer.grey_tracking(ramps["grey"], white),
        steadiness=steadiness(session),
        calibration=calibration(session),
        uniformity=_uniformity(session),
        misread=misread,
    )


def _uniformity(session: Session) -> tuple[float, float] | None:
    if session.positions is None:
        return None
    white = np.array(session.kinds) == "white"
    middle = session.xyz[white & session.central, 1]
    if not middle.size or middle.mean() <= 0 or np.count_nonzero(white) == middle.size:
        return None
    ratio = session.xyz[white, 1] / middle.mean()
    return float(ratio.min()), float(ratio.max())
