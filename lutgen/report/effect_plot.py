"""The picture of ``lutgen effects NAME --plot``: the change by an effect of greys, ramps and single colours.

Each plot has one function, which draws into given axes.
"""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.display.signature import Signature
from lutgen.effects.probe import reacts_to
from lutgen.effects.scene import LIFE_H
from lutgen.numerals import spaced
from lutgen.readings.conditions import COLUMNS, of_one_picture
from lutgen.readings.conditions.position import PLACE
from lutgen.report.aging_plot import PAGE, TIP_COLOURS
from lutgen.report.drawing import new_figure

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.colorimetry import Array
    from lutgen.effects import Effect

#: Hours of the curves and their colours: later hours are darker.
HOURS, SHADES = (0.0, LIFE_H / 2, LIFE_H), ("#9ecae1", "#4a90c4", "#08306b")

#: Hours that are marked on an axis.
HOURS_MARKED = np.linspace(0.0, LIFE_H, 7)

#: Steps of a ramp: far more than 256, so that quantisation to 8 bits appears as a staircase.
STEPS = 1201

#: Least number of sign changes of the slope of a staircase, and the part of the ramp that is drawn of a staircase.
STAIRCASE, CLOSER = 20, (0.1, 0.2)

#: Least span of an axis, in ΔL*, Δa*, Δb* to either side and in ΔE2000: smaller differences are invisible.
LEAST_LAB, LEAST_DELTA_E = 0.5, 1.0

#: Most characters in a line below the title.
LINE = 190

#: Bars: name → code value, and the colour of the bar.
PATCHES = {
    "white": ((1, 1, 1), "#dddddd"),
    "grey\n½": ((0.5, 0.5, 0.5), "#8a8a8a"),
    "grey\n0.1": ((0.1, 0.1, 0.1), "#444444"),
    "red": ((1, 0, 0), "#c8322d"),
    "green": ((0, 1, 0), "#2a8c3c"),
    "blue": ((0, 0, 1), "#2f55c8"),
    "cyan": ((0, 1, 1), "#3fb8c0"),
    "mag.": ((1, 0, 1), "#b848b0"),
    "yel.": ((1, 1, 0), "#d8c23a"),
    "tissue": ((0.85, 0.6, 0.75), "#d999bf"),
}

#: Greys of the plot over hours or a condition: code value and colour.
FOLLOWED = {1.0: "#111111", 0.5: "#2b8a8a", 0.1: "#c07a20"}


def plot_effect(effect: Effect, path: str | Path, *, force: bool = False) -> None:
    """Write the page of an effect at its typical size as a PNG; errors as :func:`new_figure`."""
    small: dict[str, Any] = {"fontsize": 10, "color": "#444444"}
    with new_figure(path, PAGE, force=force) as figure:
        signature = Signature.of(effect)
        grid = figure.add_gridspec(2, 3, left=0.05, right=0.975, top=0.815, bottom=0.125, wspace=0.16, hspace=0.38)
        grey_ramp([figure.add_subplot(grid[0, column]) for column in range(3)], signature)
        channel_ramps(figure.add_subplot(grid[1, 0]), signature)
        patches(figure.add_subplot(grid[1, 1]), signature)
        followed(figure.add_subplot(grid[1, 2]), signature)
        title = textwrap.shorten(f"{effect.name}: {effect.summary}".replace("``", ""), 122, placeholder=" …")
        figure.text(0.05, 0.957, title, fontsize=14, weight="bold", va="center")
        figure.text(0.05, 0.917, signature.sentence(), fontsize=12, va="center")
        values = textwrap.fill(_values(signature), LINE, max_lines=2, placeholder=" …")
        figure.text(0.05, 0.897, values, va="top", **small)
        legend = (
            "Thick: the whole effect, against the un-aged default display without the effect. Thin with dots, and "
            "framed bars: the effect against the paper's model, whose white and primaries are measured again at that "
            "hour."
        )
        figure.text(0.05, 0.02, textwrap.fill(legend, LINE), va="bottom", **small)


def _values(signature: Signature) -> str:
    effect = signature.effect
    typical = effect.typical()
    moved = [name for name, value in typical.items() if value not in {0.0, effect.neutral.get(name)}]
    units = {name: "" if effect.parameters[name].unit == "1" else f" {effect.parameters[name].unit}" for name in moved}
    values = ", ".join(f"{name} = {typical[name]:g}{units[name]}" for name in moved)
    conditions = ", ".join(f"{name} = {value:g}" for name, value in signature.conditions.items())
    return f"Drawn with {values or 'no parameters'}" + (
        f"; the page but its last plot at {conditions}." if conditions else "."
    )


def grey_ramp(axes: Sequence[Axes], signature: Signature) -> None:
    """Draw ΔL*, Δa* and Δb* along the grey ramp at the first, middle and last hour."""
    level, label = _levels(signature)
    code = np.repeat(level[:, np.newaxis], 3, axis=1)
    seen = {spaced(hours) + " h": signature.seen(code, hours) for hours in HOURS}
    first, *later = seen.values()
    if all(np.allclose(each.aged, first.aged, rtol=0, atol=1e-6) for each in later):
        seen = {"at every hour": first}
    for index, (name, each) in enumerate(zip(("ΔL*", "Δa*", "Δb*"), axes, strict=True)):
        pairs = [((at.aged - at.new)[:, index], (at.aged - at.model)[:, index]) for at in seen.values()]
        for when, shade, pair in zip(seen, SHADES[-len(seen) :], pairs, strict=True):
            _pair(each, level, pair, shade, when)
        if np.abs(pairs).max() < LEAST_LAB / 100:
            each.text(0.5, 0.55, "none", transform=each.transAxes, ha="center", color="#777777")
        each.axhline(0.0, color="#bbbbbb", linewidth=0.8, zorder=0)
        low, high = each.get_ylim()
        each.set_ylim(min(low, -LEAST_LAB), max(high, LEAST_LAB))
        each.set(title=f"{name} along the grey ramp", xlabel=label)
        _frame(each)
    axes[0].legend(loc="best", frameon=False, fontsize=9)


