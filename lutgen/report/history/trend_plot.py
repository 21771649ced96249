"""The picture of a trend: white, contrast, colour and γ over time, with laws, intervals and limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.report.drawing.figure import BAND, BLACK, BLUE, GREY, RED, picture, tidy
from lutgen.report.history.explanation import simulated
from lutgen.report.history.trend import headline
from lutgen.sessions.history import QUANTITIES

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.sessions.trend import Trend

#: Headroom above and below what is drawn, as a share of its reach.
_ROOM = 0.12


def plot_trend(found: Trend, path: Path, *, force: bool = False) -> None:
    """Draw a trend: the same bytes on every run. Raises LutgenError where it cannot be written."""
    foot = (
        "Dots: sessions; crosses: left out, since something else than the display changed. Line: the law that AICc "
        "chose; dashed and pale: extrapolated; band: 90 %, from a bootstrap that chooses the law anew. Orange: limits."
    )
    title = headline(found)
    second = " ".join(simulated(found.history.campaign))
    with picture(path, title, second=second, foot=foot, height=8.6, force=force) as (figure, low, high):
        grid = figure.add_gridspec(
            2, 3, left=0.05, right=0.985, bottom=low + 0.07, top=high - 0.05, wspace=0.2, hspace=0.36
        )
        end = _until(found)
        for place, name in enumerate(QUANTITIES):
            _draw(figure.add_subplot(grid[place // 3, place % 3]), found, name, end)


def _until(found: Trend) -> float:
    """Time up to which is drawn: a little behind the last session, and the last limit that comes within twice that."""
    last = float(found.history.time[-1])
    ahead = [each.time for each in found.passings if each.status == "ahead" and each.time is not None]
    return max([1.25 * last, *(1.15 * time for time in ahead if time <= 4.0 * last)])


def _draw(axes: Axes, found: Trend, name: str, end: float) -> None:
    seen, course = found.history, found.courses[name]
    last = float(seen.time[-1])
    values = seen.values[name]
    law = f": {course.fits[0].law.name}" if course.fits else ""
    axes.set_title(f"{QUANTITIES[name]}{law}", fontsize=12, loc="left")
    axes.axvspan(last, end, color="#f4f4f4", linewidth=0, zorder=0)
    drawn = found.ahead <= end
    if course.fits:
        time = found.ahead[drawn]
        axes.fill_between(time, course.low[drawn], course.high[drawn], color=BAND, linewidth=0, alpha=0.8)
        inside = time <= last
        axes.plot(time[inside], course.curve[drawn][inside], color=BLUE, linewidth=2.0)
        axes.plot(time[~inside], course.curve[drawn][~inside], "--", color=BLUE, linewidth=1.4, alpha=0.7)
    for chosen, mark, colour in ((found.kept, "o", BLACK), (np.logical_not(found.kept), "x", GREY)):
        axes.plot(seen.time[chosen], values[chosen], mark, color=colour, markersize=6)
    low, high = _reach(found, name, drawn)
    for each in found.passings:
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


def _reach(found: Trend, name: str, drawn: np.ndarray) -> tuple[float, float]:
    """Lowest and highest of what is shown; at least ± 3 σ, so that noise does not look like a fault."""
    values, errors = found.history.values[name], found.history.errors[name]
    told = values[np.isfinite(values)]
    if not told.size:
        return 0.0, 1.0
    course = found.courses[name]
    spread = 3.0 * float(np.nanmax(errors))
    bounds = [each.bound for each in found.passings if each.limit.quantity == name and np.isfinite(each.bound)]
    shown = [*told, told[0] - spread, told[0] + spread, *bounds, *(course.curve[drawn] if course.fits else ())]
    low, high = float(np.min(shown)), float(np.max(shown))
    room = _ROOM * (high - low)
    return (max(low - room, -0.0) if name.endswith("shift") else low - room), high + room
