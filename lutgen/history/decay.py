"""Laws of decay, all weighed by their evidence: none is chosen, for a few sessions fit several.

Every law is linear in its coefficients once its shape is fixed. Shapes and scatter lie on grids, coefficients have
Gaussian priors and are integrated exactly, so that a law's evidence is a sum (Hoeting et al. 1999, Bayesian model
averaging, doi:10.1214/ss/1009212519) and draws of the future take law, shape, scatter and coefficients together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array

#: Scatter of the sessions as multiples of what a reading repeats to; its prior's centre and spread (natural logarithm).
_SCATTER = np.geomspace(0.3, 5.0, 15)
_SCATTER_CENTRE, _SCATTER_SPREAD = 1.15, 0.4

#: Prior of a level at the first session and of a change over the span, as shares of the level, 1 σ; and of a settling.
_LEVEL, _CHANGE, _SETTLING = 1.0, 0.5, 0.025


@dataclass(frozen=True)
class Law:
    """A law."""

    #: For people.
    name: str
    formula: str
    #: The grid, (s, p), and the prior weight of each of its points, (s,).
    shapes: Array
    prior: Array
    #: Shapes and times as multiples of the span, (n,) → what the coefficients multiply, (s, n, k).
    columns: Callable[[Array, Array], Array]
    #: Priors of the coefficients, 1 σ, as shares of the level, (k,).
    widths: tuple[float, ...]


def _grid(*axes: tuple[Array, float, float]) -> tuple[Array, Array]:
    """Points of a grid, (s, p), and their weights: log-normal about a centre, flat where the spread is infinite."""
    points = np.stack(np.meshgrid(*(values for values, _, _ in axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    centres, spreads = (np.array([axis[place] for axis in axes]) for place in (1, 2))
    weight = np.exp(-0.5 * (np.log(points / centres) / spreads) ** 2).prod(axis=1)
    return points, weight / weight.sum()


def _stacked(*columns: Array) -> Array:
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


#: Time constants of a decay and of a settling as multiples of the span, and powers of time; TM-21 has 1, the paper's
#: luminances at 10 000 and 18 000 h have 1.41.
_CONSTANTS = (np.geomspace(0.3, 100.0, 80), 3.0, 1.5)
_SETTLINGS = (np.geomspace(0.03, 0.5, 8), 0.1, 1.0)
_POWERS = (np.geomspace(0.4, 2.5, 15), 1.12, 0.35)

LAWS = (
    Law("constant", "a", *_grid((np.ones(1), 1.0, 1.0)), lambda _s, t: np.ones((1, t.size, 1)), (_LEVEL,)),
    Law(
        "linear", "a + b t", *_grid((np.ones(1), 1.0, 1.0)),
        lambda _s, t: _stacked(np.ones((1, t.size)), t[np.newaxis]), (_LEVEL, _CHANGE),
    ),
    Law(
        "exponential", "a exp(-t/τ)", *_grid(_CONSTANTS),
        lambda s, t: np.exp(-t / s[:, :1])[..., np.newaxis], (_LEVEL,),
    ),
    Law(
        "power", "a + b t^p", *_grid(_POWERS),
        lambda s, t: _stacked(np.ones((len(s), t.size)), t ** s[:, :1]), (_LEVEL, _CHANGE),
    ),
    Law(
        "stretched exponential", "a exp(-(t/τ)^β)", *_grid(_CONSTANTS, _POWERS),
        lambda s, t: np.exp(-((t / s[:, :1]) ** s[:, 1:]))[..., np.newaxis], (_LEVEL,),
    ),
    Law(
        "settling, then exponential", "a exp(-t/τ) + b exp(-t/τ₁)", *_grid(_CONSTANTS, _SETTLINGS),
        lambda s, t: _stacked(np.exp(-t / s[:, :1]), np.exp(-t / s[:, 1:])), (_LEVEL, _SETTLING),
    ),
    Law(
        "settling, then linear", "a + b t + c exp(-t/τ₁)", *_grid(_SETTLINGS),
        lambda s, t: _stacked(np.ones((len(s), t.size)), t[np.newaxis], np.exp(-t / s[:, :1])),
        (_LEVEL, _CHANGE, _SETTLING),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Decay:
    """All laws on one history."""

    #: Name of a law → share of the evidence, the largest first.
    weights: dict[str, float]
    #: Scatter of the sessions about the laws, as a multiple of what readings repeat to: mean of its posterior.
    scatter: float
    #: Draws of the figure at the times asked for, (d, m).
    curves: Array

    @property
    def law(self) -> Law:
        """The law with the largest weight."""
        return next(law for law in LAWS if law.name == next(iter(self.weights)))


@dataclass(frozen=True)
class _Posterior:
    """Of one law: logarithm of weight of each shape and scatter, (s, g), and mean and root covariance of its betas."""

    log_weight: Array
    mean: Array
    root: Array


def decay_of(time: Array, figures: Array, errors: Array, ahead: Array, *, draws: int, seed: list[int]) -> Decay:
    """Weigh all laws on a history, (n,) each, and draw its future at the times ``ahead``, in spans, (m,)."""
    level = float(np.abs(figures).max()) or 1.0
    posteriors = [_posterior(law, time, figures / level, errors / level) for law in LAWS]
    logs = [each.log_weight.ravel() for each in posteriors]
    whole = np.concatenate(logs)
    share = np.exp(whole - whole.max())
    share /= share.sum()
    rng = np.random.default_rng(seed)
    chosen = rng.choice(share.size, size=draws, p=share)
    starts = np.cumsum([0, *(each.size for each in logs)])
    curves = np.empty((draws, ahead.size))
    for number, (law, each) in enumerate(zip(LAWS, posteriors, strict=True)):
        mine = np.flatnonzero((chosen >= starts[number]) & (chosen < starts[number + 1]))
        shape, scatter = np.unravel_index(chosen[mine] - starts[number], each.log_weight.shape)
        normal = rng.standard_normal((mine.size, len(law.widths)))
        beta = each.mean[shape, scatter] + np.einsum("dij,dj->di", each.root[shape, scatter], normal)
        curves[mine] = level * np.einsum("dmk,dk->dm", law.columns(law.shapes[shape], ahead), beta)
    weight = {law.name: float(share[a:b].sum()) for law, a, b in zip(LAWS, starts, starts[1:], strict=False)}
    by_scatter = sum(np.exp(each.log_weight - whole.max()).sum(axis=0) for each in posteriors)
    mean_scatter = float(by_scatter @ _SCATTER / by_scatter.sum())
    return Decay(dict(sorted(weight.items(), key=lambda item: -item[1])), mean_scatter, curves)


def _posterior(law: Law, time: Array, figures: Array, errors: Array) -> _Posterior:
    """Integrate a law's coefficients for every shape and scatter."""
    columns = law.columns(law.shapes, time) / errors[:, np.newaxis]
    target = figures / errors
    inner = np.einsum("snk,snl->skl", columns, columns)[:, np.newaxis]
    cross = np.einsum("snk,n->sk", columns, target)[:, np.newaxis]
    variance = (_SCATTER**2)[:, np.newaxis]
    precision = inner / variance[..., np.newaxis] + np.diag(1.0 / np.array(law.widths) ** 2)
    mean = np.linalg.solve(precision, (cross / variance)[..., np.newaxis])[..., 0]
    fit = (target @ target) / variance[:, 0] - np.einsum("sgk,sgk->sg", cross / variance, mean)
    log_size = np.linalg.slogdet(precision)[1] + 2.0 * np.log(law.widths).sum()
    evidence = -0.5 * (fit + log_size) - time.size * np.log(_SCATTER)
    prior = np.log(law.prior)[:, np.newaxis] - 0.5 * (np.log(_SCATTER / _SCATTER_CENTRE) / _SCATTER_SPREAD) ** 2
    root = np.linalg.inv(np.linalg.cholesky(precision))
    return _Posterior(evidence + prior, mean, np.swapaxes(root, -1, -2))
