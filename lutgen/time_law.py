"""White and primaries between two measured hours: a straight line in time, and the error of that line.

The display model (white and primaries at any hour) and the criticism (hours without white and primaries) use this law.
Another law, such as a spline, would be written here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: A straight line between three equidistant points of a parabola misses it by ⅛ of the second difference.
CURVATURE = 1 / 8

#: A value between two measured times is known no better than this share of itself.
LEAST_ERROR = 2e-4

#: Nor better than this, in the unit of the values: values may be 0.
LEAST = 1e-6


def between(times: Array, values: Array, when: float) -> Array:
    """Values at one time, on the straight line between the two measured times around it.

    ``times``: measured times, increasing, shape (n,), n ≥ 2. ``values``: what was measured, shape (n, ...). ``when``: a
    time from the first to the last measured one; at a measured time its value is returned to the last bit.
    """
    after = _after(times, when)
    start, end = times[after - 1], times[after]
    share = (when - start) / (end - start)
    return np.asarray((1.0 - share) * values[after - 1] + share * values[after])


def error_between(times: Array, values: Array, when: float) -> Array:
    """Error of :func:`between` at a time without measurement, 1 σ, from the bends at the two measured times around it.

    Parameters as :func:`between`. Returns the shape of one value.
    """
    after = _after(times, when)
    span = times[after] - times[after - 1]
    bends = []
    for middle in {after - 1, after} & set(range(1, times.size - 1)):
        before_it, after_it = times[middle] - times[middle - 1], times[middle + 1] - times[middle]
        left = (values[middle] - values[middle - 1]) / before_it
        right = (values[middle + 1] - values[middle]) / after_it
        bends.append(np.abs(right - left) * 2 / (times[middle + 1] - times[middle - 1]) * span**2)
    bend = np.max(bends, axis=0) if bends else 0.0
    floor = LEAST_ERROR * np.abs(between(times, values, when)) + LEAST
    return np.asarray(np.maximum(CURVATURE * bend, floor))


def _after(times: Array, when: float) -> int:
    """Index of the measured time that ends the piece in which ``when`` lies."""
    return int(np.clip(np.searchsorted(times, when), 1, times.size - 1))
