"""The trend of a display: which law its figures follow, and when each limit will be passed.

Sessions in which something other than the display changed (see ``explain``) are left out: a changed setting would look
like aging. All laws count by their evidence: a few sessions fit several. Every law is linear in its coefficients once
its shape is fixed. Shapes and scatter lie on grids, coefficients have Gaussian priors and are integrated exactly, so
that a law's evidence is a sum (Hoeting et al. 1999, Bayesian model averaging, doi:10.1214/ss/1009212519). Draws of the
future take law, shape, scatter and coefficients together, so that the interval includes the uncertainty of each.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError
from lutgen.history.causes import causes
from lutgen.history.explain import explain
from lutgen.history.history import QUANTITIES, History, history

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.colorimetry import Array
    from lutgen.history.history import Limit
    from lutgen.readings.campaign import Campaign


#: Draws of the future, their seed, and the percentiles of an interval.
DRAWS, SEED, INTERVAL = 1000, 270, (5.0, 95.0)

#: How far ahead a law is asked, as a multiple of the span that was measured.
HORIZON = 5.0

#: Points of time at which a law is asked.
_POINTS = 1001

#: Share of the evidence from which a law is named beside the likeliest.
NAMED = 0.1

#: Fewest sessions that give a time, and that give an interval which depends more on them than on the laws' priors.
FEWEST, ENOUGH = 4, 8


@dataclass(frozen=True)
class Passing:
    """When a limit is passed."""

    #: The limit, and its value in the quantity's unit.
    limit: Limit
    bound: float
    #: "passed", "ahead" (the law gets there within the horizon), "kept" (it does not), or "cannot-tell".
    status: str
    #: Median, and ends of the interval, since the earliest session; None: not within the horizon. For ``passed``:
    #: ``time`` is that of the first session beyond the limit, and ``low`` that of the session before, if any.
    time: float | None = None
    low: float | None = None
    high: float | None = None
    #: Whether the time lies after the last session.
    extrapolated: bool = False


@dataclass(frozen=True)
class Followed:
    """One quantity over time."""

    #: One of ``history.QUANTITIES``.
    quantity: str
    #: The laws by evidence; None where fewer than two sessions have the figure.
    decay: Decay | None
    #: Median of the draws at ``Trend.ahead``, (m,), and their interval.
    curve: Array
    low: Array
    high: Array

    @property
    def as_good(self) -> tuple[str, ...]:
        """Names of the laws beside the likeliest that the sessions leave open."""
        weights = self.decay.weights if self.decay else {}
        return tuple(name for name, weight in [*weights.items()][1:] if weight >= NAMED)


@dataclass(frozen=True)
class Trend:
    """The trend of a campaign."""

    #: Figures of all sessions.
    history: History
    #: Which of them the laws are fitted to, (n,).
    kept: Array
    #: Place in the history → why a session is left out.
    why: dict[int, str]
    #: Times at which laws are drawn, (m,), up to the horizon.
    ahead: Array
    #: By quantity, and by limit.
    courses: dict[str, Followed]
    passings: tuple[Passing, ...]


def trend(
    campaign: Campaign,
    limits: Sequence[Limit],
    *,
    all_sessions: bool = False,
    ambient_cd_m2: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> Trend:
    """Follow a display and say when each limit is passed. Raises LutgenError: too few sessions, or no times."""
    if len(campaign.entries) < 2:
        message = f"{campaign.file}: one session; a trend needs two or more. Add another [[sessions]]."
        raise LutgenError(message)
    seen = history(campaign, ambient_cd_m2)
    if seen.time[-1] <= 0:
        message = f"{campaign.file}: all sessions have the same time; a trend needs sessions that are months apart."
        raise LutgenError(message)
    why = {} if all_sessions else _left_out(seen, progress)
    kept = np.array([place not in why for place in range(len(seen.places))])
    ahead = np.linspace(0.0, (1.0 + HORIZON) * float(seen.time[-1]), _POINTS)
    drawn = {name: _course(seen, name, kept, ahead) for name in QUANTITIES}
    passings = tuple(_passing(seen, limit, kept, drawn[limit.quantity], ahead) for limit in limits)
    return Trend(seen, kept, why, ahead, {name: course for name, (course, _) in drawn.items()}, passings)


def _left_out(seen: History, progress: Callable[[int, int], None] | None) -> dict[int, str]:
    """Say which sessions differ by something other than the display's own aging, and by what."""
    explained = explain(seen.campaign, progress=progress)
    others = [place for place in range(len(seen.places)) if place != explained.reference]
    verdict_of = dict(zip(others, explained.verdicts, strict=True))
    telling = {name for name, cause in causes().items() if not cause.spoils}
    why = {}
    for here, place in enumerate(seen.places):
        verdict = verdict_of.get(place)
        if verdict and verdict.names and (not telling & {*verdict.names} or {*verdict.sure} - telling):
            why[here] = " and ".join(verdict.sure) or (" and " if verdict.kind == "several" else " or ").join(
                verdict.names
            )
    return why


