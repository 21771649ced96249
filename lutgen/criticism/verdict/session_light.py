"""Light that a whole session has more than another: a meter's gain and the display's brightness look alike.

A fit that foretells every session from the first one frees a gain for each, of the size that a meter may have. No
effect is named for what the gains take up, so that a comparison without them may fail where a diagnosis finds nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.criticism.fit.least_squares import Fit

#: Sessions differ in light where they do by so many standard deviations of that difference.
CLEARLY = 3.0


def more_light(found: Fit) -> str:
    """Say which session has how much more light than another; "" where a usual meter's gain does as much."""
    keys, gains = found.problem.gain_keys, found.gains
    if len(keys) < 2:
        return ""
    least, most = int(np.argmin(gains)), int(np.argmax(gains))
    more = float((1.0 + gains[most]) / (1.0 + gains[least]) - 1.0)
    if more < CLEARLY * np.sqrt(2.0) * found.problem.noise.session:
        return ""
    (hour, name), (other_hour, other) = keys[most], keys[least]
    at, than = (name, other) if hour == other_hour else (f"{hour:g} h", f"{other_hour:g} h")
    return f"at {at} it is {more:.1%} more than foretold from {than}, in all colours alike"
