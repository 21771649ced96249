"""The picture of ``lutgen trend``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.history import QUANTITIES
from lutgen.report.campaign import simulated, trend_headline
from lutgen.report.drawing import BAND, BLACK, BLUE, DPI, GREY, RED, beside, picture, tidy

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.colorimetry import Array
    from lutgen.history.decay import Decay
    from lutgen.history.transfer import ContrastResponse
    from lutgen.history.trend import Trend

#: Deviations from DICOM's contrast response that TG18 allows a primary and another display.
_PRIMARY, _SECONDARY = 0.1, 0.2


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
    text = f"{decay.law}: {decay.weights[decay.law]:.0%}"
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
    for share, alpha in ((_SECONDARY, 0.35), (_PRIMARY, 0.8)):
        label = f"±{100 * share:.0f} %"
        axes.axhspan(-100 * share, 100 * share, color=BAND, alpha=alpha, linewidth=0, zorder=0, label=label)
    reach = 150.0 * _SECONDARY
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
