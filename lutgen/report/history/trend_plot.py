"""The picture of a trend: white, contrast, colour and γ over time, with laws, intervals and limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.history import QUANTITIES
from lutgen.report.drawing.figure import BAND, BLACK, BLUE, GREY, RED, picture, tidy
from lutgen.report.history.explanation import simulated
from lutgen.report.history.trend import headline

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.history.trend import Trend

#: Headroom above and below what is drawn, as a share of its reach.
_ROOM = 0.12


#: Deviations from DICOM's contrast response that TG18 allows a primary and another display.
_PRIMARY, _SECONDARY = 0.1, 0.2


def plot_trend(trend: Trend, path: Path, *, force: bool = False) -> None:
    """Draw a trend: the same bytes on every run. Raises LutgenError where it cannot be written."""
    foot = (
        "Dots: sessions; crosses: left out, as something else changed. Line: median of all laws, "
        "weighed by evidence; dashed and pale: extrapolated; band: 90 %. Orange: limits."
    )
    title = headline(trend)
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
    """Return the right end of the axis: beyond the last session, and beyond limits within four times its time."""
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


def _draw_responses(axes: Axes, trend: Trend) -> None:
    """Draw the contrast of the greys of the first and the last session over DICOM's, in percent of it."""
    axes.set_title("contrast response of greys against DICOM's", fontsize=12, loc="left")
    told = [(here, each) for here, each in enumerate(trend.history.responses) if each is not None]
    for share, alpha in ((_SECONDARY, 0.35), (_PRIMARY, 0.8)):
        axes.axhspan(-100 * share, 100 * share, color=BAND, alpha=alpha, linewidth=0, zorder=0)
    reach = 150.0 * _SECONDARY
    for (here, each), colour in zip(dict((told[0], told[-1])).items(), (GREY, BLUE), strict=False):
        label = f"{trend.history.time[here]:.0f} {trend.history.unit}"
        axes.plot(each.drive, 100.0 * each.deviation, ".-", color=colour, linewidth=1.5, label=label)
        reach = max(reach, 110.0 * each.worst)
    axes.annotate(
        "±10 % and ±20 %", (0.02, 100 * _SECONDARY), (0, 3), textcoords="offset points", fontsize=9, color=GREY
    )
    axes.set(xlim=(0, 1), ylim=(-reach, reach), xlabel="code value", ylabel="deviation, %")
    axes.legend(loc="lower right", fontsize=10, frameon=False)
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
    shown = [*finite, finite[0] - spread, finite[0] + spread, *bounds, *(course.curve[drawn] if course.decay else ())]
    low, high = float(np.min(shown)), float(np.max(shown))
    room = _ROOM * (high - low)
    return (max(low - room, -0.0) if name.endswith("shift") else low - room), high + room
