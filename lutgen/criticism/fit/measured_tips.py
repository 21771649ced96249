"""White and primaries (tips) of every hour: as measured, or interpolated in time between measured hours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from lutgen.readings.rest import TIP_DRIVES
from lutgen.readings.table import is_capped
from lutgen.time_law import between, error_between

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem


def measured_tips(problem: Problem) -> Array:
    """Tips at every hour, as measured or interpolated, (H, 4, 3), cd/m²."""
    hours, drive = problem.readings.hours[problem.rows], problem.readings.drive[problem.rows]
    rest = problem.readings.at_rest()[problem.rows] & ~is_capped(problem.readings)[problem.rows]
    tips = np.empty((problem.hours.size, 4, 3))
    for index in np.flatnonzero(problem.is_knot):
        here = rest & (hours == problem.hours[index])
        for tip in range(4):
            chosen = here & (drive == TIP_DRIVES[tip]).all(axis=1)
            if not chosen.any():
                message = (
                    f"{problem.readings.file}: hour {problem.hours[index]:g}: all readings of white or of one primary "
                    f"contradict others, and are left out. Measure white, red, green and blue of that hour again."
                )
                raise LutgenError(message)
            tips[index, tip] = problem.xyz[chosen].mean(axis=0)
    return interpolated(problem, tips)


def interpolated(problem: Problem, tips: Array) -> Array:
    """Interpolate the hours without measured tips by the law of :mod:`lutgen.time_law`: (..., H, 4, 3)."""
    tips = tips.copy()
    by_hour = np.moveaxis(tips, -3, 0)
    times, values = problem.hours[problem.is_knot], by_hour[problem.is_knot]
    for index in np.flatnonzero(~problem.is_knot):
        by_hour[index] = between(times, values, problem.hours[index])
    return tips


def interpolation_sigma(problem: Problem) -> Array:
    """Error of the interpolated tips of each hour, 1 σ, (H, 4, 3), cd/m²; infinite at hours with measured tips."""
    error = np.full((problem.hours.size, 4, 3), np.inf)
    times, values = problem.hours[problem.is_knot], problem.measured_tips[problem.is_knot]
    for index in np.flatnonzero(~problem.is_knot):
        error[index] = error_between(times, values, problem.hours[index])
    return error
