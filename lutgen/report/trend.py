"""The page and the picture of ``lutgen trend``."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import listed
from lutgen.history.history import QUANTITIES
from lutgen.history.trend import ENOUGH, FEWEST, HORIZON, STATUSES, Passing, Trend, name_of
from lutgen.numerals import counted, in_percent, spaced
from lutgen.report.drawing import BAND, BLACK, BLUE, DPI, GREY, RED, beside, picture, tidy
from lutgen.report.inspection import simulated
from lutgen.report.parts import Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.history.decay import Decay
    from lutgen.history.history import Limit
    from lutgen.history.transfer import ContrastResponse
    from lutgen.readings.campaign import Campaign


def other_displays(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence on the names of displays in the files, if they differ."""
    times = Counter(entry.session.display for entry in campaign.entries)
    named = [f"{name} ({counted(number, 'session')})" for name, number in times.items() if name]
    if len(named) > 1:
        yield f"The files name different displays: {'; '.join(named)}. A trend follows one display."


#: Largest number of limits that the headline names.
HEADLINED = 2

#: From this scatter of the sessions, as a multiple of a reading's repeatability, their course is no smooth curve.
UNSTEADY = 2.0


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
        yield f"{counted(kept, 'session')}: a time cannot be told from fewer than {FEWEST}."
    elif kept < ENOUGH and any(each.status == "ahead" for each in trend.passings):
        yield f"Fewer than {ENOUGH} sessions ({kept}): the intervals depend strongly on the assumed laws of decay."
    yield limits(trend)
    yield from (f"{each.limit.text}: {source(each.limit)}." for each in trend.passings if _is_read(trend, each))
    # Two published sets may contain the same limit.
    if unread := dict.fromkeys(each.limit.text for each in trend.passings if not _is_read(trend, each)):
        needs = "they need greys and black, several places, or --ambient"
        yield f"No session has the readings for these limits: {', '.join(unread)} ({needs})."


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
        more = f"; passed in all: {counted(len(passed), 'limit')}" if any(each not in named for each in passed) else ""
        return f"{name} {'; '.join(_clause(each, trend) for each in named)}{more}."
    among = " in the sessions used" if trend.why else ""
    if any(each.status == "cannot-tell" for each in trend.passings):
        return f"{name} no limit is known to be passed{among}, and these sessions do not show when one will be."
    return f"{name} no limit is passed{among}, and none is in sight."


def _display(trend: Trend) -> str:
    """Return the display's name in the campaign; if the files have this name, the names in those of used sessions."""
    seen, campaign = trend.history, trend.history.campaign
    names = [campaign.entries[place].session.display for place in seen.places]
    used = dict.fromkeys(name for name, kept in zip(names, trend.kept, strict=True) if name and kept)
    return (listed(used) if campaign.display in names else "") or campaign.display or campaign.file


def _headlined(trend: Trend) -> list[Passing]:
    """Return the limits of the headline.

    Those that aging passes come first, soonest first; then those whose course contradicts the laws, those passed from
    the start, and those that are kept again.
    """
    of = {status: [each for each in trend.passings if each.status == status] for status in STATUSES}
    aged = sorted((each for each in of["passed"] if each.low is not None), key=lambda each: each.time or 0.0)
    next_one = sorted(of["ahead"], key=lambda each: each.time or 0.0)[:1]
    from_the_start = [each for each in of["passed"] if each.low is None]
    return [*aged, *next_one, *of["contradicted"], *from_the_start, *of["returned"]][:HEADLINED]


