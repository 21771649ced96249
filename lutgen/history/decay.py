"""Laws of decay, weighed by their evidence on a history, and draws of the history's future.

Every law is linear in its coefficients when its shape is fixed. Shapes and scatter lie on grids. Coefficients have
Gaussian priors and are integrated exactly, so that a law's evidence is a sum (Hoeting et al. 1999, Bayesian model
averaging, doi:10.1214/ss/1009212519). Each draw of the future draws law, shape, scatter and coefficients, so that the
draws include the uncertainty of all four.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lutgen.colorimetry import Array

#: An axis of a grid: values of equal ratio, centre and spread (natural logarithm) of a log-normal prior.
Axis = tuple[Array, float, float]

#: Number of sampled points of shapes and scatter for each law.
_POINTS_A_LAW = 1000

#: Axis of the grid: scatter of the sessions as a multiple of the repeatability of a reading.
_SCATTER: Axis = (np.geomspace(0.3, 5.0, 7), 1.0, 0.4)

#: Priors, 1 σ, as shares of the level: of the level at the first session, of the change over the span, of a settling.
_LEVEL, _CHANGE, _SETTLING = 1.0, 0.5, 0.025


@dataclass(frozen=True)
class Law:
    """A law of decay."""

    #: The law in words.
    name: str
    #: One axis for each of the p shape parameters.
    axes: tuple[Axis, ...]
    #: Shapes, (s, p), and times as multiples of the span, (n,) → design matrices of the coefficients, (s, n, k).
    columns: Callable[[Array, Array], Array]
    #: Priors of the coefficients, 1 σ, as shares of the level, (k,).
    widths: tuple[float, ...]


#: Axes: time constants of a decay and of a settling as multiples of the span, and powers of time. Centre and spread of
#: the powers come from two published values: 1 in TM-21, and 1.41 from the paper's luminances at 10 000 and 18 000 h.
_CONSTANTS = (np.geomspace(0.3, 100.0, 80), 3.0, 1.5)
_SETTLINGS = (np.geomspace(0.03, 0.5, 4), 0.1, 1.0)
_POWERS = (np.geomspace(0.5, 2.5, 8), 1.19, 0.24)

#: A coarser axis of time constants, for a law of three shape parameters.
_FEWER_CONSTANTS = (np.geomspace(0.3, 100.0, 40), 3.0, 1.5)


def _columns(*columns: Array) -> Array:
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def _ones(shapes: Array, time: Array) -> Array:
    return np.ones((len(shapes), time.size))


#: a; a + b t; a exp(-t/τ); a + b t^p; a exp(-(t/τ)^β).
_CONSTANT = Law("constant", (), lambda s, t: _columns(_ones(s, t)), (_LEVEL,))
_LINEAR = Law("linear", (), lambda s, t: _columns(_ones(s, t), t), (_LEVEL, _CHANGE))
_EXPONENTIAL = Law("exponential", (_CONSTANTS,), lambda s, t: _columns(np.exp(-t / s[:, :1])), (_LEVEL,))
_POWER = Law("power", (_POWERS,), lambda s, t: _columns(_ones(s, t), t ** s[:, :1]), (_LEVEL, _CHANGE))
_STRETCHED = Law(
    "stretched exponential", (_CONSTANTS, _POWERS),
    lambda s, t: _columns(np.exp(-((t / s[:, :1]) ** s[:, 1:]))), (_LEVEL,),
)  # fmt: skip


def _settling(law: Law) -> Law:
    """Return the law with a settling before it: plus b exp(-t/τ₁), τ₁ being the last shape parameter."""

    def columns(shapes: Array, time: Array) -> Array:
        settling = np.exp(-time / shapes[:, -1:])[..., np.newaxis]
        return np.concatenate([law.columns(shapes[:, :-1], time), settling], axis=-1)

    return Law(f"settling, then {law.name}", (*law.axes, _SETTLINGS), columns, (*law.widths, _SETTLING))


#: A decay may be linear, exponential, a power or a stretched exponential; each may begin with a settling. The table
#: holds all combinations: without some of them, the average would be biased towards the curvature of the others.
LAWS = (
    *(_CONSTANT, _LINEAR, _EXPONENTIAL, _POWER, _STRETCHED),
    *map(_settling, (_EXPONENTIAL, _LINEAR, _POWER, replace(_STRETCHED, axes=(_FEWER_CONSTANTS, _POWERS)))),
)


@dataclass(frozen=True)
class Decay:
    """Result of all laws on one history."""

    #: Name of a law → share of the evidence, largest first.
    weights: dict[str, float]
    #: Posterior mean of the sessions' scatter about the laws, as a multiple of the repeatability of a reading.
    scatter: float
    #: Draws of the figure at the requested times, (d, m).
    curves: Array

    @property
    def law(self) -> str:
        """Name of the law with the largest weight."""
        return next(iter(self.weights))


@dataclass(frozen=True)
class _DecaySample:
    """Sampled points of a law's shapes and scatter, and the posterior of the coefficients at each point."""

    #: Logarithm of a point's share of the evidence, (n,).
    weights: Array
    #: Shapes (n, p) and scatter (n,).
    shapes: Array
    scatter: Array
    #: Mean (n, k) and precision (n, k, k) of the coefficients.
    mean: Array
    precision: Array


