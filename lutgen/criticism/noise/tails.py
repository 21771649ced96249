"""Tails of the noise: an instrument that slips now and then has a Student t distribution, not a normal one.

Replicates tell whether tails are heavy: nothing but noise parts them. Where they are, each reading is weighed by how
far it stands from its own kin, the same patch at the hours before and after: w = (ν + 3)/(ν + d²), with which least
squares are the likelihood of a t distribution (Lange, Little & Taylor 1989, doi:10.1080/01621459.1989.10478852). A slip
then costs little, and is named. What a display does to a patch over the hours is no slip: it does not stand alone.
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

#: Degrees of freedom that are tried; more of them are a normal distribution.
DEGREES = (2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0)

#: Fewer replicated readings than this tell nothing of tails.
ENOUGH = 30

#: Of a replicate no less than this share is left beside the mean of its group and what its session differs by.
LEAST_LEFT = 0.1

#: A reading that counts less than this is named.
OUTLIER = 0.1


class Tails(NamedTuple):
    """Degrees of freedom of the noise, and its scale as a share of its standard deviation."""

    degrees: float
    scale: float


def tails_of(problem: Problem) -> Tails | None:
    """Estimate the tails from replicates; None where they are those of a normal distribution, or too few tell."""
    found = Replicates.of(problem.readings, problem.rows, across_sessions=problem.noise.across_sessions)
    count = np.bincount(found.groups)[found.groups]
    replicated = (count > 1) & ~_coarse(problem)
    if int(replicated.sum()) < ENOUGH:
        return None
    # In units of the meter's noise alone: what a model misses is in all replicates alike.
    off, left = found.deviations[replicated], (1.0 - 1.0 / count - found.lost)[replicated]
    noise = problem.noise.covariance(problem.xyz[replicated] - off)
    squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(noise), off) / np.maximum(left, LEAST_LEFT)
    if np.median(squares) <= 0.0:
        return None  # copies have no tails
    normal = _normal(squares)
    best = max((_student(squares, degrees) for degrees in DEGREES), key=lambda each: each[0])
    # BIC: a t distribution has two parameters more.
    return Tails(best[1], best[2]) if best[0] - normal > np.log(squares.size) else None


def _coarse(problem: Problem) -> NDArray[np.bool_]:
    """Readings whose noise is that of the last digit rather than the instrument's, (n,): rounding has no tails."""
    sigma = np.sqrt(np.diagonal(problem.noise.covariance(problem.xyz), axis1=1, axis2=2))
    return np.asarray((problem.noise.digits.step(problem.xyz) > sigma).any(axis=1))


def _normal(squares: Array) -> float:
    """Log likelihood of squared whitened errors of three numbers each under a normal distribution of free size."""
    variance = float(squares.mean()) / 3.0
    return float(-0.5 * squares.sum() / variance - 1.5 * squares.size * np.log(2.0 * np.pi * variance))


def _student(squares: Array, degrees: float) -> tuple[float, float, float]:
    """Log likelihood under a t distribution of free scale, its degrees of freedom, and that scale."""
    variance = float(np.median(squares)) / 2.4
    for _ in range(50):
        weight = (degrees + 3.0) / (degrees + squares / variance)
        variance = float((weight * squares).mean()) / 3.0
    size = float(gammaln((degrees + 3.0) / 2.0) - gammaln(degrees / 2.0) - 1.5 * np.log(degrees * np.pi * variance))
    fit = -0.5 * (degrees + 3.0) * np.log1p(squares / (degrees * variance)).sum()
    return float(squares.size * size + fit), degrees, float(np.sqrt(variance))


def weights_of(problem: Problem, residual: Array, tails: Tails) -> Array:
    """Weight of each reading, (n,), relative to the variance that replicates show; ``residual`` is whitened, (n, 3)."""
    expected, known = _expected(problem, residual)
    weights = weights_at(((residual - expected) ** 2).sum(axis=1) / (1.5 * tails.scale**2), tails)
    # A reading without kin stands by nothing: it keeps the variance that replicates show.
    return np.where(known, weights, 1.0)


def weights_at(distance: Array, tails: Tails) -> Array:
    """Weight of each reading, (n,), by its squared distance in units of the tails' scale, (n,)."""
    return np.asarray((tails.degrees + 3.0) / (tails.degrees + distance) / tails.scale**2)


def _expected(problem: Problem, residual: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Residual of the same patch at the hours before and after, (n, 3), and where there is one, (n,).

    Three replicates of one hour or more are their own kin.
    """
    expected, known = np.zeros_like(residual), np.zeros(len(residual), dtype=bool)
    kin = patch_numbers(problem.readings)[problem.rows]
    for each in np.unique(kin):
        here = np.flatnonzero(kin == each)
        hours = problem.hour_of[here]
        usual = {int(hour): np.median(residual[here[hours == hour]], axis=0) for hour in np.unique(hours)}
        course = sorted(usual)
        for place, hour in enumerate(course):
            rows = here[hours == hour]
            near = [usual[course[k]] for k in (place - 1, place + 1) if 0 <= k < len(course)]
            beside = [usual[hour]] if rows.size >= 3 else near
            if beside:
                expected[rows], known[rows] = np.mean(beside, axis=0), True
    return expected, known