def _clause(each: Passing, trend: Trend) -> str:
    """Return a clause on a limit that is passed, was passed, will be passed, or of which no time can be told."""
    what, value, time = QUANTITIES[each.limit.quantity].noun, _value(each.limit), when(each, trend)
    side = "below" if each.limit.above else "above"
    if each.status == "ahead":
        will = "will" if each.high is not None else "may"
        return f"{what} {will} {'fall' if each.limit.above else 'rise'} {side} its {value} limit {time}"
    if each.status == "returned":
        return f"{what} was {side} its {value} limit{_last_beyond(each, trend)} and is {_kept_by_last(each, trend)}"
    if each.status == "contradicted":
        return f"{what} is {_kept_by_last(each, trend, f'its {value} limit')}, {_no_time(each, trend)}"
    return f"{what} {'was' if _used(each, trend).size == 1 else 'has been'} {side} its {value} limit {time}"


def _used(each: Passing, trend: Trend) -> NDArray[np.intp]:
    """Return the indices of the used sessions that read the quantity of a limit, (n,)."""
    return np.flatnonzero(trend.kept & np.isfinite(trend.history.values[each.limit.quantity]))


def _value(limit: Limit) -> str:
    text = limit.text.partition(">=" if limit.above else "<=")[2]
    return text.replace("%", " %") + QUANTITIES[limit.quantity].unit * (not limit.relative)


def _kept_by_last(each: Passing, trend: Trend, bound: str = "it") -> str:
    """Return a clause on a limit that the last used session keeps, with the figure of this session."""
    seen, last, quantity = trend.history, _used(each, trend)[-1], QUANTITIES[each.limit.quantity]
    figure = float(seen.values[each.limit.quantity][last])
    shown = f"{100 * figure:.0f} %" if quantity.is_share else f"{figure:.0f}" if figure >= 100 else f"{figure:.3g}"
    now = "now" if last == seen.time.size - 1 else f"at {_at(trend, float(seen.time[last]))}"
    return f"{'above' if each.limit.above else 'below'} {bound} {now}, {shown}{quantity.unit}"


def _last_beyond(each: Passing, trend: Trend) -> str:
    """Return a clause on the last session that was beyond a limit which the last session keeps."""
    then = f"at {_at(trend, each.time)}"
    return f" {then}" if each.low == each.time else f", last {then},"


def _no_time(each: Passing, trend: Trend) -> str:
    """Return a clause on why no time is told, though the laws have passed a limit that all used sessions keep."""
    name, last = each.limit.quantity, _used(each, trend)[-1]
    decay, error = trend.courses[name].decay, trend.history.errors[name][last]
    away = abs(trend.history.values[name][last] - each.bound)
    if decay and decay.scatter < UNSTEADY and away <= 2.0 * decay.scatter * error:
        return "too near to it to tell a time"
    return "but follows no smooth curve, so no time is told"


def _at(trend: Trend, time: float | None) -> str:
    return f"{trend.history.unit.removesuffix('s')} {spaced(time or 0.0)}"


def when(each: Passing, trend: Trend) -> str:
    """Return a clause on the time when a limit is passed, with its interval."""
    unit = trend.history.unit
    if each.status == "passed":
        return _since(each, trend)
    if each.status == "returned":
        then = _last_beyond(each, trend).removesuffix(",")
        return f"{'below' if each.limit.above else 'above'}{then}, {_kept_by_last(each, trend)}"
    if each.status == "contradicted":
        return f"{_kept_by_last(each, trend)}, {_no_time(each, trend)}"
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
        cells = [
            f"{value:{QUANTITIES[name].digits}}".replace("%", " %") if np.isfinite(value) else "–"
            for name, value in figures
        ]
        hour = spaced(float(time))
        rows.append((name_of(seen, place), hour if trend.kept[place] else f"({hour})", *cells))
    return Table(("session", seen.unit, *shown), rows)


