"""White and primaries between two measured hours: a straight line in time, and the error of that line.

The display model uses this law for white and primaries at any hour. The criticism uses the law for hours without white
and primaries.
"""

import numpy as np

from lutgen.colorimetry import Array

#: Error of a straight line halfway between two points of a parabola, as a share of the second difference at the spacing
#: of the two points.
CURVATURE = 1 / 8

#: Smallest relative error (1 σ) of a value between two measured times.
LEAST_ERROR = 2e-4

#: Smallest absolute error (1 σ), in the unit of the values, for values near 0.
LEAST = 1e-6


def between(times: Array, values: Array, when: float) -> Array:
    """Interpolate values linearly between the two measured times around ``when``.

    ``times``: measured times, increasing, shape (n,), n ≥ 2. ``values``: the measured values, shape (n, ...). ``when``:
    a time between the first and the last measured time. At a measured time the result is the measured value, exactly.
    """
    after = _after(times, when)
    start, end = times[after - 1], times[after]
    share = (when - start) / (end - start)
    return np.asarray((1.0 - share) * values[after - 1] + share * values[after])


def error_between(times: Array, values: Array, when: float) -> Array:
    """Return the error (1 σ) of :func:`between`, from the curvature at the two measured times around ``when``.

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
    """Return the index of the measured time at the end of the segment that contains ``when``."""
    return int(np.clip(np.searchsorted(times, when), 1, times.size - 1))
