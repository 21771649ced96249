"""The pages of ``lutgen sessions explain`` and ``lutgen trend``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import listed
from lutgen.history.history import QUANTITIES
from lutgen.history.trend import ENOUGH, FEWEST, HORIZON, STATUSES, Passing, Trend, name_of
from lutgen.numerals import counted, spaced
from lutgen.report.parts import Headline, Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from lutgen.history.explain import Explanations
    from lutgen.history.history import Limit
    from lutgen.readings.campaign import Campaign


def explanation_page(explanations: Explanations) -> Iterator[Part]:
    """Yield what ``lutgen sessions explain`` prints."""
    reference = explanations.campaign.entries[explanations.reference].session
    yield from simulated(explanations.campaign)
    yield f"Compared with {Path(reference.file).name}."
    explained = list(zip(explanations.pairs, explanations.verdicts, strict=True))
    in_hours = all(pair.hours is not None for pair in explanations.pairs)
    rows = []
    for pair, verdict in explained:
        time = pair.hours if in_hours else pair.days
        when = "–" if time is None else spaced(time if in_hours else round(time))
        name = Path(pair.after.session.file).name
        rows.append((name, when, verdict.kind, verdict.causes_in_words or "–", verdict.display))
    yield Table(("session", "hours" if in_hours else "days", "verdict", "cause", "the display"), rows)
    for pair, verdict in explained:
        yield ""
        yield Headline(Path(pair.after.session.file).name)
        yield verdict.sentence
        yield from (f"• {each}" for each in verdict.evidence)
        yield from (f"To confirm or refute: {each}." for each in verdict.tests)


def simulated(campaign: Campaign) -> Iterator[str]:
    """Yield a line that names simulated sessions, if there are any."""
    metadata = (pair for entry in campaign.entries for pair in entry.session.metadata.items())
    notices = [text for key, text in metadata if key.upper() == "SIMULATED"]
    yield from (f"Simulated, not measured: {text}." for text in notices[:1])


def other_displays(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence on the names of displays in the files, if they differ."""
    times = Counter(entry.session.display for entry in campaign.entries)
    named = [f"{name} ({counted(number, 'session')})" for name, number in times.items() if name]
    if len(named) > 1:
        yield f"The files name different displays: {'; '.join(named)}. A trend follows one display."


#: Largest number of limits that the headline names.
HEADLINED = 2


def trend_page(trend: Trend) -> Iterator[Part]:
    """Yield what ``lutgen trend`` prints."""
    yield from simulated(trend.history.campaign)
    yield trend_headline(trend)
    yield from other_displays(trend.history.campaign)
    yield sessions(trend)
    if trend.left_out and trend.reference is not None:
        yield (
            f"Compared with {name_of(trend.history, trend.reference)}: --reference FILE takes another session, and "
            "lutgen sessions explain --reference FILE says more."
        )
    for place, verdict in trend.left_out.items():
        yield f"Left out: {name_of(trend.history, place)}. {verdict.sentence}"
    weighed = laws(trend)
    if weighed.rows:
        yield weighed
    kept = int(trend.kept.sum())
    if kept < FEWEST:
        yield f"{kept} session{'' if kept == 1 else 's'}: a time cannot be told from fewer than {FEWEST}."
    elif kept < ENOUGH and any(each.status == "ahead" for each in trend.passings):
        yield f"Fewer than eight sessions ({kept}): the intervals depend strongly on the assumed laws of decay."
    yield limits(trend)
    yield from (f"{each.limit.text}: {source(each.limit)}." for each in trend.passings if _is_read(trend, each))
    # Two published sets may contain the same limit.
    if unread := dict.fromkeys(each.limit.text for each in trend.passings if not _is_read(trend, each)):
        yield f"No session tells: {', '.join(unread)} (greys and black, several places, --ambient)."


def source(limit: Limit) -> str:
    """Return the source of a limit, marked if the number was not verified in the source."""
    if limit.source == "user":
        return "as given by --limit"
    return limit.source if limit.verified else f"{limit.source}; not verified: the number was not read in the source"


def trend_headline(trend: Trend) -> str:
    """Return a sentence on the limits that matter most, or on why there is nothing to say about any."""
    name = f"{_display(trend)}:"
    if trend.left_out and np.count_nonzero(trend.kept) < 2:
        name += f" no trend, since {len(trend.left_out)} of {trend.kept.size} sessions differ by more than age;"
    passed = [each for each in trend.passings if each.status == "passed"]
    if named := _headlined(trend):
        more = f"; limits not kept in all: {len(passed)}" if any(each not in named for each in passed) else ""
        return f"{name} {'; '.join(_clause(each, trend) for each in named)}{more}."
    among = " in the sessions used" if trend.why else ""
    if any(each.status == "cannot-tell" for each in trend.passings):
        return f"{name} no limit is seen passed{among}, and when one will be cannot be told from these sessions."
    return f"{name} no limit is passed{among}, and none is in sight."


def _display(trend: Trend) -> str:
    """Return the campaign's name of the display; the names in the files of used sessions if it is from the files."""
    seen, campaign = trend.history, trend.history.campaign
    names = [campaign.entries[place].session.display for place in seen.places]
    used = dict.fromkeys(name for name, kept in zip(names, trend.kept, strict=True) if name and kept)
    return (listed(used) if campaign.display in names else "") or campaign.display or campaign.file


def _headlined(trend: Trend) -> list[Passing]:
    """Return the limits of the headline: those that aging passes, soonest first, then those passed from the start."""
    of = {status: [each for each in trend.passings if each.status == status] for status in STATUSES}
    aged = sorted((each for each in of["passed"] if each.low is not None), key=lambda each: each.time or 0.0)
    next_one = sorted(of["ahead"], key=lambda each: each.time or 0.0)[:1]
    from_the_start = [each for each in of["passed"] if each.low is None]
    return [*aged, *next_one, *from_the_start, *of["returned"]][:HEADLINED]


