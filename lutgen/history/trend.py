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

    #: An axis of a grid: values of equal ratio, centre and spread (natural logarithm) of a log-normal prior.
    Axis = tuple[Array, float, float]

#: Draws of the future, their seed, and the share of them that an interval holds.
DRAWS, SEED, INTERVAL = 1000, 270, 0.9

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
    low, middle, high = np.quantile(decay.curves, (0.5 - INTERVAL / 2, 0.5, 0.5 + INTERVAL / 2), axis=0)
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
    middle = np.percentile(times, 50.0, method="nearest")
    low, high = shortest(times, INTERVAL, float(ahead[-1]))
    if not np.isfinite(middle):
        return Passing(limit, bound, "kept", low=low if np.isfinite(low) else None)
    late = high if np.isfinite(high) else None
    return Passing(limit, bound, "ahead", float(middle), low, late, bool(middle > seen.time[-1]))


def first_beyond(curves: Array, bounds: Array, ahead: Array, *, above: bool) -> Array:
    """Time at which each curve, (d, m), first lies beyond its bound, (d,); infinite where it never does."""
    beyond = (curves < bounds) if above else (curves > bounds)
    return np.where(beyond.any(axis=1), ahead[np.argmax(beyond, axis=1)], np.inf)


def shortest(times: Array, share: float, end: float) -> tuple[float, float]:
    """Ends of the shortest interval that holds a share of times, (d,).

    Times have a long tail towards late ones: between two percentiles of one size an interval would reach far into it,
    hold more than its share where the law is a usual one, and begin after the earliest times, which matter most. An
    infinite time counts as ``end``.
    """
    ordered = np.sort(times)
    held = int(np.ceil(share * ordered.size))
    within = np.minimum(ordered, end)
    first = int(np.argmin(within[held - 1 :] - within[: ordered.size - held + 1]))
    return float(ordered[first]), float(ordered[first + held - 1])


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
        "interval": {"share": INTERVAL, "draws": DRAWS, "seed": SEED},
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


#: Points of shapes and scatter that stand for each law.
_POINTS_A_LAW = 1000

#: Scatter of the sessions as a multiple of what a reading repeats to, as an axis of the grid.
_SCATTER: Axis = (np.geomspace(0.3, 5.0, 7), 1.0, 0.4)

#: Prior of a level at the first session and of a change over the span, as shares of the level, 1 σ; and of a settling.
_LEVEL, _CHANGE, _SETTLING = 1.0, 0.5, 0.025


@dataclass(frozen=True)
class Law:
    """A law."""

    #: For people.
    name: str
    formula: str
    #: One for each of its p shapes.
    axes: tuple[Axis, ...]
    #: Shapes (s, p) and times as multiples of the span, (n,) → what the coefficients multiply, (s, n, k).
    columns: Callable[[Array, Array], Array]
    #: Priors of the coefficients, 1 σ, as shares of the level, (k,).
    widths: tuple[float, ...]


def _stacked(*columns: Array) -> Array:
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


#: Time constants of a decay and of a settling as multiples of the span, and powers of time: centre and spread are those
#: of the two that are published, 1 in TM-21 and 1.41, which the paper's luminances at 10 000 and 18 000 h have.
_CONSTANTS = (np.geomspace(0.3, 100.0, 80), 3.0, 1.5)
_SETTLINGS = (np.geomspace(0.03, 0.5, 4), 0.1, 1.0)
_POWERS = (np.geomspace(0.5, 2.5, 8), 1.19, 0.24)

#: The same for a law of three shapes, coarser.
_FEWER_CONSTANTS = (np.geomspace(0.3, 100.0, 40), 3.0, 1.5)

