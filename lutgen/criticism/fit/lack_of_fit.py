"""Whether the residuals of a fit are noise: tests of their size and of their evenness.

The size is tested by an F test for lack of fit, against the scatter of replicates. A few dozen replicates estimate the
noise badly: if replicates agree by chance, the F test alone would reject every model. The residuals of a wrong model
are also uneven: they are large in some colours, conditions or hours. Therefore a verdict may name an effect if the
residuals of the fit with this effect are larger than noise but even. The verdict ``consistent`` requires that the F
test accepts the residuals. Large, even residuals have no structure that a display could cause; the verdict blames the
measurement. A second sign of a wrong model are correlated residuals of neighbouring levels. Seeded draws of χ² give the
distribution of the unevenness of noise; each draw takes another variance of bright patches, and of dark patches, within
the uncertainty of the replicates.
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

#: α: probability of a false alarm, that of all forms of effects together, or that of residuals that look uneven.
SIGNIFICANT = 0.01

#: Residuals are larger than noise if noise gives such residuals with a probability below this. The noise model is
#: itself estimated from the replicates of the F test, so that small probabilities of the test are too small.
TOO_LARGE = 0.001

SEED, DRAWS = 20150319, 1999


def is_noise(fitted: Fit, error: PureError) -> bool:
    """Whether the residuals of a fit may be noise alone: the test of size or the test of evenness accepts them."""
    return is_within_scatter(error, fitted) or p_of_unevenness(fitted) >= SIGNIFICANT


def is_within_scatter(error: PureError, fitted: Fit) -> bool:
    """Whether the F test for lack of fit accepts the residuals of a fit."""
    return error.p_of_lack_of_fit(fitted) >= TOO_LARGE


def is_even(fitted: Fit) -> bool:
    """Whether the residuals are as even over colours, conditions and hours as noise; False if all are of one cell."""
    is_partitioned = any(np.unique(labels).size > 1 for labels in _partitions(fitted))
    return is_partitioned and p_of_unevenness(fitted) >= SIGNIFICANT and p_of_autocorrelation(fitted) >= SIGNIFICANT


def p_of_autocorrelation(fitted: Fit) -> float:
    """Probability that chance, and not a wrong curve, correlates the residuals of neighbouring levels at least as much.

    The patches of one kind and hour are sorted by level. By chance the product of the mean residuals of two neighbours
    has either sign with equal probability: each draw gives random signs to the products.
    """
    problem, tested = fitted.problem, _tested(fitted)
    kinds, hour = kind_of(problem)[tested], problem.hour_of[tested]
    code = problem.drive[tested]
    _, kind = np.unique(kinds, return_inverse=True)
    order = np.column_stack([kind.reshape(-1), hour, code.max(axis=1), code])
    patches, which = np.unique(order, axis=0, return_inverse=True)
    which = which.reshape(-1)
    mean = np.zeros((len(patches), 3))
    np.add.at(mean, which, fitted.residual[tested])
    mean /= np.bincount(which)[:, np.newaxis]
    are_neighbours = (patches[1:, :2] == patches[:-1, :2]).all(axis=1)
    products = (mean[1:] * mean[:-1]).sum(axis=1)[are_neighbours]
    drawn = np.random.default_rng(SEED).choice((-1.0, 1.0), size=(DRAWS, products.size)) @ products
    return float((1 + np.count_nonzero(drawn >= products.sum())) / (DRAWS + 1))


def p_of_unevenness(fitted: Fit) -> float:
    """Probability that noise gives residuals at least as uneven.

    The result is the smallest probability of three partitions, times three (Bonferroni).
    """
    squares = (fitted.residual**2).sum(axis=1)[_tested(fitted)]
    probabilities = [_p_of_parts(squares, labels, fitted) for labels in _partitions(fitted)]
    return min(1.0, 3.0 * min(probabilities))


def _tested(fitted: Fit) -> NDArray[np.bool_]:
    """Whether each reading is tested, (n,): all except anchors, which any model fits; all if all are anchors."""
    anchor = fitted.problem.is_anchor
    return np.ones_like(anchor) if anchor.all() else ~anchor


def _partitions(fitted: Fit) -> tuple[NDArray[np.generic], ...]:
    """Three partitions of the tested readings, labels (m,) each: by colour or condition, by hour, by both."""
    problem, tested = fitted.problem, _tested(fitted)
    kinds = kind_of(problem)
    cells = np.char.add(np.char.add(kinds.astype(str), "@"), problem.hour_of.astype(str))
    return kinds[tested], problem.hour_of[tested], cells[tested]


def _p_of_parts(squares: Array, labels: NDArray[np.generic], fitted: Fit) -> float:
    """Probability that noise gives squares (m,) of residuals at least as uneven over the parts of one partition."""
    _, part = np.unique(labels, return_inverse=True)
    part = part.reshape(-1)
    counts = fitted.problem.counts
    count = np.bincount(part, counts[_tested(fitted)])
    if count.size < 2:
        return 1.0
    freedom = count * max(fitted.freedom, 1) / counts.sum()
    observed = _unevenness(np.bincount(part, squares).astype(np.float64), freedom)
    rng, problem = np.random.default_rng(SEED), fitted.problem
    draws = rng.chisquare(freedom, size=(DRAWS, freedom.size))
    freedom_of_noise = 3.0 * np.array(problem.noise.known_from)
    if np.isfinite(freedom_of_noise).all():
        bright = problem.noise.bright_share(np.abs(fitted.predicted))[_tested(fitted)]
        share = np.bincount(part, bright) / np.bincount(part)
        variance_bright, variance_dark = (
            rng.chisquare(freedom_of_noise, size=(DRAWS, 2)).T / freedom_of_noise[:, np.newaxis]
        )
        draws *= share / variance_bright[:, np.newaxis] + (1.0 - share) / variance_dark[:, np.newaxis]
    return float((1 + np.count_nonzero(_unevenness(draws, freedom) >= observed)) / (DRAWS + 1))


def _unevenness(sums: Array, freedom: Array) -> Array:
    """Σ of the squared standardised deviations of the sums of parts (..., parts) from their expected values."""
    scale = sums.sum(axis=-1, keepdims=True) / freedom.sum()
    return np.asarray((((sums - freedom * scale) / scale) ** 2 / (2.0 * freedom)).sum(axis=-1))