def _levels(signature: Signature) -> tuple[Array, str]:
    """Return the code values of the ramps and the label of their axis; for a staircase only a part of the ramp."""
    level = np.linspace(0.0, 1.0, STEPS)
    difference = signature.seen(np.repeat(level[:, np.newaxis], 3, axis=1), LIFE_H)
    slope = np.diff((difference.aged - difference.new)[:, 0])
    if np.count_nonzero(slope[1:] * slope[:-1] < -1e-12) < STAIRCASE:
        return level, "code value"
    return np.linspace(*CLOSER, STEPS), f"code value, {CLOSER[0]:g} to {CLOSER[1]:g} only: there are teeth"


def channel_ramps(axes: Axes, signature: Signature) -> None:
    """Draw ΔE2000 along the ramps of red, green and blue at the last hour."""
    level, label = _levels(signature)
    for channel, (name, colour) in enumerate(zip(("red", "green", "blue"), TIP_COLOURS[1:], strict=True)):
        difference = signature.seen(level[:, np.newaxis] * np.eye(3)[channel], LIFE_H)
        _pair(axes, level, (difference.whole, difference.rest), colour, name)
    axes.set(title=f"ΔE2000 along the primaries' ramps, {spaced(LIFE_H)} h", xlabel=label)
    _from_zero(axes)
    axes.legend(loc="best", frameon=False, fontsize=9)


def patches(axes: Axes, signature: Signature) -> None:
    """Draw ΔE2000 of single colours at the last hour."""
    code = np.array([code for code, _ in PATCHES.values()], dtype=np.float64)
    difference, place = signature.seen(code, LIFE_H), np.arange(len(code))
    axes.bar(place, difference.whole, 0.8, color=[colour for _, colour in PATCHES.values()])
    axes.bar(place, difference.rest, 0.35, color="white", edgecolor="black", linewidth=1.3)
    axes.set_xticks(place, list(PATCHES), fontsize=9)
    axes.set(title=f"ΔE2000 of single colours, {spaced(LIFE_H)} h")
    _from_zero(axes)


def followed(axes: Axes, signature: Signature) -> None:
    """Draw ΔE2000 of three greys against the effect's condition at the last hour, or against hours."""
    label, title, place, hours, conditions = _axis(signature)
    for level, colour in FOLLOWED.items():
        difference = signature.seen(np.full((1, 3), level), hours, conditions)
        _pair(axes, place, (difference.whole, difference.rest), colour, f"grey of code {level:g}")
    axes.set(title=title, xlabel=label)
    if place[-1] == LIFE_H:
        axes.set_xticks(HOURS_MARKED, [spaced(hours) for hours in HOURS_MARKED])
    _from_zero(axes)
    axes.legend(loc="best", frameon=False, fontsize=9)


def _axis(signature: Signature) -> tuple[str, str, Array, Array, dict[str, Array]]:
    """Return the horizontal axis of the last plot: label, title, places, hours, and conditions of shape (n, 1)."""
    reads = signature.effect.needs or reacts_to(signature.effect)
    share = np.linspace(0.0, 1.0, 241)
    if not reads:
        return "operating hours", "ΔE2000 of greys over the hours", share * LIFE_H, share * LIFE_H, {}
    old, at = np.array([LIFE_H]), f"{spaced(LIFE_H)} h"
    if {*PLACE} & {*reads}:
        places = dict.fromkeys(PLACE, (0.5 + 0.5 * share)[:, np.newaxis])
        return "way from the centre (0) to a corner (1)", f"ΔE2000 of greys over the screen, {at}", share, old, places
    column = COLUMNS[reads[0]]
    low, high = column.axis
    place = low + share * (high - low)
    around = {name: np.full((1, 1), COLUMNS[name].shown) for name in reads if len(of_one_picture(name)) > 1}
    columns = around | {reads[0]: place[:, np.newaxis]}
    return column.words, f"ΔE2000 of greys over {reads[0]}, {at}", place, old, columns


def _pair(axes: Axes, place: Array, values: tuple[Array, Array], colour: str, label: str) -> None:
    """Draw the whole effect as a thick line, and its residual as a thin line with dots."""
    whole, rest = values
    axes.plot(place, whole, color=colour, linewidth=3.0, alpha=0.85, label=label, solid_capstyle="butt")
    axes.plot(place, rest, color=colour, linewidth=1.2, marker="o", markersize=4, markevery=len(place) // 12)


def _from_zero(axes: Axes) -> None:
    axes.set_ylim(0.0, max(LEAST_DELTA_E, 1.05 * axes.get_ylim()[1]))
    _frame(axes)


def _frame(axes: Axes) -> None:
    axes.grid(color="#eeeeee")
    axes.set_axisbelow(True)
    axes.margins(x=0.0)
