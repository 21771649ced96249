"""Covariance of readings by noise, for many values of the noise parameters at once, and Fisher scoring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array

#: Largest number of steps of a search and of halvings of a step; a step with a smaller predicted gain ends the search.
SCORINGS, HALVINGS, ENOUGH_GAIN = 100, 30, 1e-6


@dataclass(frozen=True)
class NoisePoints:
    """Noise parameters at p points of the likelihood search; numerical derivatives need a dozen points at once."""

    #: (p, 1).
    relative: Array
    floor_cd_m2: Array
    shot_cd_m2: Array
    #: (p, 3).
    ratio: Array
    floor_ratio: Array
    #: (p, 3, 3).
    correlation: Array
    floor_correlation: Array

    @classmethod
    def at(cls, points: Array, *, shot: bool) -> NoisePoints:
        """Decode points (p, 12), or (p, 13) with shot noise: log of sizes and ratios, atanh of partial correlations."""
        sizes, partials = np.exp(points[:, :6]), 0.999 * np.tanh(points[:, 6:12])
        one = np.ones(len(points))
        return cls(
            sizes[:, :1],
            sizes[:, 1:2],
            np.exp(points[:, 12:]) if shot else np.zeros((len(points), 1)),
            np.column_stack([sizes[:, 2], one, sizes[:, 3]]),
            np.column_stack([sizes[:, 4], one, sizes[:, 5]]),
            _correlated(*partials[:, :3].T),
            _correlated(*partials[:, 3:].T),
        )

    def covariances(self, xyz_cd_m2: Array, rounding: Array) -> Array:
        """Covariances of readings of light (n, 3): (p, n, 3, 3)."""
        bright = self.relative[:, np.newaxis] ** 2 * xyz_cd_m2**2 + self.shot_cd_m2[:, np.newaxis] * np.abs(xyz_cd_m2)
        bright = self.ratio[:, np.newaxis] ** 2 * bright
        floor = (self.floor_cd_m2 * self.floor_ratio) ** 2
        return covariance_of(bright, floor, self.correlation, self.floor_correlation, rounding)

    def first(self) -> dict[str, Any]:
        """Return the noise parameters of the first point, by their names in ``Noise``."""
        return {
            "relative": float(self.relative[0, 0]),
            "floor_cd_m2": float(self.floor_cd_m2[0, 0]),
            "shot_cd_m2": float(self.shot_cd_m2[0, 0]),
            "ratio": tuple(self.ratio[0].tolist()),
            "floor_ratio": tuple(self.floor_ratio[0].tolist()),
            "correlation": self.correlation[0],
            "floor_correlation": self.floor_correlation[0],
        }


def covariance_of(bright: Array, floor: Array, correlation: Array, floor_correlation: Array, rounding: Array) -> Array:
    """Covariances (…, n, 3, 3): variances (…, n, 3) and (…, 3), correlations (…, 3, 3), steps of rounding (n, 3)."""
    sigma, dark = np.sqrt(bright), np.sqrt(floor)
    shared = correlation[..., np.newaxis, :, :] * sigma[..., :, np.newaxis] * sigma[..., np.newaxis, :]
    shared += (floor_correlation * (dark[..., :, np.newaxis] * dark[..., np.newaxis, :]))[..., np.newaxis, :, :]
    return np.asarray(shared + np.eye(3) * (rounding**2 / 12.0)[:, np.newaxis])


def partials_of(rho: float) -> tuple[float, float, float]:
    """Return the arguments of :func:`_correlated` for three equal correlations, as atanh."""
    return float(np.arctanh(rho)), float(np.arctanh(rho)), float(np.arctanh(rho / (1.0 + rho)))


def _correlated(xy: Array, yz: Array, xz_given_y: Array) -> Array:
    """Correlations (p, 3, 3) of X, Y, Z from two of them and a partial one: positive definite for all arguments."""
    xz = xy * yz + xz_given_y * np.sqrt((1.0 - xy**2) * (1.0 - yz**2))
    one = np.ones_like(xy)
    return np.moveaxis(np.array([[one, xy, xz], [xy, one, yz], [xz, yz, one]]), -1, 0)


def by_scoring(
    loss: Callable[[Array], tuple[float, Array, Array]], start: Array, low: Array, high: Array
) -> tuple[Array, float]:
    """Return the point within bounds that minimises ``loss``, and its loss, by Fisher scoring.

    ``loss`` returns its value, gradient (p,) and expected Hessian (p, p). A step that does not lower it is halved
    (Harville 1977, doi:10.1080/01621459.1977.10480998). scipy's minimisers are not used: their import takes ten times
    as long as this search.
    """
    point = start
    value, gradient, hessian = loss(point)
    for _ in range(SCORINGS):
        at_bound = ((point <= low) & (gradient > 0)) | ((point >= high) & (gradient < 0))
        step = np.zeros_like(point)
        step[~at_bound] = -np.linalg.solve(hessian[np.ix_(~at_bound, ~at_bound)], gradient[~at_bound])
        if -gradient @ step < ENOUGH_GAIN:
            break
        for halvings in range(HALVINGS):
            trial_point = np.clip(point + step / 2**halvings, low, high)
            trial = loss(trial_point)
            if trial[0] < value:
                break
        else:
            break
        point, (value, gradient, hessian) = trial_point, trial
    return point, value
