"""Grey tracking: how far greys are from the colour of the session's own white, level by level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import delta_e_2000, xy_to_uv, xyz_to_lab, xyz_to_xyY

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.history.patches import Ramp

#: Below this code value the black's own colour rules.
LOWEST = 0.1


@dataclass(frozen=True)
class GreyTracking:
    """Colour of the greys, as seen, black included.

    Attributes
    ----------
    drive
        Code values from 0.1 up to white's, (n,).
    shift
        u', v' of each less white's, (n, 2).
    delta_e
        ΔE2000 to a grey of the same luminance in white's colour, under white, (n,).

    """

    drive: Array
    shift: Array
    delta_e: Array


def grey_tracking(ramp: Ramp, white: Array | None) -> GreyTracking | None:
    """Return the colour of a grey ramp against white, (3,); None where there are no greys, or no white."""
    if white is None or white[1] <= 0:
        return None
    kept = (ramp.drive >= LOWEST) & (ramp.drive < 1.0 - 1e-4) & (ramp.xyz[:, 1] > 0)
    if not kept.any():
        return None
    xyz = ramp.xyz[kept]
    uv = xy_to_uv(xyz_to_xyY(np.vstack([white, xyz]))[:, :2])
    neutral = xyz[:, 1:2] / white[1] * white
    return GreyTracking(
        ramp.drive[kept], uv[1:] - uv[0], delta_e_2000(xyz_to_lab(xyz, white), xyz_to_lab(neutral, white))
    )
