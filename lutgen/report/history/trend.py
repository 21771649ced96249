"""The page of ``lutgen trend``: figures by session, laws, and limits with the time until each is passed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.history import QUANTITIES
from lutgen.history.trend import ENOUGH, FEWEST, HORIZON, name_of
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
    "non-uniformity": ".0%",
    "gsdf": ".0%",
    "ambient": ".2f",
}


#: Limits that the headline names.
SAID = 2

#: Quantity → how a sentence calls it; and the unit of its limits.
_NAMES = {
    "white": "white",
    "black": "black",
    "contrast": "contrast",
    "white-shift": "white's colour",
    "primaries-shift": "a primary's colour",
    "gamma": "γ",
    "non-uniformity": "non-uniformity",
    "gsdf": "the deviation from DICOM's contrast response",
    "ambient": "the room's light over black",
}
_UNITS = {"white": " cd/m²", "black": " cd/m²", "contrast": ":1"}


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
        yield f"{kept} sessions: a time cannot be told from fewer than {FEWEST}."
    elif kept < ENOUGH and any(each.status == "ahead" for each in trend.passings):
        yield f"Fewer than eight sessions ({kept}): the intervals rest as much on which laws of decay are usual."
    yield limits(trend)
    yield from (f"{each.limit.text}: {source(each.limit)}." for each in trend.passings if _is_read(trend, each))
    if unread := [each.limit.text for each in trend.passings if not _is_read(trend, each)]:
        yield f"No session tells: {', '.join(unread)} (greys and black, several places, --ambient)."


def source(limit: Limit) -> str:
    """Name the source of a limit, and say so where its number was not read there."""
    if limit.source == "user":
        return "as given by --limit"
    return limit.source if limit.verified else f"{limit.source}; not verified: the number was not read in the source"


def headline(trend: Trend) -> str:
    """Name the limits that are passed already, or else the limit that will be passed next."""
    seen = trend.history
    name = seen.campaign.display or seen.campaign.file
    passed = [each for each in trend.passings if each.status == "passed"]
    if passed:
        more = f"; limits not kept in all: {len(passed)}" if len(passed) > SAID else ""
        return f"{name}: {'; '.join(_beyond(each, seen.unit) for each in passed[:SAID])}{more}."
    ahead = [each for each in trend.passings if each.status == "ahead" and each.time is not None]
    if not ahead and any(each.status == "cannot-tell" for each in trend.passings):
        return f"{name}: no limit is seen passed, and when one will be cannot be told from these sessions."
    if not ahead:
        return f"{name}: no limit is passed, and none is in sight."
    soonest = min(ahead, key=lambda each: each.time or np.inf)
    limit, side = soonest.limit, "fall below" if soonest.limit.above else "rise above"
    return f"{name}: {_NAMES[limit.quantity]} will {side} its {_value(limit)} limit {when(soonest, seen.unit)}."


def _beyond(each: Passing, unit: str) -> str:
    """Say of a limit that is not kept since when: between two sessions, or since the first."""
    side = "below" if each.limit.above else "above"
    return f"{_NAMES[each.limit.quantity]} has been {side} its {_value(each.limit)} limit {when(each, unit)}"


def _value(limit: Limit) -> str:
    text = limit.text.partition(">=" if limit.above else "<=")[2]
    return text.replace("%", " %") + _UNITS.get(limit.quantity, "") * (not limit.relative)


def when(each: Passing, unit: str) -> str:
    """Say when a limit is passed, with its interval."""
    if each.status == "passed":
        if each.low is None:
            return "since the first session that tells" if each.time else "since the first session"
        return f"since {spaced(each.low)} to {spaced(each.time or 0.0)} {unit}"
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
    shown = [name for name in QUANTITIES if np.isfinite(seen.values[name]).any()]
    rows = []
    for here, time in enumerate(seen.time):
        figures = [seen.values[name][here] for name in shown]
        cells = [f"{v:{_DIGITS[name]}}" if np.isfinite(v) else "–" for name, v in zip(shown, figures, strict=True)]
        hour = spaced(float(time))
        rows.append((name_of(seen, here), hour if trend.kept[here] else f"({hour})", *cells))
    return Table(("session", seen.unit, *shown), rows)


def laws(trend: Trend) -> Table:
    """Tabulate for each quantity the likeliest law, its share of the evidence, and the laws beside it."""
    followed = [(name, course.as_good, course.decay) for name, course in trend.courses.items()]
    rows = [
        (
            name,
            decay.law.name,
            f"{decay.weights[decay.law.name]:.0%}",
            ", ".join(also) or "–",
            f"{decay.scatter:.1f}",
        )
        for name, also, decay in followed
        if decay
    ]
    return Table(("quantity", "likeliest law", "share", "also", "scatter"), rows)


def limits(trend: Trend) -> Table:
    """Tabulate the limits of quantities that were read, their bounds, and since or from when each is not kept."""
    rows = [
        (
            each.limit.text,
            f"{each.bound:.4g}" if np.isfinite(each.bound) else "–",
            when(each, trend.history.unit),
        )
        for each in trend.passings
        if _is_read(trend, each)
    ]
    return Table(("limit", "bound", "when"), rows)


def _is_read(trend: Trend, each: Passing) -> bool:
    """Whether any session tells the quantity of a limit."""
    return bool(np.isfinite(trend.history.values[each.limit.quantity]).any())