def laws(trend: Trend) -> Table:
    """Tabulate for each quantity the likeliest law, its share of the evidence, and the laws beside it."""
    followed = [(name, course.as_good, course.decay) for name, course in trend.courses.items()]
    rows = [
        (name, decay.law, in_percent(decay.weights[decay.law]), "; ".join(also) or "–", f"{decay.scatter:.1f}")
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


def plot_trend(trend: Trend, path: Path, *, force: bool = False) -> None:
    """Draw a trend: the same bytes on every run. Raises LutgenError where it cannot be written."""
    lines = (
        "Line: median of all laws, weighed by evidence; dashed and pale: extrapolated; band: 90 %. "
        if any(each.decay for each in trend.courses.values())
        else ""
    )
    foot = f"Dots: sessions; crosses: left out, as something else changed. {lines}Orange: limits."
    title, second = trend_headline(trend), " ".join(simulated(trend.history.campaign))
    drawn = [name for name in QUANTITIES if name != "ambient" and np.isfinite(trend.history.values[name]).any()]
    panels = len(drawn) + bool(_responses(trend))
    rows = -(-panels // 3)
    with picture(path, title, second=second, foot=foot, height=2.6 + 3.0 * rows, force=force) as (figure, low, high):
        grid = figure.add_gridspec(
            rows, 3, left=0.05, right=0.985, bottom=low + 0.14 / rows, top=high - 0.1 / rows, wspace=0.2, hspace=0.36
        )
        for place, name in enumerate(drawn):
            _draw(figure.add_subplot(grid[place // 3, place % 3]), trend, name, _until(trend))
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
    axes.set_title(QUANTITIES[name].description, fontsize=12, loc="left")
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
    axes.set(xlim=(-0.02 * end, end), ylim=(low, high), xlabel=f"{seen.unit} since the first session")
    if QUANTITIES[name].is_share:
        axes.yaxis.set_major_formatter(lambda value, _: f"{100.0 * value:.3g} %")
    own = [each for each in trend.passings if each.limit.quantity == name and np.isfinite(each.bound)]
    curve = [np.column_stack([trend.ahead, course.curve])[drawn]] if course.decay else []
    lines = {each.bound: np.column_stack([trend.ahead, np.full(trend.ahead.size, each.bound)])[drawn] for each in own}
    read = [np.column_stack([seen.time, values]), *curve]
    law = [_name_law(axes, course.decay, np.vstack([*read, *lines.values()]))] if course.decay else []
    for each in own:
        others = [line for bound, line in lines.items() if bound != each.bound]
        axes.axhline(each.bound, color=RED, linewidth=1.3)
        _name_limit(axes, each.limit.text, each.bound, np.vstack([*read, *others, *law]))
        if each.status == "ahead" and each.time is not None and each.time <= end:
            axes.plot(each.time, each.bound, "o", markersize=9, markerfacecolor="none", markeredgecolor=RED)
    middle, across = 0.5 * (last + end), axes.get_xaxis_transform()
    axes.text(middle, 1.0, "ahead", transform=across, ha="center", va="top", fontsize=9, color=GREY)
    tidy(axes)


#: Width of a letter and height of a line of a label, with the gap to its line, in points.
_LETTER, _LINE = 5.6, 15.0

#: Least distance of a label from what is drawn, as a share of the axes.
_MARGIN = 0.02


def _size(axes: Axes, text: str) -> tuple[float, float]:
    """Return the width and height of a label as shares of the axes."""
    box = axes.get_window_extent()
    return _LETTER * len(text) * DPI / 72 / box.width, _LINE * DPI / 72 / box.height


def _covered(axes: Axes, corner: tuple[float, float], size: tuple[float, float], drawn: Array) -> int:
    """Return how many points, (n, 2), lie within a margin of a label whose lower left corner is a place in the axes."""
    places = axes.transLimits.transform(drawn[np.isfinite(drawn).all(axis=1)])
    low, high = np.array(corner) - _MARGIN, np.add(corner, size) + _MARGIN
    return int(((places >= low) & (places <= high)).all(axis=1).sum())


def _name_law(axes: Axes, decay: Decay, drawn: Array) -> Array:
    """Write the likeliest law on the left, where it covers the fewest points, (n, 2); return points of it, (m, 2)."""
    text = f"{decay.law}: {in_percent(decay.weights[decay.law])}"
    size = _size(axes, text)
    low = min((0.03, 0.91, 0.80, 0.14, 0.5), key=lambda low: _covered(axes, (0.02, low), size, drawn))
    axes.text(0.02, low, text, transform=axes.transAxes, color=BLUE, fontsize=9)
    points = [(0.02 + share * size[0], height) for share in np.linspace(0, 1, 25) for height in (low, low + 0.05)]
    return np.asarray(axes.transLimits.inverted().transform(np.array(points)))


def _name_limit(axes: Axes, text: str, bound: float, drawn: Array) -> None:
    """Write a limit above or below its line, where it covers the fewest points, (n, 2)."""
    wide, tall = _size(axes, text)
    line = float(axes.transLimits.transform((0.0, bound))[1])

    def covered(place: tuple[float, bool]) -> tuple[bool, int]:
        low = line - tall * (not place[1])
        return not 0.0 <= low <= 1.0 - tall, _covered(axes, (0.01 + place[0] * (0.98 - wide), low), (wide, tall), drawn)

    share, above = min(((share, above) for share in (0.0, 1.0, 0.5) for above in (True, False)), key=covered)
    side = {0.0: "left", 0.5: "center", 1.0: "right"}[share]
    look = {"color": RED, "fontsize": 9, "ha": side, "va": "bottom" if above else "top"}
    place = (0.01 + 0.98 * share, bound)
    beside(axes, text, place, (0, 3 if above else -3), xycoords=axes.get_yaxis_transform(), **look)


def _responses(trend: Trend) -> list[tuple[int, ContrastResponse]]:
    """Return index and contrast response of the first, and of a later last, used session that read enough greys."""
    read = [(place, each) for place, each in enumerate(trend.history.responses) if each and trend.kept[place]]
    later = [last for last in read[-1:] if trend.history.time[last[0]] > trend.history.time[read[0][0]]]
    return [*read[:1], *later]


def _draw_responses(axes: Axes, trend: Trend) -> None:
    """Draw the deviation in percent of the greys' contrast from DICOM's, for the first and the last used session."""
    axes.set_title("contrast response of greys against DICOM's", fontsize=12, loc="left")
    # TG18 allows a primary display 10 %, and another display 20 %.
    for share, alpha in ((20, 0.35), (10, 0.8)):
        axes.axhspan(-share, share, color=BAND, alpha=alpha, linewidth=0, zorder=0, label=f"±{share} %")
    reach = 30.0
    for (place, each), colour in zip(_responses(trend), (GREY, BLUE), strict=False):
        label = f"{trend.history.time[place]:.0f} {trend.history.unit}"
        axes.plot(each.drive, 100.0 * each.deviation, ".-", color=colour, linewidth=1.5, label=label)
        reach = max(reach, 110.0 * each.worst)
    axes.set(xlim=(0, 1), ylim=(-reach, reach), xlabel="code value", ylabel="deviation, %")
    axes.legend(loc="best", ncols=2, fontsize=10, frameon=False)
    tidy(axes)


def _reach(trend: Trend, name: str, drawn: np.ndarray) -> tuple[float, float]:
    """Return the ends of the axis, never below 0: at least ± 3 σ, so that noise does not look like an error."""
    values, errors = trend.history.values[name], trend.history.errors[name]
    finite, course = values[np.isfinite(values)], trend.courses[name]
    spread = 3.0 * float(np.nanmax(errors))
    bounds = [each.bound for each in trend.passings if each.limit.quantity == name and np.isfinite(each.bound)]
    shown = [*finite, finite[0] - spread, finite[0] + spread, *bounds, *(course.curve[drawn] if course.decay else ())]
    low, high = float(np.min(shown)), float(np.max(shown))
    # Margin above and below the drawn values, as a share of their range.
    margin = 0.12 * (high - low)
    return max(low - margin, 0.0), high + margin
