"""The pages of ``lutgen sessions explain`` and ``lutgen trend``: why sessions differ, and when a limit is passed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.history import QUANTITIES
from lutgen.history.trend import FEWEST, HORIZON, name_of
from lutgen.numerals import spaced
from lutgen.report.drawing import BAND, BLACK, BLUE, GREY, RED, picture, tidy
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes

    from lutgen.history.limits import Limit
    from lutgen.history.separate import Separation
    from lutgen.history.trend import Passing, Trend
    from lutgen.readings.campaign import Campaign
    from lutgen.report.parts import Part


def separate_page(separation: Separation) -> Iterator[Part]:
    """Yield what ``lutgen sessions explain`` prints."""
    reference = separation.campaign.entries[separation.reference].session
    yield from simulated(separation.campaign)
    yield f"Held against {Path(reference.file).name}."
    yield Table(
        ("session", "days", "verdict", "cause", "the display"),
        [
            (
                Path(pair.after.session.file).name,
                "–" if pair.days is None else f"{pair.days:.0f}",
                verdict.kind,
                (" and " if verdict.kind == "several" else " or ").join(verdict.names) or "–",
                verdict.display,
            )
            for pair, verdict in zip(separation.pairs, separation.verdicts, strict=True)
        ],
    )
    for pair, verdict in zip(separation.pairs, separation.verdicts, strict=True):
        yield ""
        yield Headline(Path(pair.after.session.file).name)
        yield verdict.sentence
        yield from (f"• {each}" for each in verdict.evidence)
        yield from (f"To tell: {each}." for each in verdict.tests)


def simulated(campaign: Campaign) -> Iterator[str]:
    """Yield a line that says that sessions are simulated, if any is."""
    notices = [
        text for entry in campaign.entries for key, text in entry.session.metadata.items() if key.upper() == "SIMULATED"
    ]
    if notices:
        yield f"Simulated, not measured: {notices[0]}."


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
    yield trend_headline(trend)
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


def trend_headline(trend: Trend) -> str:
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


#: Headroom above and below what is drawn, as a share of its reach.
_ROOM = 0.12


def plot_trend(trend: Trend, path: Path, *, force: bool = False) -> None:
    """Draw a trend: the same bytes on every run. Raises LutgenError where it cannot be written."""
    foot = (
        "Dots: sessions; crosses: left out, since something else than the display changed. Line: the law that AICc "
        "chose; dashed and pale: extrapolated; band: 90 %, from a bootstrap that chooses the law anew. Orange: limits."
    )
    title = trend_headline(trend)
    second = " ".join(simulated(trend.history.campaign))
    with picture(path, title, second=second, foot=foot, height=8.6, force=force) as (figure, low, high):
        grid = figure.add_gridspec(
            2, 3, left=0.05, right=0.985, bottom=low + 0.07, top=high - 0.05, wspace=0.2, hspace=0.36
        )
        end = _until(trend)
        for place, name in enumerate(QUANTITIES):
            _draw(figure.add_subplot(grid[place // 3, place % 3]), trend, name, end)


def _until(trend: Trend) -> float:
    """Return the right end of the axis: beyond the last session, and beyond limits within four times its time."""
    last = float(trend.history.time[-1])
    ahead = [each.time for each in trend.passings if each.status == "ahead" and each.time is not None]
    return max([1.25 * last, *(1.15 * time for time in ahead if time <= 4.0 * last)])


def _draw(axes: Axes, trend: Trend, name: str, end: float) -> None:
    seen, course = trend.history, trend.courses[name]
    last = float(seen.time[-1])
    values = seen.values[name]
    law = f": {course.fits[0].law.name}" if course.fits else ""
    axes.set_title(f"{QUANTITIES[name]}{law}", fontsize=12, loc="left")
    axes.axvspan(last, end, color="#f4f4f4", linewidth=0, zorder=0)
    drawn = trend.ahead <= end
    if course.fits:
        time = trend.ahead[drawn]
        axes.fill_between(time, course.low[drawn], course.high[drawn], color=BAND, linewidth=0, alpha=0.8)
        inside = time <= last
        axes.plot(time[inside], course.curve[drawn][inside], color=BLUE, linewidth=2.0)
        axes.plot(time[~inside], course.curve[drawn][~inside], "--", color=BLUE, linewidth=1.4, alpha=0.7)
    for chosen, mark, colour in ((trend.kept, "o", BLACK), (np.logical_not(trend.kept), "x", GREY)):
        axes.plot(seen.time[chosen], values[chosen], mark, color=colour, markersize=6)
    low, high = _reach(trend, name, drawn)
    for each in trend.passings:
        if each.limit.quantity == name and np.isfinite(each.bound):
            axes.axhline(each.bound, color=RED, linewidth=1.3)
            axes.annotate(
                each.limit.text, (0.01, each.bound), (0, 4), xycoords=axes.get_yaxis_transform(),
                textcoords="offset points", color=RED, fontsize=9,
            )  # fmt: skip
            if each.status == "ahead" and each.time is not None and each.time <= end:
                axes.plot(each.time, each.bound, "o", markersize=9, markerfacecolor="none", markeredgecolor=RED)
    axes.set(xlim=(-0.02 * end, end), ylim=(low, high), xlabel=f"{seen.unit} since the first session")
    axes.text(
        0.5 * (last + end),
        1.0,
        "ahead",
        transform=axes.get_xaxis_transform(),
        ha="center",
        va="top",
        fontsize=9,
        color=GREY,
    )
    tidy(axes)


def _reach(trend: Trend, name: str, drawn: np.ndarray) -> tuple[float, float]:
    """Return the lowest and the highest value of the axis: at least ± 3 σ, so that noise does not look like a fault."""
    values, errors = trend.history.values[name], trend.history.errors[name]
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    course = trend.courses[name]
    spread = 3.0 * float(np.nanmax(errors))
    bounds = [each.bound for each in trend.passings if each.limit.quantity == name and np.isfinite(each.bound)]
    shown = [*finite, finite[0] - spread, finite[0] + spread, *bounds, *(course.curve[drawn] if course.fits else ())]
    low, high = float(np.min(shown)), float(np.max(shown))
    margin = _ROOM * (high - low)
    return (max(low - margin, -0.0) if name.endswith("shift") else low - margin), high + margin
