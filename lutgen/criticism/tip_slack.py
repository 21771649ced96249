"""How well a straight line between sessions knows the tips of an hour at which none was read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: A straight line between three equidistant points of a parabola misses it by ⅛ of the second difference.
CURVATURE = 1 / 8

#: Latent tips at an hour between are known no better than this share of themselves.
LEAST_SLACK = 2e-4


def tip_slack(hours: Array, is_knot: NDArray[np.bool_], tips: Array) -> Array:
    """1 σ of the tips (H, 4, 3) of each hour (H,); infinite at the hours at which they were read, ``is_knot`` (H,)."""
    slack = np.full((hours.size, 4, 3), np.inf)
    knots = np.flatnonzero(is_knot)
    for index in np.flatnonzero(~is_knot):
        after = int(np.clip(np.searchsorted(knots, index), 1, knots.size - 1))
        span = hours[knots[after]] - hours[knots[after - 1]]
        bends = []
        for middle in {after - 1, after} & set(range(1, knots.size - 1)):
            a, b, c = knots[middle - 1], knots[middle], knots[middle + 1]
            left = (tips[b] - tips[a]) / (hours[b] - hours[a])
            right = (tips[c] - tips[b]) / (hours[c] - hours[b])
            bends.append(np.abs(right - left) * 2 / (hours[c] - hours[a]) * span**2)
        bend = np.max(bends, axis=0) if bends else np.zeros((4, 3))
        floor = LEAST_SLACK * np.abs(tips[index]) + 1e-6
        slack[index] = np.maximum(CURVATURE * bend, floor)
    return slack
