"""The page of ``lutgen trend``: figures by session, laws, and limits with the time until each is passed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.history import QUANTITIES
from lutgen.history.trend import FEWEST, HORIZON, name_of
from lutgen.numerals import spaced
from lutgen.report.history.explanation import simulated
from lutgen.report.parts import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.history.limits import Limit
    from lutgen.history.trend import Passing, Trend
    from lutgen.report.parts import Part

#: Digits of each quantity.
_DIGITS = {
    "white": ".1f",
    "black": ".3f",
    "contrast": ".0f",
    "white-shift": ".4f",
    "primaries-shift": ".4f",
    "gamma": ".2f",
}


def trend_page(trend: Trend) -> Iterator[Part]:
    """Yield what ``lutgen trend`` prints."""
    yield from simulated(trend.history.campaign)
    yield headline(trend)
    yield sessions(trend)
    for here, why in trend.why.items():
        yield f"Left out: {name_of(trend.history, here)}, which differs by {why} (lutgen sessions explain says more)."
    yield laws(trend)
    kept = int(trend.kept.sum())
    if kept < FEWEST:
        yield f"{kept} sessions: a law of decay cannot be told from fewer than {FEWEST}."
    yield limits(trend)
    yield from (f"{each.limit.text}: {source(each.limit)}." for each in trend.passings)


def source(limit: Limit) -> str:
    """Name the source of a limit."""
    return "as given by --limit" if limit.source == "user" else limit.source


def headline(trend: Trend) -> str:
    """Name the limits that are passed already, or else the limit that will be passed next."""
    seen = trend.history
    name = seen.campaign.display or seen.campaign.file
    passed = [each for each in trend.passings if each.status == "passed"]
    if passed:
        return f"{name}: passed {' and '.join(each.limit.text for each in passed)} already."
    ahead = [each for each in trend.passings if each.status == "ahead" and each.time is not None]
    if not ahead and any(each.status == "cannot-tell" for each in trend.passings):
        return f"{name}: no limit is seen passed, and when one will be cannot be told from these sessions."
    if not ahead:
        return f"{name}: no limit is passed, and none is in sight."
    soonest = min(ahead, key=lambda each: each.time or np.inf)
    return f"{name}: {soonest.limit.text} will be passed {when(soonest, seen.unit)}."


def when(each: Passing, unit: str) -> str:
    """Say when a limit is passed, with its interval."""
    if each.status == "passed":
        since = f"between {spaced(each.low)} and " if each.low is not None else "by "
        return f"{since}{spaced(each.time or 0.0)} {unit}, as read"
    if each.status == "cannot-tell":
        return "cannot be told from these sessions"
    if each.status == "kept":
        early = f" (90 %: not before {_round(each.low)} {unit})" if each.low is not None else ""
        return f"not within {1 + HORIZON:g} times the span measured{early}"
    high = _round(each.high) if each.high is not None else "never"
    mark = ", extrapolated" if each.extrapolated else ""
    return f"at {_round(each.time)} {unit} (90 %: {_round(each.low)} to {high}{mark})"


def _round(time: float | None) -> str:
    return spaced(round(time or 0.0))


def sessions(trend: Trend) -> Table:
    """Tabulate the quantities by session; a dash: not measured, a time in brackets: the session is left out."""
    seen = trend.history
    rows = []
    for here, time in enumerate(seen.time):
        figures = [seen.values[name][here] for name in QUANTITIES]
        cells = [f"{v:{_DIGITS[name]}}" if np.isfinite(v) else "–" for name, v in zip(QUANTITIES, figures, strict=True)]
        shown = spaced(float(time))
        rows.append((name_of(seen, here), shown if trend.kept[here] else f"({shown})", *cells))
    return Table(("session", seen.unit, *QUANTITIES), rows)


def laws(trend: Trend) -> Table:
    """Tabulate for each quantity the chosen law and the laws that fit as well."""
    rows = [
        (name, course.fits[0].law.name, course.fits[0].law.formula, ", ".join(course.as_good) or "–")
        for name, course in trend.courses.items()
        if course.fits
    ]
    return Table(("quantity", "law", "formula", "as good"), rows)


def limits(trend: Trend) -> Table:
    """Tabulate the limits, their bounds, and when each is passed."""
    rows = [
        (
            each.limit.text,
            f"{each.bound:.4g}" if np.isfinite(each.bound) else "–",
            when(each, trend.history.unit),
        )
        for each in trend.passings
    ]
    return Table(("limit", "bound", "passed"), rows)
