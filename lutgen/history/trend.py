"""The trend of a display: which law of decay its figures follow, and when each limit will be passed.

Sessions that differ by something other than aging (see ``explain``) are left out: a changed setting would look like
aging. The reference is the session from which the most sessions differ by nothing but age. The trend is an average over
all laws of ``decay``, weighted by evidence, since a few sessions fit several laws.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.errors import LutgenError
from lutgen.history.causes import causes
from lutgen.history.decay import Decay, decay_of
from lutgen.history.explain import Explanations, explain, references
from lutgen.history.history import QUANTITIES, History, Limit, history, times
from lutgen.history.verdicts import SessionVerdict
from lutgen.progress import Progress, unseen
from lutgen.readings.campaign import Campaign

#: Number of draws of the future, their seed, and the share of the draws that an interval holds.
DRAWS, SEED, INTERVAL = 1000, 270, 0.9

#: Length of the extrapolation, as a multiple of the measured span.
HORIZON = 5.0

#: Number of times at which laws are evaluated.
_POINTS = 1001

#: Smallest share of the evidence with which a law is named beside the likeliest law.
NAMED = 0.1

#: What a trend may say about a limit. "passed": the last session is beyond the limit; "returned": an earlier session is
#: beyond the limit, but the last is not; "contradicted": the laws pass the limit by the last session, but no session is
#: beyond it; "ahead": passed within the horizon; "kept": not passed within the horizon.
STATUSES = ("passed", "returned", "contradicted", "ahead", "kept", "cannot-tell")

#: Most sessions that are tried as the reference: each costs a comparison with every other session.
TRIED = 6

#: Fewest sessions for a law and a time, and for an interval that depends more on the sessions than on the priors.
FEWEST, ENOUGH = 4, 8


@dataclass(frozen=True)
class Passing:
    """When a limit is passed."""

    #: The limit, and its value in the quantity's unit.
    limit: Limit
    bound: float
    #: One of ``STATUSES``.
    status: str
    #: Median, and ends of the interval, as time since the earliest session; None: not within the horizon. For
    #: ``passed``, ``time`` is the time of the session since which all are beyond the limit, and ``low`` that of the
    #: session before, if any. For ``returned``, ``low`` and ``time`` are the first and the last session beyond it. For
    #: ``contradicted``, ``time`` is the time of the last session.
    time: float | None = None
    low: float | None = None
    high: float | None = None
    #: Whether the time lies after the last session.
    extrapolated: bool = False


@dataclass(frozen=True)
class Followed:
    """One quantity over time."""

    #: The laws by evidence; None if fewer than ``FEWEST`` used sessions have the figure.
    decay: Decay | None
    #: Median of the draws at ``Trend.ahead``, (m,), and their interval.
    curve: Array
    low: Array
    high: Array

    @property
    def as_good(self) -> tuple[str, ...]:
        """Names of the laws, without the likeliest law, whose weight is at least ``NAMED``."""
        weights = self.decay.weights if self.decay else {}
        return tuple(name for name, weight in [*weights.items()][1:] if weight >= NAMED)


@dataclass(frozen=True)
class Trend:
    """The trend of a campaign."""

    #: Figures of all sessions.
    history: History
    #: Whether the laws are fitted to each session, (n,).
    kept: Array
    #: Index in the history of the session with which the others were compared; None: all sessions are used.
    reference: int | None
    #: Index in the history → the verdict on a session that is left out.
    left_out: dict[int, SessionVerdict]
    #: Times at which laws are evaluated, (m,), up to the horizon.
    ahead: Array
    #: Quantity → its course; and one result for each limit.
    courses: dict[str, Followed]
    passings: tuple[Passing, ...]

    @property
    def why(self) -> dict[int, str]:
        """Index in the history → names of the causes for which a session is left out."""
        joins = {here: " and " if each.kind == "several" else " or " for here, each in self.left_out.items()}
        return {here: " and ".join(each.sure) or joins[here].join(each.names) for here, each in self.left_out.items()}


def trend(
    campaign: Campaign,
    limits: Sequence[Limit],
    *,
    all_sessions: bool = False,
    ambient_cd_m2: float = 0.0,
    reference: str | None = None,
    progress: Progress = unseen,
) -> Trend:
    """Follow a display and say when each limit is passed. Raises LutgenError: too few sessions, or no times.

    ``reference`` is the file of the session with which the others are compared.
    """
    campaign.check_several("a trend")
    if times(campaign)[0].max() <= 0:
        why = "all sessions have the same time; a trend needs sessions that are months apart"
        raise LutgenError(f"{campaign.file}: {why}.")
    explained = None if all_sessions else _compared(campaign, reference, progress)
    spoilt = _spoilt(explained) if explained else {}
    seen = history(campaign, ambient_cd_m2, {*range(len(campaign.entries))} - {*spoilt})
    left_out = {here: spoilt[place] for here, place in enumerate(seen.places) if place in spoilt}
    kept = np.array([here not in left_out for here in range(len(seen.places))])
    ahead = np.linspace(0.0, (1.0 + HORIZON) * float(seen.time[-1]), _POINTS)
    courses = {name: _course(seen, name, kept, ahead) for name in QUANTITIES}
    passings = tuple(_passing(seen, limit, kept, courses[limit.quantity].decay, ahead) for limit in limits)
    compared = seen.places.index(explained.reference) if explained else None
    return Trend(seen, kept, compared, left_out, ahead, courses, passings)


def _compared(campaign: Campaign, reference: str | None, progress: Progress) -> Explanations:
    """Return the comparison with ``reference``, or with the session from which most differ by nothing but age.

    If several sessions have equally many, the first sound one is used. A session that differs by nothing but age from a
    session that was already tried is not tried: nearly the same sessions would differ from it by nothing but age.
    """
    if reference:
        return explain(campaign, reference=reference, progress=progress)
    untried, best, most = references(campaign), None, 0
    for _ in range(TRIED):
        if len(untried) <= most:
            break
        explained = explain(campaign, reference=untried[0], progress=progress)
        verdicts, spoilt = _verdicts(explained), _spoilt(explained)
        alike = {place for place, each in verdicts.items() if place not in spoilt and each.kind != "unclear"}
        alike.add(explained.reference)
        if len(alike) > most:
            best, most = explained, len(alike)
        untried = [place for place in untried if place not in alike]
    return best or explain(campaign, progress=progress)


def _verdicts(explained: Explanations) -> dict[int, SessionVerdict]:
    """Return index in the campaign → verdict, for all sessions but the reference."""
    others = [place for place in range(len(explained.campaign.entries)) if place != explained.reference]
    return dict(zip(others, explained.verdicts, strict=True))


def _spoilt(explained: Explanations) -> dict[int, SessionVerdict]:
    """Return the verdicts on sessions that differ by something other than the display's own aging."""
    telling = {name for name, cause in causes().items() if not cause.spoils}
    return {
        place: each
        for place, each in _verdicts(explained).items()
        if each.names and (not telling & {*each.names} or {*each.sure} - telling)
    }