def _course(seen: History, name: str, kept: Array, ahead: Array) -> tuple[Followed, Array]:
    """Weigh the laws; return the course and the curve of every draw, (draws, m)."""
    values, errors = seen.values[name], seen.errors[name]
    used = kept & np.isfinite(values) & np.isfinite(errors) & (errors > 0)
    none = np.full(ahead.size, np.nan)
    if np.count_nonzero(used) < 2:
        return Followed(name, None, none, none, none), np.empty((0, ahead.size))
    span = float(seen.time[-1])
    decay = decay_of(
        seen.time[used] / span, values[used], errors[used], ahead / span, draws=DRAWS, seed=[SEED, *name.encode()]
    )
    low, middle, high = np.percentile(decay.curves, (INTERVAL[0], 50.0, INTERVAL[1]), axis=0)
    return Followed(name, decay, middle, low, high), decay.curves


def _passing(seen: History, limit: Limit, kept: Array, drawn: tuple[Followed, Array], ahead: Array) -> Passing:
    _, curves = drawn
    values = np.where(kept, seen.values[limit.quantity], np.nan)
    read = np.isfinite(values)
    if not read.any():
        return Passing(limit, np.nan if limit.relative else limit.value, "cannot-tell")
    bound = limit.value * float(values[read][0]) if limit.relative else limit.value
    beyond = read & ((values < bound) if limit.above else (values > bound))
    if beyond.any():
        first = int(np.argmax(beyond))
        before = seen.time[:first][read[:first]]
        return Passing(limit, bound, "passed", float(seen.time[first]), float(before[-1]) if before.size else None)
    if np.count_nonzero(read) < FEWEST:
        return Passing(limit, bound, "cannot-tell")
    # A relative limit is a share of each draw's own figure at the first session: the reading of that session scatters.
    bounds = limit.value * curves[:, :1] if limit.relative else np.full((len(curves), 1), bound)
    times = first_beyond(curves, bounds, ahead, above=limit.above)
    low, middle, high = np.percentile(times, (INTERVAL[0], 50.0, INTERVAL[1]), method="nearest")
    if not np.isfinite(middle):
        return Passing(limit, bound, "kept", low=float(low) if np.isfinite(low) else None)
    late = float(high) if np.isfinite(high) else None
    return Passing(limit, bound, "ahead", float(middle), float(low), late, bool(middle > seen.time[-1]))


def first_beyond(curves: Array, bounds: Array, ahead: Array, *, above: bool) -> Array:
    """Time at which each curve, (d, m), first lies beyond its bound, (d,); infinite where it never does."""
    beyond = (curves < bounds) if above else (curves > bounds)
    return np.where(beyond.any(axis=1), ahead[np.argmax(beyond, axis=1)], np.inf)


def name_of(seen: History, here: int) -> str:
    """Name of a session's file by its place in the history."""
    return Path(seen.campaign.entries[seen.places[here]].session.file).name


def trend_as_json(trend: Trend) -> dict[str, Any]:
    """Return the content of the file."""
    seen = trend.history
    campaign = seen.campaign
    return {
        "schema": 1,
        "campaign": {"file": campaign.file, "sha256": campaign.sha256, "display": campaign.display or None},
        "unit": seen.unit,
        "interval": {"percentiles": list(INTERVAL), "draws": DRAWS, "seed": SEED},
        "sessions": [
            {
                "file": campaign.entries[place].session.file,
                "time": float(seen.time[here]),
                "left_out": trend.why.get(here),
                "figures": {name: float(values[here]) for name, values in seen.values.items()},
            }
            for here, place in enumerate(seen.places)
        ],
        "courses": {name: _course_json(course) for name, course in trend.courses.items()},
        "limits": [_passing_json(each) for each in trend.passings],
    }


def _course_json(course: Followed) -> dict[str, Any]:
    return {
        "law": course.decay.law.name if course.decay else None,
        "as_good": list(course.as_good),
        "weights": course.decay.weights if course.decay else {},
        "scatter": course.decay.scatter if course.decay else None,
    }


