"""Penalised least squares, in which a reading that contradicts all others gets little weight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy  # scipy loads its parts when they are first used: most displays need none

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: A reading has full weight up to so many robust standard deviations, beyond them the fourth power of their ratio.
FULL = 6.0

#: Median of the norm of three normal components, in standard deviations of one.
NORM_MEDIAN = 1.538

#: Keeps the normal equations regular where no reading touches a spline.
RIDGE = 1e-9


def solve(columns: Array, wanted: Array, penalty: Array, rises: Array | None = None) -> Array:
    """Coefficients (p,) that minimise ‖columns·c − wanted‖² + ‖penalty·c‖², where ``rises`` (q, p) times c ≥ 0.

    Lawson & Hanson, Solving Least Squares Problems (1974), chapter 23, problem LDP.
    """
    normal = columns.T @ columns + penalty.T @ penalty
    normal += RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
    root = scipy.linalg.cholesky(normal, lower=True)
    middle = scipy.linalg.solve_triangular(root, columns.T @ wanted, lower=True)
    coefficients = scipy.linalg.solve_triangular(root, middle, lower=True, trans="T")
    if rises is None or (rises @ coefficients).min() >= 0:
        return np.asarray(coefficients)
    # The least distance from the free solution, in units of its own covariance, that meets the inequalities.
    inequalities = scipy.linalg.solve_triangular(root, rises.T, lower=True).T
    rows = np.vstack([inequalities.T, -(inequalities @ middle)])
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    left = rows @ scipy.optimize.nnls(rows, goal)[0] - goal
    return np.asarray(scipy.linalg.solve_triangular(root, middle - left[:-1] / left[-1], lower=True, trans="T"))


def trust(residual: Array) -> Array:
    """Weight of each reading, (n,), from residuals (n, 3) in CIELAB's units: 1, or less for an outlier."""
    size = np.linalg.norm(residual, axis=1)
    usual = spread(residual)
    return np.asarray(np.minimum(1.0, (FULL * usual / np.maximum(size, usual)) ** 4))


def spread(residual: Array) -> float:
    """Robust standard deviation of residuals (n, 3)."""
    return max(float(np.median(np.linalg.norm(residual, axis=1))) / NORM_MEDIAN, 1e-9)
