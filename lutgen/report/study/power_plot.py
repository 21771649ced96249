"""The picture of power against answers per condition, for the differences that the paper saw."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.numerals import percent
from lutgen.report.drawing.figure import BLACK, BLUE, GREEN, GREY, RED, picture, tidy
from lutgen.report.study.power import ASSUMED, headline, seen_values
from lutgen.study.power import ALPHA, ANSWERS, FISHER, LEAST, MOST, TARGET, power_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lutgen.study.power import Power, Seen

#: Name of the file.
PICTURE = "study-power.png"

#: Line of each aging, and colour of each measure.
LINES = {"chroma": "--", "chroma-luma": "-"}
COLOURS = {"time": BLUE, "ease": GREEN, "agreement": RED}

#: Answers per condition at the right edge, unless the study has more.
WIDE = 160

#: Answers per condition of the paper.
_PAPER = max(ANSWERS.values())


def plot_power(power: Power, folder: str | Path, *, force: bool = False) -> Path:
    """Draw the picture into a folder; errors as :func:`lutgen.report.drawing.figure.picture`."""
    path = Path(folder) / PICTURE
    foot = (
        f"Level {ALPHA:g}: time to score and ease of reading by the two-sided t, agreement between sessions by the "
        f"one-tailed t on 0/1 values, as in the paper; its curves have teeth because counts are whole. {ASSUMED}"
    )
    second = "Power to find the differences of the paper's Tables 2 and 3, if they are true"
    with picture(path, headline(power), second=second, foot=foot, height=8.0, force=force) as (figure, low, high):
        bottom = low + 0.65 / 8.0
        axes = figure.add_axes((0.06, bottom, 0.68, high - bottom - 0.15 / 8.0))
        _draw(axes, power)
    return path


def _draw(axes: Axes, power: Power) -> None:
    widest = max(WIDE, round(1.2 * power.answers))
    answers = np.unique(np.linspace(LEAST, widest, WIDE).round().astype(int))
    ends = []
    for each in drawn(power):
        curve = [power_of(each.test, each.values, each.sd, (int(n), int(n))) for n in answers]
        colour, line = COLOURS[each.measure], LINES[each.between[1]]
        axes.plot(answers, curve, line, color=colour, linewidth=2.2)
        ends.append((curve[-1], each))
        if each.needed is not None:
            axes.plot(each.needed, TARGET, "o", markersize=8, markerfacecolor="white", markeredgecolor=colour,
                      markeredgewidth=2.0, zorder=5)  # fmt: skip
            axes.vlines(each.needed, 0.0, TARGET, color=colour, linewidth=0.8, linestyle=":")
    axes.axhline(TARGET, color=BLACK, linewidth=1.2)
    axes.text(
        0.995 * widest, TARGET - 0.012, f"{percent(TARGET)} power", fontsize=11, weight="bold", ha="right", va="top"
    )
    marks = {_PAPER: "the paper"} | ({power.answers: "this study"} if power.answers != _PAPER else {})
    for count, name in marks.items():
        axes.axvline(count, color=GREY, linewidth=1.6)
        axes.text(count + 0.005 * widest, 0.015, f"{name}: {count}", fontsize=10, color=GREY, rotation=90, va="bottom")
    _label(axes, ends)
    axes.set(xlim=(0, widest), ylim=(0, 1.02), yticks=np.linspace(0, 1, 6))
    axes.yaxis.set_major_formatter(lambda value, _place: f"{100 * value:.0f} %")
    axes.set_xlabel("answers per condition (images × readers)", fontsize=12)
    axes.set_ylabel("power", fontsize=12)
    tidy(axes)


def drawn(power: Power) -> list[Seen]:
    """Return the differences that are drawn: from un-aged to each aging, by the tests that the paper used."""
    return [each for each in power.seen if each.between[0] == "none" and each.test != FISHER]


def _label(axes: Axes, ends: list[tuple[float, Seen]]) -> None:
    """Name the curves on the right, the highest first: line, difference in the paper, answers for the target power."""
    for row, (_, each) in enumerate(sorted(ends, key=lambda end: (end[1].needed or MOST, -end[0]))):
        height, colour = 0.97 - 0.1 * row, COLOURS[each.measure]
        axes.plot([1.015, 1.05], [height, height], LINES[each.between[1]], color=colour, linewidth=2.2, clip_on=False,
                  transform=axes.transAxes)  # fmt: skip
        takes = f"over {MOST}" if each.needed is None else str(each.needed)
        label = f"{each.measure}, {each.between[1]}: {seen_values(each)}\n{percent(TARGET)} takes {takes}"
        axes.text(1.06, height, label, fontsize=11, color=colour, va="center", transform=axes.transAxes)
