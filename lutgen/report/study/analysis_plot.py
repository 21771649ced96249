"""The picture of a reader study: time, ease and agreement by condition, every answer where they are known."""

from __future__ import annotations

from collections import defaultdict
from math import ceil, floor, isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.report.drawing import BLACK, BLUE, GREEN, GREY, RED, picture, tidy
from lutgen.report.study.analysis import figure, p_value, signed
from lutgen.study.analysis.statistics import MEASURES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from lutgen.colorimetry import Array
    from lutgen.study.analysis import Analysis

#: The file that is drawn.
PICTURE = "study.png"

#: Measure → digits of a change, and its unit.
_UNITS = {"time": (1, " s"), "ease": (1, ""), "agreement": (1, " points")}

#: Bins over the range of answers; the answers of one bin are drawn side by side.
_BINS = 45

#: Colours of conditions, the un-aged one first.
_COLOURS = (BLUE, RED, GREEN, BLACK)

#: Characters of a condition's name that fit below its column; a longer name is broken before its hour.
_LETTERS = 12


def plot_study(analysis: Analysis, folder: str | Path, *, force: bool = False) -> Path:
    """Draw ``study.png`` into a folder; the same bytes on every run. Raises LutgenError when it cannot be written."""
    path = Path(folder) / PICTURE
    measured = [measure for measure in MEASURES if any(mean.measure == measure for mean in analysis.table2.means)]
    panels = [*measured, *(["agreement"] if analysis.table3 else [])]
    several = f"; not corrected for there being {len(analysis.holm)}" if len(analysis.holm) > 1 else ""
    foot = (
        f"{'Small dots: single answers. ' if any(each.values for each in analysis.samples) else ''}"
        "Large: mean or share, with 95 % intervals (agreement: Wilson). Below: change against the first condition and "
        f"p as in the paper: two-sided t-tests, one-tailed for agreement{several}."
    )
    second = " ".join(analysis.sources)
    with picture(path, title(analysis), second=second, foot=foot, height=7.5, force=force) as (page, low, high):
        width = 0.94 / len(panels)
        for number, panel in enumerate(panels):
            axes = page.add_axes((0.055 + number * width, low + 0.15, width - 0.055, high - low - 0.22))
            if panel == "agreement":
                _draw_agreement(axes, analysis)
            else:
                _draw_means(axes, analysis, panel)
            tidy(axes)
            axes.grid(visible=False, axis="x")
    return path


def title(analysis: Analysis) -> str:
    """State the change of each measure from the first condition to the last, and which is not significant at 5 %."""
    conditions = [row.condition for row in (analysis.table2.means or analysis.table3)]
    first, last = conditions[0], conditions[-1]
    parts = []
    for what in ("time", "ease", "agreement"):
        change, p = changes(analysis, what).get(last, (float("nan"), float("nan")))
        if isfinite(change):
            digits, unit = _UNITS[what]
            parts.append(f"{what} {signed(change, digits)}{unit}{'' if p < 0.05 else ' (not significant)'}")
    return f"{last} against {first}: {', '.join(parts)}" if parts else f"{first} alone: nothing to compare with"


def changes(analysis: Analysis, what: str) -> dict[str, tuple[float, float]]:
    """Condition → change of a measure, or of agreement in points, against the first condition, and p."""
    if what == "agreement":
        share = {row.condition: row.percent for row in analysis.table3}
        start = analysis.table3[0].condition if analysis.table3 else ""
        return {
            test.less: (share[test.less] - share[start], test.p) for test in analysis.table4 if test.greater == start
        }
    tests = [test for test in analysis.table2.tests if test.measure == what]
    return {test.second: (test.difference, test.p) for test in tests if test.first == tests[0].first}


def _draw_means(axes: Axes, analysis: Analysis, measure: str) -> None:
    from matplotlib.ticker import MaxNLocator

    means = [mean for mean in analysis.table2.means if mean.measure == measure]
    samples = {each.condition: each.values for each in analysis.samples if each.measure == measure}
    span = np.ptp([value for values in samples.values() for value in values] or [0.0])
    for place, mean in enumerate(means):
        values = np.array(samples[mean.condition])
        axes.plot(place + abreast(values, span), values, "o", color=GREY, alpha=0.45, markersize=4, zorder=1)
        _point(axes, place, mean.mean, mean.ci95, figure(mean.mean, 1), letters=_points(12.0, len(means)))
    if measure == "time":
        axes.set_ylim(bottom=0.0)
    else:
        seen = [end for mean in means for end in (*mean.ci95, *samples[mean.condition]) if isfinite(end)]
        axes.set_ylim(floor(min(seen)) - 0.2, ceil(max(seen)) + 0.2)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title(MEASURES[measure], fontsize=13, weight="bold", loc="left")
    _name(axes, [mean.condition for mean in means], analysis, measure)


def _draw_agreement(axes: Axes, analysis: Analysis) -> None:
    for place, row in enumerate(analysis.table3):
        text = f"{row.percent:.1f} %\n{row.agreed} of {row.agreed + row.disagreed}"
        _point(axes, place, row.percent, row.ci95, text, letters=_points(12.0, len(analysis.table3)))
    # Above 100 % there is room for the mark and the figures of a condition in which all answers agreed.
    axes.set_ylim(0, 107)
    axes.set_yticks(range(0, 101, 20))
    axes.set_title("agreement with the un-aged reading, %", fontsize=13, weight="bold", loc="left")
    _name(axes, [row.condition for row in analysis.table3], analysis, "agreement")


def _point(axes: Axes, place: int, value: float, ends: tuple[float, float], text: str, *, letters: float) -> None:
    colour = _COLOURS[place % len(_COLOURS)]
    axes.vlines(place, *ends, color=colour, linewidth=4, zorder=3)
    axes.plot(place, value, "o", color=colour, markeredgecolor="white", markersize=13, zorder=4)
    beside = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    axes.annotate(text, (place, value), (12, 0), textcoords="offset points", va="center", fontsize=letters,
                  weight="bold", color=BLACK, bbox=beside, zorder=5)  # fmt: skip


def _name(axes: Axes, conditions: Sequence[str], analysis: Analysis, what: str) -> None:
    digits, unit = _UNITS[what]
    against, names = changes(analysis, what), []
    long = any(len(condition) > _LETTERS for condition in conditions)
    for condition in conditions:
        change, p = against.get(condition, (float("nan"), float("nan")))
        below = f"{signed(change, digits)}{unit}\np = {p_value(p)}" if isfinite(change) else ""
        name = condition.replace("@", "\n@") if long else condition
        names.append(f"{name}\n{below}")
    axes.set_xticks(range(len(conditions)), names, fontsize=_points(11.0, len(conditions)))
    axes.set_xlim(-0.5, len(conditions) - 0.3)


def _points(most: float, conditions: int) -> float:
    """Return the font size at which neighbours, of 12 characters or a mark and 8, do not overlap."""
    return min(most, 35.0 / conditions)


def abreast(values: Array, span: float) -> Array:
    """Return the horizontal offsets that place answers of about the same value side by side, in their order, (n,)."""
    offsets = np.zeros(len(values))
    bins: dict[int, list[int]] = defaultdict(list)
    for place, value in enumerate(values):
        bins[round(_BINS * float(value) / span) if span else 0].append(place)
    for places in bins.values():
        step = min(0.045, 0.7 / len(places))
        offsets[places] = step * (np.arange(len(places)) - (len(places) - 1) / 2)
    return offsets