def _clause(each: Passing, trend: Trend) -> str:
    """Return a clause on a limit that is passed, was passed, or will be passed."""
    what, value, time = QUANTITIES[each.limit.quantity].noun, _value(each.limit), when(each, trend)
    side = "below" if each.limit.above else "above"
    if each.status == "ahead":
        will = "will" if each.high is not None else "may"
        return f"{what} {will} {'fall' if each.limit.above else 'rise'} {side} its {value} limit {time}"
    if each.status == "returned":
        last, now = _returned(each, trend)
        return f"{what} was {side} its {value} limit{last} and is {now}"
    return f"{what} {'was' if _used(each, trend).size == 1 else 'has been'} {side} its {value} limit {time}"


def _used(each: Passing, trend: Trend) -> NDArray[np.intp]:
    """Return the indices of the used sessions that read the quantity of a limit, (n,)."""
    return np.flatnonzero(trend.kept & np.isfinite(trend.history.values[each.limit.quantity]))


def _value(limit: Limit) -> str:
    text = limit.text.partition(">=" if limit.above else "<=")[2]
    return text.replace("%", " %") + QUANTITIES[limit.quantity].unit * (not limit.relative)


def _returned(each: Passing, trend: Trend) -> tuple[str, str]:
    """Return clauses on a limit that the last session keeps: when a session was last beyond it, and the figure now."""
    seen, last, quantity = trend.history, _used(each, trend)[-1], QUANTITIES[each.limit.quantity]
    figure = float(seen.values[each.limit.quantity][last])
    shown = f"{100 * figure:.0f} %" if quantity.is_share else f"{figure:.0f}" if figure >= 100 else f"{figure:.3g}"
    now = "now" if last == seen.time.size - 1 else f"at {_at(trend, float(seen.time[last]))}"
    side = "above" if each.limit.above else "below"
    then = f"at {_at(trend, each.time)}"
    return (
        f" {then}" if each.low == each.time else f", last {then},",
        f"{side} it {now}, {shown}{quantity.unit}",
    )


def _at(trend: Trend, time: float | None) -> str:
    return f"{trend.history.unit.removesuffix('s')} {spaced(time or 0.0)}"


def when(each: Passing, trend: Trend) -> str:
    """Return a clause on the time when a limit is passed, with its interval."""
    unit = trend.history.unit
    if each.status == "passed":
        return _since(each, trend)
    if each.status == "returned":
        last, now = _returned(each, trend)
        return f"{'below' if each.limit.above else 'above'}{last.removesuffix(',')}, {now}"
    if each.status == "cannot-tell":
        return "cannot be told from these sessions"
    if each.status == "kept":
        early = f" (90 %: not before {_round(each.low)} {unit})" if each.low is not None else ""
        return f"not within {1 + HORIZON:g} times the span measured{early}"
    high = _round(each.high) if each.high is not None else "never"
    mark = ", extrapolated" if each.extrapolated else ""
    return f"at {_round(each.time)} {unit} (90 %: {_round(each.low)} to {high}{mark})"


def _since(each: Passing, trend: Trend) -> str:
    """Return a clause on the time since which a limit is passed; it names the used sessions if some are left out."""
    unit = trend.history.unit
    first = _at(trend, each.time)
    if _used(each, trend).size == 1:
        return f"in the only session {'used' if trend.why else 'that read it'}, {first}"
    if each.low is not None:
        among = "in the sessions used, " if trend.why else ""
        return f"{among}since {spaced(each.low)} to {spaced(each.time or 0.0)} {unit}"
    if trend.why:
        return f"since the first session used, {first}"
    return "since its first measurement" if each.time else "since the first session"


def _round(time: float | None) -> str:
    return spaced(round(time or 0.0))


def sessions(trend: Trend) -> Table:
    """Return a table of the quantities by session. A dash: not measured; a time in brackets: session left out."""
    seen = trend.history
    shown = [name for name in QUANTITIES if np.isfinite(seen.values[name]).any()]
    rows = []
    for place, time in enumerate(seen.time):
        figures = ((name, seen.values[name][place]) for name in shown)
        cells = [f"{value:{QUANTITIES[name].digits}}" if np.isfinite(value) else "–" for name, value in figures]
        hour = spaced(float(time))
        rows.append((name_of(seen, place), hour if trend.kept[place] else f"({hour})", *cells))
    return Table(("session", seen.unit, *shown), rows)


def laws(trend: Trend) -> Table:
    """Tabulate for each quantity the likeliest law, its share of the evidence, and the laws beside it."""
    followed = [(name, course.as_good, course.decay) for name, course in trend.courses.items()]
    rows = [
        (name, decay.law, f"{decay.weights[decay.law]:.0%}", "; ".join(also) or "–", f"{decay.scatter:.1f}")
        for name, also, decay in followed
        if decay
    ]
    return Table(("quantity", "likeliest law", "share", "also", "scatter"), rows)


def limits(trend: Trend) -> Table:
    """Tabulate the limits of quantities that were read, their bounds, and the time from which each is passed."""
    rows = []
    for each in trend.passings:
        if _is_read(trend, each):
            bound = f"{100.0 * each.bound:.4g}%" if QUANTITIES[each.limit.quantity].is_share else f"{each.bound:.4g}"
            rows.append((each.limit.text, bound if np.isfinite(each.bound) else "–", when(each, trend)))
    return Table(("limit", "bound", "when"), rows)


def _is_read(trend: Trend, each: Passing) -> bool:
    """Whether any session read the quantity of a limit."""
    return bool(np.isfinite(trend.history.values[each.limit.quantity]).any())
