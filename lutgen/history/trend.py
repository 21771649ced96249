"""The trend of a display: which law its figures follow, and when each limit will be passed.

Sessions in which something else than the display changed (see ``explain``) are left out: a step of a setting would
pass for aging. Intervals are a parametric bootstrap (Efron & Tibshirani 1993, ch. 6) in which every draw chooses its
law anew, so that not knowing the law is part of the uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError
from lutgen.history.causes import causes
from lutgen.history.decay import fit_laws
from lutgen.history.explain import explain
from lutgen.history.history import QUANTITIES, History, history

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.colorimetry import Array
    from lutgen.history.decay import Fitted
    from lutgen.history.limits import Limit
    from lutgen.readings.campaign import Campaign

#: Draws of the bootstrap, its seed, and the percentiles of an interval.
DRAWS, SEED, INTERVAL = 200, 270, (5.0, 95.0)

#: How far ahead a law is asked, as a multiple of the span that was measured.
HORIZON = 5.0

#: Points of time at which a law is asked.
_POINTS = 1001

#: Difference of AICc below which another law is as good (Burnham & Anderson 2002, p. 70).
AS_GOOD = 2.0

#: Fewest sessions for a law with a slope: AICc needs more sessions than numbers fitted, plus one.
FEWEST = 4


@dataclass(frozen=True)
class Passing:
    """When a limit is passed.

    Attributes
    ----------
    limit, bound
        The limit, and its value in the quantity's unit.
    status
        "passed", "ahead" (the law gets there within the horizon), "kept" (it does not), or "cannot-tell".
    time, low, high
        Since the earliest session; of ``passed`` those of the first session beyond it and the one before. None: not
        within the horizon, or no session before.
    extrapolated
        Whether the time lies behind the last session.

    """

    limit: Limit
    bound: float
    status: str
    time: float | None = None
    low: float | None = None
    high: float | None = None
    extrapolated: bool = False


@dataclass(frozen=True)
class Followed:
    """One quantity over time.

    Attributes
    ----------
    quantity
        One of ``history.QUANTITIES``.
    fits
        Laws, the best first; empty where fewer than two sessions tell.
    curve, low, high
        The best law at ``Trend.ahead``, (m,), and its interval.

    """

    quantity: str
    fits: tuple[Fitted, ...]
    curve: Array
    low: Array
    high: Array

    @property
    def as_good(self) -> tuple[str, ...]:
        """Names of the laws that the sessions cannot tell from the best."""
        return tuple(each.law.name for each in self.fits[1:] if each.aicc - self.fits[0].aicc < AS_GOOD)


@dataclass(frozen=True)
class Trend:
    """The trend of a campaign.

    Attributes
    ----------
    history
        Figures of all sessions.
    kept
        Which of them the laws are fitted to, (n,).
    why
        Place in the history → why a session is left out.
    ahead
        Times at which laws are drawn, (m,), up to the horizon.
    courses, passings
        By quantity, and by limit.

    """

    history: History
    kept: Array
    why: dict[int, str]
    ahead: Array
    courses: dict[str, Followed]
    passings: tuple[Passing, ...]


def trend(
    campaign: Campaign,
    limits: Sequence[Limit],
    *,
    all_sessions: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Trend:
    """Follow a display and say when each limit is passed; ``all_sessions`` leaves none out.

    Raises
    ------
    LutgenError
        Fewer than two sessions, no hours and no dates, all at one time, or a relative session.

    """
    if len(campaign.entries) < 2:
        message = f"{campaign.file}: one session; a trend is told from two or more. Add another [[sessions]]."
        raise LutgenError(message)
    seen = history(campaign)
    if seen.time[-1] <= 0:
        message = f"{campaign.file}: all sessions are of one time; a trend takes sessions months apart."
        raise LutgenError(message)
    why = {} if all_sessions else _left_out(seen, progress)
    kept = np.array([place not in why for place in range(len(seen.places))])
    ahead = np.linspace(0.0, (1.0 + HORIZON) * float(seen.time[-1]), _POINTS)
    drawn = {name: _course(seen, name, kept, ahead) for name in QUANTITIES}
    passings = tuple(_passing(seen, limit, kept, drawn[limit.quantity], ahead) for limit in limits)
    return Trend(seen, kept, why, ahead, {name: course for name, (course, _) in drawn.items()}, passings)


def _left_out(seen: History, progress: Callable[[int, int], None] | None) -> dict[int, str]:
    """Say which sessions differ by something else than the display's own aging, and by what."""
    found = explain(seen.campaign, progress=progress)
    others = [place for place in range(len(seen.places)) if place != found.reference]
    verdict_of = dict(zip(others, found.verdicts, strict=True))
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
    """ColourFit the laws; return the course and the curve of every draw, (draws, m)."""
    values, errors = seen.values[name], seen.errors[name]
    used = kept & np.isfinite(values)
    none = np.full(ahead.size, np.nan)
    if np.count_nonzero(used) < 2:
        return Followed(name, (), none, none, none), np.empty((0, ahead.size))
    span = float(seen.time[-1])
    time, figures, sigma = seen.time[used] / span, values[used], errors[used]
    fits = fit_laws(time, figures[np.newaxis], sigma)[0]
    best = fits[0]
    spare = max(time.size - best.law.parameters, 1)
    rng = np.random.default_rng([SEED, *name.encode()])
    spread = sigma * max(1.0, np.sqrt(best.chi2 / spare))
    draws = best.at(time) + spread * rng.standard_normal((DRAWS, time.size))
    # Each draw takes its own best law among those that the readings themselves leave open.
    open_laws = {best.law.name, *(each.law.name for each in fits if each.aicc - best.aicc < 2 * AS_GOOD)}
    curves = np.array(
        [next(each for each in found if each.law.name in open_laws).at(ahead / span)
         for found in fit_laws(time, draws, sigma)]
    )  # fmt: skip
    low, high = np.percentile(curves, INTERVAL, axis=0)
    return Followed(name, tuple(fits), best.at(ahead / span), low, high), curves