def _course(seen: History, name: str, kept: Array, ahead: Array) -> Followed:
    values, errors = seen.values[name], seen.errors[name]
    used = kept & np.isfinite(values) & np.isfinite(errors) & (errors > 0)
    if np.count_nonzero(used) < FEWEST:
        none = np.full(ahead.size, np.nan)
        return Followed(None, none, none, none)
    span = float(seen.time[-1])
    decay = decay_of(
        seen.time[used] / span, values[used], errors[used], ahead / span, draws=DRAWS, seed=[SEED, *name.encode()]
    )
    low, middle, high = np.quantile(decay.curves, (0.5 - INTERVAL / 2, 0.5, 0.5 + INTERVAL / 2), axis=0)
    return Followed(decay, middle, low, high)


def _passing(seen: History, limit: Limit, kept: Array, decay: Decay | None, ahead: Array) -> Passing:
    values = np.where(kept, seen.values[limit.quantity], np.nan)
    read = np.isfinite(values)
    if not read.any():
        return Passing(limit, np.nan if limit.relative else limit.value, "cannot-tell")
    bound = limit.value * float(values[read][0]) if limit.relative else limit.value
    beyond = read & ((values < bound) if limit.above else (values > bound))
    if beyond.any():
        out, within = seen.time[beyond], seen.time[read & ~beyond]
        if not beyond[read][-1]:
            return Passing(limit, bound, "returned", float(out[-1]), float(out[0]))
        since = int(np.flatnonzero(read & ~beyond)[-1]) + 1 if within.size else 0
        first = since + int(np.argmax(beyond[since:]))
        return Passing(limit, bound, "passed", float(seen.time[first]), float(within[-1]) if within.size else None)
    if decay is None:
        return Passing(limit, bound, "cannot-tell")
    passing, last = _by_the_laws(limit, bound, decay.curves, ahead, float(seen.time[-1])), float(seen.time[read][-1])
    early = passing.time is not None and passing.time <= last
    return Passing(limit, bound, "contradicted", last) if early else passing