def _passing_json(each: Passing) -> dict[str, Any]:
    return {
        "limit": each.limit.text,
        "quantity": each.limit.quantity,
        "bound": each.bound,
        "source": each.limit.source,
        "verified": each.limit.verified,
        **{name: getattr(each, name) for name in ("status", "time", "low", "high", "extrapolated")},
    }


#: Scatter of the sessions as multiples of what a reading repeats to; its prior's centre and spread (natural logarithm).
_SCATTER = np.geomspace(0.3, 5.0, 12)
_SCATTER_CENTRE, _SCATTER_SPREAD = 1.0, 0.4

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


#: Time constants of a decay and of a settling as multiples of the span, and powers of time: centre and spread are those
#: of the two that are published, 1 in TM-21 and 1.41, which the paper's luminances at 10 000 and 18 000 h have.
_CONSTANTS = (np.geomspace(0.3, 100.0, 160), 3.0, 1.5)
_SETTLINGS = (np.geomspace(0.03, 0.5, 8), 0.1, 1.0)
_POWERS = (np.geomspace(0.5, 2.5, 12), 1.19, 0.24)

#: The same for laws of three shapes, coarser.
_FEWER_CONSTANTS = (np.geomspace(0.3, 100.0, 60), 3.0, 1.5)
_FEWER_SETTLINGS = (np.geomspace(0.03, 0.5, 5), 0.1, 1.0)

#: A decay may be linear, exponential, a power or a stretched exponential; each may begin with a settling. All of them
#: are here: were some left out, the average would lean to the curvature of those that remain.
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
    Law(
        "settling, then power", "a + b t^p + c exp(-t/τ₁)", *_grid(_POWERS, _FEWER_SETTLINGS),
        lambda s, t: _stacked(np.ones((len(s), t.size)), t ** s[:, :1], np.exp(-t / s[:, 1:])),
        (_LEVEL, _CHANGE, _SETTLING),
    ),
    Law(
        "settling, then stretched exponential", "a exp(-(t/τ)^β) + b exp(-t/τ₁)",
        *_grid(_FEWER_CONSTANTS, _POWERS, _FEWER_SETTLINGS),
        lambda s, t: _stacked(np.exp(-((t / s[:, :1]) ** s[:, 1:2])), np.exp(-t / s[:, 2:])), (_LEVEL, _SETTLING),
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


def decay_of(time: Array, figures: Array, errors: Array, ahead: Array, *, draws: int, seed: list[int]) -> Decay:
    """Weigh all laws on a history, (n,) each, and draw its future at the times ``ahead``, in spans, (m,)."""
    level = float(np.abs(figures).max()) or 1.0
    posteriors = [_posterior(law, time, figures / level, errors / level) for law in LAWS]
    logs = [log_weight.ravel() for log_weight, _, _ in posteriors]
    whole = np.concatenate(logs)
    share = np.exp(whole - whole.max())
    share /= share.sum()
    rng = np.random.default_rng(seed)
    chosen = rng.choice(share.size, size=draws, p=share)
    starts = np.cumsum([0, *(each.size for each in logs)])
    curves = np.empty((draws, ahead.size))
    for number, (law, (log_weight, mean, root)) in enumerate(zip(LAWS, posteriors, strict=True)):
        mine = np.flatnonzero((chosen >= starts[number]) & (chosen < starts[number + 1]))
        shape, scatter = np.unravel_index(chosen[mine] - starts[number], log_weight.shape)
        normal = rng.standard_normal((mine.size, len(law.widths)))
        beta = mean[shape, scatter] + np.einsum("dij,dj->di", root[shape, scatter], normal)
        curves[mine] = level * np.einsum("dmk,dk->dm", law.columns(law.shapes[shape], ahead), beta)
    weight = {law.name: float(share[a:b].sum()) for law, a, b in zip(LAWS, starts, starts[1:], strict=False)}
    by_scatter = sum(np.exp(log_weight - whole.max()).sum(axis=0) for log_weight, _, _ in posteriors)
    mean_scatter = float(by_scatter @ _SCATTER / by_scatter.sum())
    return Decay(dict(sorted(weight.items(), key=lambda item: -item[1])), mean_scatter, curves)


def _posterior(law: Law, time: Array, figures: Array, errors: Array) -> tuple[Array, Array, Array]:
    """Return log weight, mean and root covariance of a law's coefficients for every shape and scatter, (s, g, …)."""
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
    return evidence + prior, mean, np.swapaxes(root, -1, -2)