def _passing(seen: History, limit: Limit, kept: Array, drawn: tuple[Followed, Array], ahead: Array) -> Passing:
    course, curves = drawn
    values = np.where(kept, seen.values[limit.quantity], np.nan)
    told = np.isfinite(values)
    if not told.any():
        return Passing(limit, np.nan if limit.relative else limit.value, "cannot-tell")
    bound = limit.value * float(values[told][0]) if limit.relative else limit.value
    beyond = told & ((values < bound) if limit.above else (values > bound))
    if beyond.any():
        first = int(np.argmax(beyond))
        before = seen.time[:first][told[:first]]
        return Passing(limit, bound, "passed", float(seen.time[first]), float(before[-1]) if before.size else None)
    if np.count_nonzero(told) < FEWEST:
        return Passing(limit, bound, "cannot-tell")
    best = _first(course.curve[np.newaxis], bound, ahead, above=limit.above)[0]
    low, high = np.percentile(_first(curves, bound, ahead, above=limit.above), INTERVAL, method="nearest")
    if not np.isfinite(best):
        early = float(low) if np.isfinite(low) else None
        return Passing(limit, bound, "kept", low=early)
    late = float(high) if np.isfinite(high) else None
    return Passing(limit, bound, "ahead", float(best), float(low), late, bool(best > seen.time[-1]))


def _first(curves: Array, bound: float, ahead: Array, *, above: bool) -> Array:
    """Time at which each curve first lies beyond a bound, (m,); infinite where it does not."""
    beyond = (curves < bound) if above else (curves > bound)
    return np.where(beyond.any(axis=1), ahead[np.argmax(beyond, axis=1)], np.inf)


def name_of(seen: History, here: int) -> str:
    """Name of a session's file by its place in the history."""
    return Path(seen.campaign.entries[seen.places[here]].session.file).name


def trend_as_json(found: Trend) -> dict[str, Any]:
    """Return the content of the file."""
    seen = found.history
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
                "left_out": found.why.get(here),
                "figures": {name: float(values[here]) for name, values in seen.values.items()},
            }
            for here, place in enumerate(seen.places)
        ],
        "courses": {name: _course_json(course) for name, course in found.courses.items()},
        "limits": [_passing_json(each) for each in found.passings],
    }


def _course_json(course: Followed) -> dict[str, Any]:
    return {
        "law": course.fits[0].law.name if course.fits else None,
        "as_good": list(course.as_good),
        "aicc": {each.law.name: each.aicc for each in course.fits},
    }


def _passing_json(each: Passing) -> dict[str, Any]:
    return {
        "limit": each.limit.text,
        "quantity": each.limit.quantity,
        "bound": each.bound,
        "source": each.limit.source,
        "status": each.status,
        "time": each.time,
        "low": each.low,
        "high": each.high,
        "extrapolated": each.extrapolated,
    }
