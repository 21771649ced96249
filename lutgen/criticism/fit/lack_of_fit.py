"""Is what remains noise? Its size against the scatter of replicates, and its evenness.

Size is an F test for lack of fit. But noise known from a few dozen replicates is not known well, and a campaign whose
replicates happened to agree would then call every display faulty. What a wrong model leaves is uneven: it sits in some
colours, conditions or hours. So an effect that is named may leave what is too large yet even. But nothing is called
consistent that the F test rejects: scatter that is too large and even has no structure that a display could have, so
the measurement is blamed. Nor do patches of neighbouring levels err alike by noise. How uneven noise is, seeded draws
of χ² tell; the noise of bright patches, and that of dark ones, is in each draw another one that the replicates allow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.families import kind_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError

#: Leftover less likely than this is no noise.
SIGNIFICANT = 0.01

SEED, DRAWS = 20150319, 1999


def is_noise(found: Fit, error: PureError) -> bool:
    """Whether noise alone may have left what a fit leaves."""
    return error.p_of_lack_of_fit(found) >= SIGNIFICANT or p_of_unevenness(found) >= SIGNIFICANT


def is_within_scatter(error: PureError, found: Fit) -> bool:
    """Whether the F test for lack of fit accepts what a fit leaves."""
    return error.p_of_lack_of_fit(found) >= SIGNIFICANT


def is_even(found: Fit) -> bool:
    """Whether what a fit leaves is spread over colours, conditions and hours as evenly as noise; False of one cell."""
    parted = any(np.unique(labels).size > 1 for labels in _partitions(found))
    return parted and p_of_unevenness(found) >= SIGNIFICANT and p_of_autocorrelation(found) >= SIGNIFICANT


def p_of_autocorrelation(found: Fit) -> float:
    """Probability that patches of neighbouring levels err alike by chance, as they do where a curve is wrong.

    Patches of one kind and hour stand in the order of their levels. By chance the product of the mean residuals of two
    neighbours has either sign as often: draws give it one.
    """
    problem, judged = found.problem, _judged(found)
    named, hour = kind_of(problem)[judged], problem.hour_of[judged]
    code = problem.readings.drive[problem.rows][judged]
    _, kind = np.unique(named, return_inverse=True)
    order = np.column_stack([kind.reshape(-1), hour, code.max(axis=1), code])
    patches, which = np.unique(order, axis=0, return_inverse=True)
    which = which.reshape(-1)
    mean = np.zeros((len(patches), 3))
    np.add.at(mean, which, found.residual[judged])
    mean /= np.bincount(which)[:, np.newaxis]
    follows = (patches[1:, :2] == patches[:-1, :2]).all(axis=1)
    products = (mean[1:] * mean[:-1]).sum(axis=1)[follows]
    drawn = np.random.default_rng(SEED).choice((-1.0, 1.0), size=(DRAWS, products.size)) @ products
    return float((1 + np.count_nonzero(drawn >= products.sum())) / (DRAWS + 1))


def p_of_unevenness(found: Fit) -> float:
    """Probability that noise of one size spreads so unevenly: the least of three ways to look, times three."""
    squares = (found.residual**2).sum(axis=1)[_judged(found)]
    chances = [_p_of_parts(squares, labels, found) for labels in _partitions(found)]
    return min(1.0, 3.0 * min(chances))


def _judged(found: Fit) -> NDArray[np.bool_]:
    """Readings that the fit does not start from, (n,): it meets the tips whatever is wrong. Else all."""
    anchor = found.problem.is_anchor
    return np.ones_like(anchor) if anchor.all() else ~anchor


def _partitions(found: Fit) -> tuple[NDArray[np.generic], ...]:
    """Three ways to part the readings that are judged, labels (m,) each: by colour or condition, by hour, by both."""
    problem, judged = found.problem, _judged(found)
    named = kind_of(problem)
    cells = np.char.add(np.char.add(named.astype(str), "@"), problem.hour_of.astype(str))
    return named[judged], problem.hour_of[judged], cells[judged]


def _p_of_parts(squares: Array, labels: NDArray[np.generic], found: Fit) -> float:
    _, part = np.unique(labels, return_inverse=True)
    part = part.reshape(-1)
    counts = found.problem.counts
    count = np.bincount(part, counts[_judged(found)])
    if count.size < 2:
        return 1.0
    freedom = count * max(found.freedom, 1) / counts.sum()
    seen = _unevenness(np.bincount(part, squares).astype(np.float64), freedom)
    rng, problem = np.random.default_rng(SEED), found.problem
    draws = rng.chisquare(freedom, size=(DRAWS, freedom.size))
    known = 3.0 * np.array(problem.noise.known_from)
    if np.isfinite(known).all():
        bright = problem.noise.bright_share(np.abs(found.predicted))[_judged(found)]
        share = np.bincount(part, bright) / np.bincount(part)
        of_bright, of_dark = rng.chisquare(known, size=(DRAWS, 2)).T / known[:, np.newaxis]
        draws *= share / of_bright[:, np.newaxis] + (1.0 - share) / of_dark[:, np.newaxis]
    return float((1 + np.count_nonzero(_unevenness(draws, freedom) >= seen)) / (DRAWS + 1))


def _unevenness(sums: Array, freedom: Array) -> Array:
    """Σ of squared standardised departures of parts (..., parts) from their share of the whole."""
    expected = freedom * (sums.sum(axis=-1, keepdims=True) / freedom.sum())
    scale = sums.sum(axis=-1, keepdims=True) / freedom.sum()
    return np.asarray((((sums - expected) / scale) ** 2 / (2.0 * freedom)).sum(axis=-1))
