"""Rung: a smooth residual, the posterior mean of a Gaussian process in code values, with its standard error.

Rasmussen & Williams, Gaussian Processes for Machine Learning (2006), equations 2.25 and 2.26; squared exponential
covariance. The residual of the rung below is in CIELAB units (X, Y and Z times CIELAB's slopes), so that one noise
level is valid for black and white. No formula describes this residual; a 3D LUT can carry it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # scipy loads its parts lazily; most displays need none

from lutgen.colorimetry import Array
from lutgen.display.own_model.drive import Drive
from lutgen.display.own_model.least_squares import trust
from lutgen.display.own_model.sample import Sample, lab_slope

NAME = "a smooth residual"

#: Number of colours in one chunk: their covariances with 1000 readings take 32 MB.
CHUNK = 4096

#: Points along an edge of the table (the correlation length is at least 0.12), and further points beyond each end, for
#: the cubic interpolation.
GRID, BEYOND = 21, 4


@dataclass(frozen=True)
class SmoothResidual:
    """The rung below plus a smooth residual: code values (m, 3) → shares of white's X, Y and Z, (m, 3)."""

    #: The rung below.
    below: Callable[[Array], Array]
    #: Conversion of code values to the drive of the panel.
    drive: Drive
    #: Drives of the readings, (n, 3).
    centres: Array
    #: Weights of the centres for X, Y and Z, (n, 3), in units of CIELAB's 116 f.
    weights: Array
    #: Variance of each reading over the variance of the process, (n,).
    noise: Array
    #: Correlation length of the process, in code values.
    length: float
    #: Standard deviation of the process in X, Y and Z, (3,), in units of CIELAB's 116 f.
    size: Array

    def __call__(self, code: Array) -> Array:
        """See the class."""
        below = self.below(code)
        added = np.empty_like(below)
        for here in _chunks(len(code)):
            added[here] = likeness(self.drive(code[here]), self.centres, self.length) @ self.weights
        return np.asarray(below + added / lab_slope(below))

    def near(self, code: Array) -> Array:
        """Return nearly the same shares, accurate to 1e-4, from a table of the residual; faster for many calls."""
        below, driven = self.below(code), self.drive(code)
        added = [
            scipy.ndimage.map_coordinates(each, driven.T * (GRID - 1) + BEYOND, order=3, mode="mirror", prefilter=False)
            for each in self._table
        ]
        return np.asarray(below + np.stack(added, axis=1) / lab_slope(below))

    @cached_property
    def _table(self) -> list[Array]:
        axis = np.arange(-BEYOND, GRID + BEYOND) / (GRID - 1)
        grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        added = np.concatenate([
            likeness(grid[here], self.centres, self.length) @ self.weights for here in _chunks(len(grid))
        ])  # fmt: skip
        return [scipy.ndimage.spline_filter(each.reshape((axis.size,) * 3), order=3, mode="mirror") for each in added.T]

    def standard_error(self, code: Array) -> Array:
        """Return the standard error at code values (m, 3), as shares of white, (m, 3)."""
        variance = np.empty(len(code))
        for here in _chunks(len(code)):
            like = likeness(self.drive(code[here]), self.centres, self.length)
            variance[here] = 1.0 - (scipy.linalg.solve_triangular(self._root, like.T, lower=True) ** 2).sum(axis=0)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0))[:, np.newaxis] * self.size / lab_slope(self.below(code)))

    @cached_property
    def _root(self) -> Array:
        own = likeness(self.centres, self.centres, self.length) + np.diag(self.noise)
        return np.asarray(scipy.linalg.cholesky(own, lower=True))


def _chunks(count: int) -> list[slice]:
    return [slice(start, start + CHUNK) for start in range(0, count, CHUNK)]


def likeness(one: Array, other: Array, length: float) -> Array:
    """Return the covariance of the process between drives, (m, 3) and (n, 3) → (m, n)."""
    return np.asarray(np.exp(scipy.spatial.distance.cdist(one, other, "sqeuclidean") / (-2.0 * length**2)))


def fit(sample: Sample, below: Callable[[Array], Array], drive: Drive, length: float, noise: float) -> SmoothResidual:
    """Fit the residual of ``below``; a reading that contradicts all others gets more noise."""
    residuals = (sample.share - below(sample.drive)) * sample.slope
    driven = drive(sample.drive)
    noises = noise / np.maximum(sample.certainty * trust(residuals), 1e-6)
    own = likeness(driven, driven, length) + np.diag(noises)
    weights = np.asarray(scipy.linalg.cho_solve(scipy.linalg.cho_factor(own, lower=True), residuals))
    size = np.sqrt(np.maximum((residuals * weights).mean(axis=0), 0.0))
    return SmoothResidual(below, drive, driven, weights, noises, length, size)
