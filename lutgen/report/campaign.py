"""The pages of ``lutgen sessions explain`` and ``lutgen trend``, and the picture of a trend."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.history import QUANTITIES
from lutgen.history.trend import ENOUGH, FEWEST, HORIZON, Passing, Trend, name_of
from lutgen.numerals import spaced
from lutgen.report.drawing import BAND, BLACK, BLUE, GREY, RED, beside, picture, tidy
from lutgen.report.parts import Headline, Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes

    from lutgen.history.explain import Explanations
    from lutgen.history.history import Limit
    from lutgen.readings.campaign import Campaign


def explanation_page(explanations: Explanations) -> Iterator[Part]:
    """Yield what ``lutgen sessions explain`` prints."""
    reference = explanations.campaign.entries[explanations.reference].session
    yield from simulated(explanations.campaign)
    yield f"Compared with {Path(reference.file).name}."
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
            for pair, verdict in zip(explanations.pairs, explanations.verdicts, strict=True)
        ],
    )
    for pair, verdict in zip(explanations.pairs, explanations.verdicts, strict=True):
        yield ""
        yield Headline(Path(pair.after.session.file).name)
        yield verdict.sentence
        yield from (f"• {each}" for each in verdict.evidence)
        yield from (f"To confirm or refute: {each}." for each in verdict.tests)


def simulated(campaign: Campaign) -> Iterator[str]:
    """Yield a line that names simulated sessions, if there are any."""
    notices = [
        text for entry in campaign.entries for key, text in entry.session.metadata.items() if key.upper() == "SIMULATED"
    ]
    if notices:
        yield f"Simulated, not measured: {notices[0]}."


#: Format of the values of each quantity.
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


#: Largest number of limits that the headline names.
HEADLINED = 2

#: Quantity → its name in a sentence, and the unit of its limits.
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
    yield trend_headline(trend)
    yield sessions(trend)
    for place, why in trend.why.items():
        yield f"Left out: {name_of(trend.history, place)}, which differs by {why} (lutgen sessions explain says more)."
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
    """Return a sentence on the limits that are passed already, or else on the limit that will be passed next."""
    seen = trend.history
    name = seen.campaign.display or seen.campaign.file
    passed = [each for each in trend.passings if each.status == "passed"]
    if passed:
        more = f"; limits not kept in all: {len(passed)}" if len(passed) > HEADLINED else ""
        return f"{name}: {'; '.join(_beyond(each, seen.unit) for each in passed[:HEADLINED])}{more}."
    ahead = [each for each in trend.passings if each.status == "ahead" and each.time is not None]
    if not ahead and any(each.status == "cannot-tell" for each in trend.passings):
        return f"{name}: no limit is seen passed, and when one will be cannot be told from these sessions."
    if not ahead:
        return f"{name}: no limit is passed, and none is in sight."
    soonest = min(ahead, key=lambda each: each.time or np.inf)
    limit, side = soonest.limit, "fall below" if soonest.limit.above else "rise above"
    return f"{name}: {_NAMES[limit.quantity]} will {side} its {_value(limit)} limit {when(soonest, seen.unit)}."


def _beyond(each: Passing, unit: str) -> str:
    """Return a clause on a passed limit: passed since a time between two sessions, or since the first session."""
    side = "below" if each.limit.above else "above"
    return f"{_NAMES[each.limit.quantity]} has been {side} its {_value(each.limit)} limit {when(each, unit)}"


def _value(limit: Limit) -> str:
    text = limit.text.partition(">=" if limit.above else "<=")[2]
    return text.replace("%", " %") + _UNITS.get(limit.quantity, "") * (not limit.relative)


def when(each: Passing, unit: str) -> str:
    """Return a clause on the time when a limit is passed, with its interval."""
    if each.status == "passed":
        if each.low is None:
            return "since its first measurement" if each.time else "since the first session"
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
    """Return a table of the quantities by session. A dash: not measured; a time in brackets: session left out."""
    seen = trend.history
    shown = [name for name in QUANTITIES if np.isfinite(seen.values[name]).any()]
    rows = []
    for place, time in enumerate(seen.time):
        figures = [seen.values[name][place] for name in shown]
        cells = [f"{v:{_DIGITS[name]}}" if np.isfinite(v) else "–" for name, v in zip(shown, figures, strict=True)]
        hour = spaced(float(time))
        rows.append((name_of(seen, place), hour if trend.kept[place] else f"({hour})", *cells))
    return Table(("session", seen.unit, *shown), rows)


def laws(trend: Trend) -> Table:
    """Tabulate for each quantity the likeliest law, its share of the evidence, and the laws beside it."""
    followed = [(name, course.as_good, course.decay) for name, course in trend.courses.items()]
    rows = [
        (name, decay.law.name, f"{decay.weights[decay.law.name]:.0%}", ", ".join(also) or "–", f"{decay.scatter:.1f}")
        for name, also, decay in followed
        if decay
    ]
    return Table(("quantity", "likeliest law", "share", "also", "scatter"), rows)


def limits(trend: Trend) -> Table:
    """Tabulate the limits of quantities that were read, their bounds, and the time from which each is passed."""
    rows = [
        (each.limit.text, f"{each.bound:.4g}" if np.isfinite(each.bound) else "–", when(each, trend.history.unit))
        for each in trend.passings
        if _is_read(trend, each)
    ]
    return Table(("limit", "bound", "when"), rows)


def _is_read(trend: Trend, each: Passing) -> bool:
    """Whether any session read the quantity of a limit."""
    return bool(np.isfinite(trend.history.values[each.limit.quantity]).any())


#: Deviations from DICOM's contrast response that TG18 allows a primary and another display.
_PRIMARY, _SECONDARY = 0.1, 0.2


def plot_trend(trend: Trend, path: Path, *, force: bool = False) -> None:
    """Draw a trend: the same bytes on every run. Raises LutgenError where it cannot be written."""
    foot = (
        "Dots: sessions; crosses: left out, as something else changed. Line: median of all laws, "
        "weighed by evidence; dashed and pale: extrapolated; band: 90 %. Orange: limits."
    )
    title = trend_headline(trend)
    second = " ".join(simulated(trend.history.campaign))
    drawn = [name for name in QUANTITIES if name != "ambient" and np.isfinite(trend.history.values[name]).any()]
    panels = len(drawn) + any(trend.history.responses)
    rows = -(-panels // 3)
    with picture(path, title, second=second, foot=foot, height=2.6 + 3.0 * rows, force=force) as (figure, low, high):
        grid = figure.add_gridspec(
            rows, 3, left=0.05, right=0.985, bottom=low + 0.14 / rows, top=high - 0.1 / rows, wspace=0.2, hspace=0.36
        )
        end = _until(trend)
        for place, name in enumerate(drawn):
            _draw(figure.add_subplot(grid[place // 3, place % 3]), trend, name, end)
        if panels > len(drawn):
            _draw_responses(figure.add_subplot(grid[len(drawn) // 3, len(drawn) % 3]), trend)


def _until(trend: Trend) -> float:
    """Return the right end of the axis: beyond the last session, and beyond limits up to four times its time."""
    last = float(trend.history.time[-1])
    ahead = [each.time for each in trend.passings if each.status == "ahead" and each.time is not None]
    return max([1.25 * last, *(1.15 * time for time in ahead if time <= 4.0 * last)])


def _draw(axes: Axes, trend: Trend, name: str, end: float) -> None:
    seen, course = trend.history, trend.courses[name]
    last = float(seen.time[-1])
    values = seen.values[name]
    axes.set_title(QUANTITIES[name], fontsize=12, loc="left")
    if course.decay:
        law = f"{course.decay.law.name}, {course.decay.weights[course.decay.law.name]:.0%}"
        axes.text(0.02, 0.03, law, transform=axes.transAxes, color=BLUE, fontsize=9)
    axes.axvspan(last, end, color="#f4f4f4", linewidth=0, zorder=0)
    drawn = trend.ahead <= end
    if course.decay:
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
            across = axes.get_yaxis_transform()
            beside(axes, each.limit.text, (0.01, each.bound), (0, 4), xycoords=across, color=RED, fontsize=9)
            if each.status == "ahead" and each.time is not None and each.time <= end:
                axes.plot(each.time, each.bound, "o", markersize=9, markerfacecolor="none", markeredgecolor=RED)
    axes.set(xlim=(-0.02 * end, end), ylim=(low, high), xlabel=f"{seen.unit} since the first session")
    middle, across = 0.5 * (last + end), axes.get_xaxis_transform()
    axes.text(middle, 1.0, "ahead", transform=across, ha="center", va="top", fontsize=9, color=GREY)
    tidy(axes)


def _draw_responses(axes: Axes, trend: Trend) -> None:
    """Draw the deviation in percent of the greys' contrast from DICOM's, for the first and the last session."""
    axes.set_title("contrast response of greys against DICOM's", fontsize=12, loc="left")
    read = [(place, each) for place, each in enumerate(trend.history.responses) if each is not None]
    for share, alpha in ((_SECONDARY, 0.35), (_PRIMARY, 0.8)):
        axes.axhspan(-100 * share, 100 * share, color=BAND, alpha=alpha, linewidth=0, zorder=0)
    reach = 150.0 * _SECONDARY
    for (place, each), colour in zip(dict((read[0], read[-1])).items(), (GREY, BLUE), strict=False):
        label = f"{trend.history.time[place]:.0f} {trend.history.unit}"
        axes.plot(each.drive, 100.0 * each.deviation, ".-", color=colour, linewidth=1.5, label=label)
        reach = max(reach, 110.0 * each.worst)
    beside(axes, "±10 % and ±20 %", (0.02, 100 * _SECONDARY), (0, 3), fontsize=9, color=GREY)
    axes.set(xlim=(0, 1), ylim=(-reach, reach), xlabel="code value", ylabel="deviation, %")
    axes.legend(loc="lower right", fontsize=10, frameon=False)
    tidy(axes)


def _reach(trend: Trend, name: str, drawn: np.ndarray) -> tuple[float, float]:
    """Return the ends of the axis: at least ± 3 σ, so that noise does not look like an error."""
    values, errors = trend.history.values[name], trend.history.errors[name]
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    course = trend.courses[name]
    spread = 3.0 * float(np.nanmax(errors))
    bounds = [each.bound for each in trend.passings if each.limit.quantity == name and np.isfinite(each.bound)]
    shown = [*finite, finite[0] - spread, finite[0] + spread, *bounds, *(course.curve[drawn] if course.decay else ())]
    low, high = float(np.min(shown)), float(np.max(shown))
    # Margin above and below the drawn values, as a share of their range.
    margin = 0.12 * (high - low)
    return (max(low - margin, -0.0) if name.endswith("shift") else low - margin), high + margin
