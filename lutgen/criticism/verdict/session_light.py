"""Difference in light between whole sessions: the meter's gain and the display's brightness cannot be distinguished.

A fit that predicts every session from the first one frees a gain for each session, with the prior of a usual meter.
No effect is named for these gains. A comparison has no gains, so it may fail where a diagnosis finds nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.criticism.fit.least_squares import Fit

#: Two sessions differ in light where the difference exceeds so many of its standard deviations.
CLEARLY = 3.0


def more_light(current: Fit) -> str:
    """Say which session has how much more light than another; "" where the gain of a usual meter explains this."""
    keys, gains = current.problem.gain_keys, current.gains
    if len(keys) < 2:
        return ""
    least, most = int(np.argmin(gains)), int(np.argmax(gains))
    more = float((1.0 + gains[most]) / (1.0 + gains[least]) - 1.0)
    if more < CLEARLY * np.sqrt(2.0) * current.problem.noise.session:
        return ""
    (hour, name), (other_hour, other) = keys[most], keys[least]
    at, than = (name, other) if hour == other_hour else (f"{hour:g} h", f"{other_hour:g} h")
    return f"at {at} it is {more:.1%} more than predicted from {than}, equally in all colours"
