"""Penalised least squares, in which a reading that contradicts all others has little weight."""

import numpy as np
import scipy  # scipy loads its parts lazily; most displays need none

from lutgen.colorimetry import Array

#: Largest residual with full weight, in robust standard deviations. The weight of a larger residual is the fourth power
#: of the ratio of this to the residual.
FULL = 6.0

#: Median of the norm of three normal components, in standard deviations of one component.
NORM_MEDIAN = 1.538

#: Ridge that keeps the normal equations regular for splines without readings.
RIDGE = 1e-9


def solve(columns: Array, target: Array, penalty: Array, rises: Array | None = None) -> Array:
    """Return the c, (p,), that minimises ‖columns·c − target‖² + ‖penalty·c‖² subject to ``rises``·c ≥ 0, rises (q, p).

    Lawson & Hanson, Solving Least Squares Problems (1974), chapter 23, problem LDP.
    """
    normal = columns.T @ columns + penalty.T @ penalty
    normal += RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
    root = scipy.linalg.cholesky(normal, lower=True)
    middle = scipy.linalg.solve_triangular(root, columns.T @ target, lower=True)
    coefficients = scipy.linalg.solve_triangular(root, middle, lower=True, trans="T")
    if rises is None or (rises @ coefficients).min() >= 0:
        return np.asarray(coefficients)
    # The nearest point to the unconstrained solution, in the metric of its covariance, that satisfies the inequalities.
    inequalities = scipy.linalg.solve_triangular(root, rises.T, lower=True).T
    rows = np.vstack([inequalities.T, -(inequalities @ middle)])
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    residual = rows @ scipy.optimize.nnls(rows, goal)[0] - goal
    return np.asarray(scipy.linalg.solve_triangular(root, middle - residual[:-1] / residual[-1], lower=True, trans="T"))


def trust(residual: Array) -> Array:
    """Return the weight of each reading, (n,), from residuals (n, 3) in CIELAB units: 1, or less for an outlier."""
    size = np.linalg.norm(residual, axis=1)
    usual = spread(residual)
    return np.asarray(np.minimum(1.0, (FULL * usual / np.maximum(size, usual)) ** 4))


def spread(residual: Array) -> float:
    """Return the robust standard deviation of residuals (n, 3)."""
    return max(float(np.median(np.linalg.norm(residual, axis=1))) / NORM_MEDIAN, 1e-9)