def decay_of(time: Array, figures: Array, errors: Array, ahead: Array, *, draws: int, seed: list[int]) -> Decay:
    """Weigh all laws on a history, (n,) each, and draw its future at the times ``ahead``, (m,).

    Times are multiples of the history's span.
    """
    level = float(np.abs(figures).max()) or 1.0
    rng = np.random.default_rng(seed)
    samples = [_sample(law, (time, figures / level, errors / level), rng) for law in LAWS]
    logs = np.array([each.weights for each in samples])
    share = np.exp(logs - logs.max())
    share /= share.sum()
    law_of, place_of = np.unravel_index(rng.choice(share.size, size=draws, p=share.ravel()), share.shape)
    curves = np.empty((draws, ahead.size))
    for number, (law, sample) in enumerate(zip(LAWS, samples, strict=True)):
        mine = law_of == number
        place = place_of[mine]
        root = np.swapaxes(np.linalg.inv(np.linalg.cholesky(sample.precision[place])), -1, -2)
        normal = rng.standard_normal((place.size, len(law.widths)))
        beta = sample.mean[place] + np.einsum("dij,dj->di", root, normal)
        curves[mine] = level * np.einsum("dmk,dk->dm", law.columns(sample.shapes[place], ahead), beta)
    weight = {law.name: float(each.sum()) for law, each in zip(LAWS, share, strict=True)}
    scatter = float((share * np.array([each.scatter for each in samples])).sum())
    return Decay(dict(sorted(weight.items(), key=lambda item: -item[1])), scatter, curves)


def _sample(law: Law, history: tuple[Array, Array, Array], rng: np.random.Generator) -> _DecaySample:
    """Draw cells of the grid by their evidence, and a point in each cell: a posterior may be narrower than a cell."""
    axes = (*law.axes, _SCATTER)
    # Centres of the cells, (s, p + 1).
    cells = np.stack(np.meshgrid(*(values for values, _, _ in axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    prior = _log_prior(axes, cells)
    whole = np.log(np.exp(prior).sum())
    of_cells = _posterior(law, cells, history)[0] + prior
    share = np.exp(of_cells - of_cells.max())
    chosen = rng.choice(len(cells), size=_POINTS_A_LAW, p=share / share.sum())
    steps = np.array([np.log(values[1] / values[0]) for values, _, _ in axes])
    points = cells[chosen] * np.exp(steps * rng.uniform(-0.5, 0.5, (chosen.size, len(axes))))
    evidence, mean, precision = _posterior(law, points, history)
    # Importance weights: replace the evidence at a cell's centre by the evidence at the point drawn in the cell.
    weights = evidence + _log_prior(axes, points) - of_cells[chosen] + np.log(share.sum()) + of_cells.max() - whole
    return _DecaySample(weights, points[:, :-1], points[:, -1], mean, precision)


def _log_prior(axes: Sequence[Axis], points: Array) -> Array:
    """Return the logarithm of the prior at points, (s, p), up to a constant; (s,)."""
    centres, spreads = np.array([axis[1:] for axis in axes]).T
    return np.asarray(-0.5 * ((np.log(points / centres) / spreads) ** 2).sum(axis=1))


def _posterior(law: Law, points: Array, history: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Return log evidence, mean and precision of a law's coefficients at points of shapes and scatter, (s, p + 1)."""
    time, figures, errors = history
    columns = law.columns(points[:, :-1], time) / errors[:, np.newaxis]
    target, variance = figures / errors, points[:, -1:] ** 2
    cross = (columns * target[:, np.newaxis]).sum(axis=1) / variance
    prior = np.diag(np.array(law.widths) ** -2.0)
    precision = np.swapaxes(columns, -1, -2) @ columns / variance[..., np.newaxis] + prior
    mean = np.linalg.solve(precision, cross[..., np.newaxis])[..., 0]
    fit = (target @ target) / variance[:, 0] - (cross * mean).sum(axis=1)
    log_size = np.log(np.linalg.det(precision)) + 2.0 * np.log(law.widths).sum()
    return -0.5 * (fit + log_size) - time.size * np.log(points[:, -1]), mean, precision