def _by_the_laws(limit: Limit, bound: float, curves: Array, ahead: Array, end: float) -> Passing:
    """Return when curves, (d, m), pass a limit; a time after ``end``, the last session, is an extrapolation."""
    # A relative limit is a share of the first session's figure in each draw, since its reading is noisy.
    bounds = limit.value * curves[:, :1] if limit.relative else np.full((len(curves), 1), bound)
    passed = first_beyond(curves, bounds, ahead, above=limit.above)
    middle = np.percentile(passed, 50.0, method="nearest")
    low, high = shortest(passed, INTERVAL, float(ahead[-1]))
    if not np.isfinite(middle):
        return Passing(limit, bound, "kept", low=low if np.isfinite(low) else None)
    late = high if np.isfinite(high) else None
    return Passing(limit, bound, "ahead", float(middle), low, late, bool(middle > end))


def first_beyond(curves: Array, bounds: Array, ahead: Array, *, above: bool) -> Array:
    """Return the time at which each curve, (d, m), is first beyond its bound, (d,); infinite if never."""
    beyond = (curves < bounds) if above else (curves > bounds)
    return np.where(beyond.any(axis=1), ahead[np.argmax(beyond, axis=1)], np.inf)


def shortest(times: Array, share: float, end: float) -> tuple[float, float]:
    """Return the ends of the shortest interval that holds a share of times, (d,). An infinite time counts as ``end``.

    Times have a long tail of late ones. Equal-tailed percentiles would reach far into it, hold more than their share
    for usual laws, and begin after the earliest times, which matter most.
    """
    ordered = np.sort(times)
    held = int(np.ceil(share * ordered.size))
    within = np.minimum(ordered, end)
    first = int(np.argmin(within[held - 1 :] - within[: ordered.size - held + 1]))
    return float(ordered[first]), float(ordered[first + held - 1])


def name_of(seen: History, here: int) -> str:
    """Return the name of a session's file by the session's index in the history."""
    return Path(seen.campaign.entries[seen.places[here]].session.file).name


def trend_as_json(trend: Trend) -> dict[str, Any]:
    """Return the content of ``trend --json``."""
    seen = trend.history
    campaign = seen.campaign
    return {
        "schema": 1,
        "campaign": {"file": campaign.file, "sha256": campaign.sha256, "display": campaign.display or None},
        "unit": seen.unit,
        "reference": None if trend.reference is None else campaign.entries[seen.places[trend.reference]].session.file,
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
        "law": course.decay.law if course.decay else None,
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
