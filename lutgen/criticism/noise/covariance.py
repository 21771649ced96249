"""The covariance that noise gives to readings, and the noises at many points of a search, all at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array

#: Steps of a search, and halvings of one, at most; a step that promises a smaller gain ends the search.
SCORINGS, HALVINGS, ENOUGH_GAIN = 100, 30, 1e-6


@dataclass(frozen=True)
class NoisePoints:
    """Noises at p points of the search for the likeliest, all at once: its slope asks for a dozen of neighbours."""

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
        """Read points (p, 12), or (p, 13) with shot noise: logarithms of sizes and ratios, then partials as atanh."""
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
        """Return the fields of the noise at the first point, by their names in ``Noise``."""
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
    """Return the arguments of :func:`_correlated` for one correlation of all three, as atanh."""
    return float(np.arctanh(rho)), float(np.arctanh(rho)), float(np.arctanh(rho / (1.0 + rho)))


def _correlated(xy: Array, yz: Array, xz_given_y: Array) -> Array:
    """Correlations (p, 3, 3) of X, Y, Z from two of them and the partial one: positive definite whatever these are."""
    xz = xy * yz + xz_given_y * np.sqrt((1.0 - xy**2) * (1.0 - yz**2))
    one = np.ones_like(xy)
    return np.moveaxis(np.array([[one, xy, xz], [xy, one, yz], [xz, yz, one]]), -1, 0)


def by_scoring(
    loss: Callable[[Array], tuple[float, Array, Array]], start: Array, low: Array, high: Array
) -> tuple[Array, float]:
    """Return the point within bounds where ``loss`` is least, and that loss, by Fisher's scoring.

    ``loss`` returns its value, slope (p,) and expected curvature (p, p). A step that does not lower it is halved.
    (Harville 1977, doi:10.1080/01621459.1977.10480998; to import scipy's minimisers takes ten times as long.)
    """
    point = start
    value, slope, curvature = loss(point)
    for _ in range(SCORINGS):
        held = ((point <= low) & (slope > 0)) | ((point >= high) & (slope < 0))
        step = np.zeros_like(point)
        step[~held] = -np.linalg.solve(curvature[np.ix_(~held, ~held)], slope[~held])
        if -slope @ step < ENOUGH_GAIN:
            break
        for halved in range(HALVINGS):
            ahead = np.clip(point + step / 2**halved, low, high)
            there = loss(ahead)
            if there[0] < value:
                break
        else:
            break
        point, (value, slope, curvature) = ahead, there
    return point, value