#: A decay may be linear, exponential, a power or a stretched exponential; each may begin with a settling. All of them
#: are here: were some left out, the average would lean to the curvature of those that remain.
LAWS = (
    Law("constant", "a", (), lambda s, t: np.ones((len(s), t.size, 1)), (_LEVEL,)),
    Law("linear", "a + b t", (), lambda s, t: _stacked(np.ones((len(s), t.size)), t[np.newaxis]), (_LEVEL, _CHANGE)),
    Law("exponential", "a exp(-t/τ)", (_CONSTANTS,), lambda s, t: np.exp(-t / s[:, :1])[..., np.newaxis], (_LEVEL,)),
    Law(
        "power", "a + b t^p", (_POWERS,),
        lambda s, t: _stacked(np.ones((len(s), t.size)), t ** s[:, :1]), (_LEVEL, _CHANGE),
    ),
    Law(
        "stretched exponential", "a exp(-(t/τ)^β)", (_CONSTANTS, _POWERS),
        lambda s, t: np.exp(-((t / s[:, :1]) ** s[:, 1:]))[..., np.newaxis], (_LEVEL,),
    ),
    Law(
        "settling, then exponential", "a exp(-t/τ) + b exp(-t/τ₁)", (_CONSTANTS, _SETTLINGS),
        lambda s, t: _stacked(np.exp(-t / s[:, :1]), np.exp(-t / s[:, 1:])), (_LEVEL, _SETTLING),
    ),
    Law(
        "settling, then linear", "a + b t + c exp(-t/τ₁)", (_SETTLINGS,),
        lambda s, t: _stacked(np.ones((len(s), t.size)), t[np.newaxis], np.exp(-t / s[:, :1])),
        (_LEVEL, _CHANGE, _SETTLING),
    ),
    Law(
        "settling, then power", "a + b t^p + c exp(-t/τ₁)", (_POWERS, _SETTLINGS),
        lambda s, t: _stacked(np.ones((len(s), t.size)), t ** s[:, :1], np.exp(-t / s[:, 1:])),
        (_LEVEL, _CHANGE, _SETTLING),
    ),
    Law(
        "settling, then stretched exponential", "a exp(-(t/τ)^β) + b exp(-t/τ₁)",
        (_FEWER_CONSTANTS, _POWERS, _SETTLINGS),
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


@dataclass(frozen=True)
class _Sample:
    """Points of a law's shapes and scatter, and the coefficients that each of them leaves."""

    #: Logarithm of a point's share of the evidence, (n,).
    weights: Array
    #: Shapes (n, p) and scatter (n,).
    shapes: Array
    scatter: Array
    #: Mean (n, k) and precision (n, k, k) of the coefficients.
    mean: Array
    precision: Array


def decay_of(time: Array, figures: Array, errors: Array, ahead: Array, *, draws: int, seed: list[int]) -> Decay:
    """Weigh all laws on a history, (n,) each, and draw its future at the times ``ahead``, in spans, (m,)."""
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


def _sample(law: Law, history: tuple[Array, Array, Array], rng: np.random.Generator) -> _Sample:
    """Draw cells of the grid by their evidence, and a point in each: posteriors may be narrower than a cell."""
    axes = (*law.axes, _SCATTER)
    # Middles of the cells, (s, p + 1).
    cells = np.stack(np.meshgrid(*(values for values, _, _ in axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    prior = _log_prior(axes, cells)
    whole = np.log(np.exp(prior).sum())
    of_cells = _posterior(law, cells, history)[0] + prior
    share = np.exp(of_cells - of_cells.max())
    chosen = rng.choice(len(cells), size=_POINTS_A_LAW, p=share / share.sum())
    steps = np.array([np.log(values[1] / values[0]) for values, _, _ in axes])
    points = cells[chosen] * np.exp(steps * rng.uniform(-0.5, 0.5, (chosen.size, len(axes))))
    evidence, mean, precision = _posterior(law, points, history)
    # What a cell's middle says of the cell is set right by the point that was drawn in it.
    weights = evidence + _log_prior(axes, points) - of_cells[chosen] + np.log(share.sum()) + of_cells.max() - whole
    return _Sample(weights, points[:, :-1], points[:, -1], mean, precision)


def _log_prior(axes: Sequence[Axis], points: Array) -> Array:
    """Logarithm of the prior at points, (s, p), but for a constant; (s,)."""
    centres, spreads = np.array([axis[1:] for axis in axes]).T
    return np.asarray(-0.5 * ((np.log(points / centres) / spreads) ** 2).sum(axis=1))


def _posterior(law: Law, points: Array, history: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Return log evidence, mean and precision of a law's coefficients at points of shapes and scatter, (s, p + 1)."""
    time, figures, errors = history
    columns = law.columns(points[:, :-1], time) / errors[:, np.newaxis]
    target, variance = figures / errors, points[:, -1:] ** 2
    cross = (columns * target[:, np.newaxis]).sum(axis=1) / variance
    precision = np.swapaxes(columns, -1, -2) @ columns / variance[..., np.newaxis] + np.diag(
        np.array(law.widths) ** -2.0
    )
    mean = np.linalg.solve(precision, cross[..., np.newaxis])[..., 0]
    fit = (target @ target) / variance[:, 0] - (cross * mean).sum(axis=1)
    log_size = np.log(np.linalg.det(precision)) + 2.0 * np.log(law.widths).sum()
    return -0.5 * (fit + log_size) - time.size * np.log(points[:, -1]), mean, precision
