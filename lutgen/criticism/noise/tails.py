"""Tails of the noise: an instrument with occasional outliers has a Student t distribution, not a normal one.

Replicates show whether the tails are heavy, because they differ by noise only. If so, the weight of each reading
depends on its distance d from the same patch at the hours before and after: w = (ν + 3)/(ν + d²). Least squares with
these weights maximises the likelihood of a t distribution (Lange, Little & Taylor 1989,
doi:10.1080/01621459.1989.10478852). An outlier then has little influence, and is reported. Aging of a patch does not
make a reading an outlier: its neighbours in time age too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import gammaln

from lutgen.criticism.noise.replicates import Replicates, patch_numbers

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem

#: Degrees of freedom that are tried; with more degrees of freedom the distribution is practically normal.
DEGREES = (2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0)

#: Smallest number of replicated readings from which tails are estimated.
ENOUGH = 30

#: Lower bound of the share of a replicate's variance that remains after the fit of group means and session corrections.
LEAST_LEFT = 0.1

#: A reading with a smaller weight is reported as an outlier.
OUTLIER = 0.1


class Tails(NamedTuple):
    """Degrees of freedom of the t distribution, and its scale relative to the standard deviation of the noise model."""

    degrees: float
    scale: float


def tails_of(problem: Problem) -> Tails | None:
    """Estimate the tails from replicates; None if a normal distribution suffices, or there are too few replicates."""
    replicates = Replicates.of(problem.readings, problem.rows, across_sessions=problem.noise.across_sessions)
    count = np.bincount(replicates.groups)[replicates.groups]
    replicated = (count > 1) & ~_coarse(problem) & ~np.isin(problem.rows, problem.noise.contradictory)
    if int(replicated.sum()) < ENOUGH:
        return None
    # Whiten by the meter's noise only. The model discrepancy is equal in all replicates of a patch and cancels.
    deviations, remaining = replicates.deviations[replicated], (1.0 - 1.0 / count - replicates.lost)[replicated]
    noise = problem.noise.covariance(problem.xyz[replicated] - deviations)
    squares = np.einsum("ni,nij,nj->n", deviations, np.linalg.inv(noise), deviations) / np.maximum(
        remaining, LEAST_LEFT
    )
    if np.median(squares) <= 0.0:
        return None  # replicates are copies
    normal = _normal(squares)
    best = max((_student(squares, degrees) for degrees in DEGREES), key=lambda each: each[0])
    # BIC: a t distribution has two parameters more.
    return Tails(best[1], best[2]) if best[0] - normal > np.log(squares.size) else None


def _coarse(problem: Problem) -> NDArray[np.bool_]:
    """Whether rounding dominates the noise of each reading, (n,): rounding has no tails."""
    sigma = np.sqrt(np.diagonal(problem.noise.covariance(problem.xyz), axis1=1, axis2=2))
    return np.asarray((problem.noise.digits.step(problem.xyz) > sigma).any(axis=1))


def _normal(squares: Array) -> float:
    """Log-likelihood of squared whitened errors, of three values each, under a normal distribution of free variance."""
    variance = float(squares.mean()) / 3.0
    return float(-0.5 * squares.sum() / variance - 1.5 * squares.size * np.log(2.0 * np.pi * variance))


def _student(squares: Array, degrees: float) -> tuple[float, float, float]:
    """Log-likelihood under a t distribution of free scale, its degrees of freedom, and that scale."""
    variance = float(np.median(squares)) / 2.4
    for _ in range(50):
        weight = (degrees + 3.0) / (degrees + squares / variance)
        variance = float((weight * squares).mean()) / 3.0
    size = float(gammaln((degrees + 3.0) / 2.0) - gammaln(degrees / 2.0) - 1.5 * np.log(degrees * np.pi * variance))
    fit = -0.5 * (degrees + 3.0) * np.log1p(squares / (degrees * variance)).sum()
    return float(squares.size * size + fit), degrees, float(np.sqrt(variance))


def weights_of(problem: Problem, residual: Array, tails: Tails) -> Array:
    """Weight of each reading, (n,), relative to the variance of replicates; ``residual`` is whitened, (n, 3)."""
    expected, is_known = _expected(problem, residual)
    weights = weights_at(((residual - expected) ** 2).sum(axis=1) / (1.5 * tails.scale**2), tails)
    # A reading without other readings of its patch cannot be tested: it keeps the variance of replicates.
    return np.where(is_known, weights, 1.0)


def weights_at(distance: Array, tails: Tails) -> Array:
    """Weight of each reading, (n,), by its squared distance in units of the tails' scale, (n,)."""
    return np.asarray((tails.degrees + 3.0) / (tails.degrees + distance) / tails.scale**2)


def _expected(problem: Problem, residual: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Expected residual, from the same patch at the hours before and after, (n, 3), and whether there is one, (n,).

    Three or more replicates of one hour are compared with their own median instead.
    """
    expected, is_known = np.zeros_like(residual), np.zeros(len(residual), dtype=bool)
    patch = patch_numbers(problem.readings)[problem.rows]
    for each in np.unique(patch):
        here = np.flatnonzero(patch == each)
        hours = problem.hour_of[here]
        medians = {int(hour): np.median(residual[here[hours == hour]], axis=0) for hour in np.unique(hours)}
        sorted_hours = sorted(medians)
        for place, hour in enumerate(sorted_hours):
            rows = here[hours == hour]
            neighbours = [medians[sorted_hours[k]] for k in (place - 1, place + 1) if 0 <= k < len(sorted_hours)]
            references = [medians[hour]] if rows.size >= 3 else neighbours
            if references:
                expected[rows], is_known[rows] = np.mean(references, axis=0), True
    return expected, is_known
