"""The page and the picture of ``lutgen compare``: the error of a model relative to the noise, overall and by slices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.compare.comparison import CLEAR, Comparison
from lutgen.criticism.compare.direction import CALLED
from lutgen.criticism.compare.panels import ResidualPanel, panels
from lutgen.criticism.compare.slices import OF_EVERY_READING, over_noise, standing_out
from lutgen.criticism.search.influence import exchanged_rows
from lutgen.criticism.verdict import black
from lutgen.criticism.verdict.remarks import lines_of_pairs
from lutgen.errors import listed
from lutgen.numerals import spaced, times
from lutgen.readings.conditions import CONDITIONS
from lutgen.report.drawing import BAND, BLACK, BLUE, GREY, RED, hour_axis, picture, plain_log, tidy
from lutgen.report.parts import Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lutgen.colorimetry import Array
    from lutgen.criticism.compare.slices import Slice
    from lutgen.criticism.fit.problem import Problem

#: Rows of the tables of slices with large errors, and of single readings.
SLICES, READINGS = 12, 5

#: Name of each dimension of slices in a table.
NAMES = {"hour": "hour", "level": "code value", "family": "patch"} | {
    each.key: each.heading for each in CONDITIONS if each.heading
}


def compare_page(comparison: Comparison, again: str = "") -> Iterator[Part]:
    """Yield what ``lutgen compare`` prints; ``again`` holds the arguments for the following ``lutgen diagnose``."""
    yield comparison.sentence()
    if black.is_beyond_zero(comparison.problem):
        yield black.remark(comparison.problem)
    if pairs := lines_of_pairs(comparison.problem, exchanged_rows(comparison.problem)):
        yield f"Readings were exchanged: {listed(pairs)}. The error includes them; diagnose and refine leave them out."
    yield from (each.sentence() for each in comparison.drifts)
    yield data_line(comparison.problem)
    yield from fresh_lines(comparison)
    if not comparison.where:
        return
    yield ""
    yield error_table(comparison)
    yield ""
    outstanding = standing_out(comparison.where)
    if outstanding:
        yield f"Where it stands out, by size of the error and number of readings ({CLEAR:g} × noise is clear):"
        yield _slice_table(outstanding[:SLICES])
    else:
        yield "No hour, colour or condition stands out from the others."
    yield ""
    yield "The worst readings:"
    yield _worst_table(comparison)
    if again and outstanding:
        yield ""
        yield f"Which effect is missing:  lutgen diagnose {from_own_model(comparison, again) or again}"


def fresh_lines(comparison: Comparison) -> Iterator[str]:
    """Yield lines on the prediction errors for the first session: of sRGB's curves, and of the display's own model."""
    first, native = comparison.first_session, comparison.problem.native
    if first:
        hint = " Start from its own: --baseline native." if first.is_another and not native else ""
        yield first.sentence() + hint
        if first.own is not None:
            yield f"Its own model: mean ΔE2000 {first.own:.2f} on mixtures held out."
            yield from (f"  {rung}" for rung in first.rungs)
    if native:
        # The lines of the own model's rungs already name the readings with a reduced weight.
        yield from (remark for remark in native.remarks if not first or remark not in first.rungs)
    for known in comparison.problem.known:
        yield from known.sentences()
    if comparison.problem.discrepancy:
        yield comparison.problem.discrepancy.sentence()


def from_own_model(comparison: Comparison, again: str) -> str:
    """Return the arguments ``again`` with a native baseline.

    "" if sRGB's curves fit the first session well enough, or if the problem already uses a native display or a model.
    """
    first, problem = comparison.first_session, comparison.problem
    if not first or not first.is_another or problem.native or " --model " in again:
        return ""
    native = "native-first-hour" if problem.from_first_hour else "native"
    return f"{again.replace(f' --baseline {problem.baseline}', '')} --baseline {native}"


def data_line(problem: Problem) -> str:
    """Return the number of readings, their hours, their noise and their source."""
    readings, noise, hours = problem.readings, problem.noise, problem.hours
    known = {
        "replicates": "as replicates show",
        "instrument": f"that of {noise.instrument}" if noise.instrument else "as stated",
        "assumed": "ASSUMED: too few replicates",
    }
    out = readings.hours.size - problem.rows.size
    left_out = f" ({out} left out)" if out else ""
    span = f"at {hours.size} hours up to {spaced(float(hours[-1]))} h" if hours.size > 1 else f"at {hours[0]:g} h"
    return (
        f"{readings.hours.size} readings{left_out} {span}; baseline {problem.baseline}; noise of a reading "
        f"{100 * noise.relative:.2g} % and {noise.floor_cd_m2:.2g} cd/m², {known[noise.source]}.\n"
        f"{readings.provenance}"
    )


def error_table(comparison: Comparison) -> Table:
    """Return a table of the errors, the errors from noise alone, and the ratio of their root mean squares."""
    error, floor, ratio = comparison.error, comparison.floor, times(comparison.ratio)
    rows = [
        ("mean ΔE2000", f"{error.delta_e_mean:.3f}", f"{floor.delta_e_mean:.3f}", ""),
        ("95 % of readings below", f"{error.delta_e_p95:.3f}", f"{floor.delta_e_p95:.3f}", ""),
        ("largest", f"{error.delta_e_max:.3f}", f"{floor.delta_e_max:.3f}", ""),
        ("root mean square in σ", f"{error.rms_sigma:.3f}", f"{floor.rms_sigma:.3f}", ratio),
    ]
    return Table(("", "error", "noise alone", "× the noise"), rows)


def _slice_table(slices: list[Slice]) -> Table:
    rows = []
    for each in slices:
        errors = (f"{each.delta_e_mean:.2f}", f"{each.floor_delta_e_mean:.2f}", times(over_noise(each)))
        rows.append((NAMES[each.by], each.slice, str(each.n), *errors))
    clear = [number for number, each in enumerate(slices) if over_noise(each) > CLEAR]
    headings = ("by", "where", "readings", "mean ΔE2000", "noise alone", "× the noise")
    return Table(headings, rows, words=range(2), strong=clear)


def _worst_table(comparison: Comparison) -> Table:
    rows = []
    for each in comparison.worst[:READINGS]:
        code = ", ".join(f"{value:g}" for value in each.code)
        where = (str(each.line), spaced(each.hour), code, _conditions(comparison.problem, each.line))
        rows.append((*where, f"{each.delta_e:.2f}", f"{each.sigma:.1f}"))
    return Table(("line", "hour", "R, G, B", "conditions", "ΔE2000", "σ"), rows, words=range(4))


def _conditions(problem: Problem, line: int) -> str:
    """Return the conditions of a reading that differ from rest: position, room light, window, minutes, note."""
    readings = problem.readings
    row = int((readings.lines == line).argmax())
    unusual = [
        condition.short.format(*(readings.column(each.name)[row] for each in condition.columns))
        for condition in CONDITIONS
        if condition.cell in readings.rest.away and readings.rest.away[condition.cell][row]
    ]
    note = readings.note[row] if readings.note else ""
    return ", ".join([*unusual, *([note] if note else [])])


#: Panels side by side; ratio above which an axis is logarithmic; least span of an axis of ΔL*, Δa*, Δb*.
ACROSS, LOGARITHMIC, LEAST_LAB = 4, 6.0, 0.3

#: Axes of L*a*b*: name, colour and mark.
AXES = (("ΔL*", BLACK, "o"), ("Δa*", RED, "s"), ("Δb*", BLUE, "^"))

#: Errors of a condition's slices that differ by less than this factor count as equal.
SAME = 1.25


def makes_no_difference(panel: ResidualPanel) -> bool:
    """Return whether the error is large but equal under all values of a condition: then its cause is another."""
    equal = bool(panel.ratio.max() < SAME * panel.ratio.min())
    return panel.by not in OF_EVERY_READING and panel.worst >= CLEAR and equal


def title_of(panel: ResidualPanel) -> str:
    """Return the title of a panel: where the error of this dimension is largest."""
    if panel.worst < CLEAR:
        return f"{NAMES[panel.by]}: at most {panel.worst:.1f} × the noise"
    if makes_no_difference(panel):
        return f"{NAMES[panel.by]}: makes no difference"
    where = panel.labels[panel.headed].replace("u ", "").replace("v ", "")
    return f"{NAMES[panel.by]}: {_short(panel.worst)} × the noise at {where}"


def plot_residuals(
    comparison: Comparison, path: Path, *, force: bool, added: str = "", before: Comparison | None = None
) -> None:
    """Draw the page; hollow dots show the error ``before`` effects were ``added``. Errors as :func:`picture`."""
    drawn = panels(comparison)
    earlier = {panel.by: panel for panel in panels(before)} if before else {}
    first, _, rest = comparison.sentence().partition(". ")
    first = f"With {added}: {first[:1].lower()}{first[1:]}" if added else first
    foot = (
        f"{'Hollow: before. ' if before else ''}Above: root mean square error / error of noise alone; grey: "
        "simulated campaigns with only noise. Below: mean of measured − predicted; grey: ± 2 standard deviations "
        "of noise. Panels of a condition: only patches that were read under several values of the condition. "
        f"{comparison.problem.readings.provenance}"
    )
    rows = max(-(-len(drawn) // ACROSS), 1)
    height = 5.6 if rows == 1 else 10.4
    # The dimension that the sentence names as the worst; "" if it names none.
    called = {CALLED[each.by].format(each.slice): each.by for each in reversed(comparison.where)}
    telling = called.get(comparison.direction.where, "") if drawn else ""
    with picture(path, first.rstrip("."), second=rest, foot=foot, height=height, force=force) as (figure, low, high):
        if drawn:
            _draw(figure, drawn, earlier, telling, (low + 0.75 / height, high - 0.35 / height))
        else:
            figure.text(0.5, 0.5, "There is nothing to compare.", ha="center", fontsize=14)


def _draw(
    figure: Figure,
    drawn: list[ResidualPanel],
    earlier: dict[str, ResidualPanel],
    telling: str,
    between: Sequence[float],
) -> None:
    across = min(len(drawn), ACROSS)
    rows, (bottom, top) = -(-len(drawn) // across), between
    grid = figure.add_gridspec(rows, across, left=0.055, right=0.985, bottom=bottom, top=top, wspace=0.24, hspace=0.38)
    most = max(float(panel.ratio.max()) for panel in (*drawn, *earlier.values()))
    widest = max(LEAST_LAB, 1.15 * max(float(np.abs(panel.lab).max()) for panel in drawn))
    for place, panel in enumerate(drawn):
        cell = grid[place // across, place % across]
        clear = panel.worst > CLEAR and not makes_no_difference(panel)
        bold = "bold" if panel.by == telling and clear else "normal"
        if panel.places.ndim == 2:
            axes = figure.add_subplot(cell)
            _map(axes, panel)
        else:
            halves = cell.subgridspec(2, 1, hspace=0.1)
            axes, below = figure.add_subplot(halves[0]), figure.add_subplot(halves[1])
            _sizes(axes, panel, earlier.get(panel.by), most)
            _directions(below, panel, widest, legend=place == 0)
        axes.set_title(title_of(panel), loc="left", fontsize=11, color=RED if clear else BLACK, weight=bold)


def _sizes(axes: Axes, panel: ResidualPanel, earlier: ResidualPanel | None, most: float) -> None:
    # The range of eight simulated campaigns, widened to the expected range of twenty by a factor of 1.3.
    middle = panel.band.mean(axis=1, keepdims=True)
    _band(axes, panel, *(middle + 1.3 * (panel.band - middle)).T)
    axes.axhline(1.0, color=GREY, linewidth=1.0)
    joined = "-" if panel.by == "hour" else ""
    if earlier is not None:
        look: dict[str, Any] = {"color": GREY, "markerfacecolor": "white", "markersize": 5, "linewidth": 1.0}
        axes.plot(earlier.places, earlier.ratio, f"o{joined}", **look)
    if joined:
        axes.plot(panel.places, panel.ratio, joined, color=BLACK, linewidth=1.0, alpha=0.5)
    else:
        axes.vlines(panel.places, np.minimum(panel.ratio, 1.0), np.maximum(panel.ratio, 1.0), color=GREY, linewidth=1.2)
    for clear, colour in ((True, RED), (False, BLACK)):
        here = (panel.ratio > CLEAR) == clear
        axes.plot(panel.places[here], panel.ratio[here], "o", color=colour, markersize=6.5)
    if most > LOGARITHMIC:
        plain_log(axes, "y")
        axes.set_ylim(0.5, 1.6 * most)
    else:
        axes.set_ylim(0.0, max(2.0, 1.15 * most))
    axes.set_ylabel("× the noise", fontsize=9)
    _ticks(axes, panel, labelled=False)


def _band(axes: Axes, panel: ResidualPanel, low: Array, high: Array) -> None:
    """Draw the range of noise alone: one area over the hours, or a box at each category."""
    if panel.by == "hour":
        axes.fill_between(panel.places, low, high, color=BAND, linewidth=0)
    else:
        axes.bar(panel.places, high - low, 0.8, bottom=low, color=BAND, linewidth=0)


def _directions(axes: Axes, panel: ResidualPanel, widest: float, *, legend: bool) -> None:
    limit = panel.scatter.max(axis=1)
    _band(axes, panel, -limit, limit)
    axes.axhline(0.0, color=GREY, linewidth=1.0)
    for index, (name, colour, mark) in enumerate(AXES):
        # Only marks over hours are joined by lines; the three marks of a category stand side by side.
        hours = panel.by == "hour"
        places = panel.places if hours else panel.places + 0.22 * (index - 1)
        if not hours:
            axes.vlines(places, 0.0, panel.lab[:, index], color=colour, linewidth=1.2)
        line = f"{mark}-" if hours else mark
        axes.plot(places, panel.lab[:, index], line, color=colour, markersize=4.5, linewidth=1.2, label=name)
    axes.set_ylim(-widest, widest)
    axes.set_ylabel("mean Δ", fontsize=9)
    if legend:
        axes.legend(loc="best", ncols=3, fontsize=8.5, frameon=False, handlelength=1.2, columnspacing=0.9)
    _ticks(axes, panel, labelled=True)


def _ticks(axes: Axes, panel: ResidualPanel, *, labelled: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    tidy(axes)
    if panel.by == "hour":
        axes.set_xlim(-0.04 * panel.places[-1], 1.04 * panel.places[-1])
        if labelled:
            hour_axis(axes)
            axes.xaxis.set_major_locator(MaxNLocator(4))
    else:
        labels = [label.removesuffix(" ramp") if panel.by == "family" else label for label in panel.labels]
        long = sum(map(len, labels)) > 34
        axes.set_xticks(
            panel.places, labels, rotation=35 if long else 0, ha="right" if long else "center", rotation_mode="anchor"
        )
        axes.set_xlim(-0.5, len(labels) - 0.5)
    axes.tick_params(labelsize=9, labelbottom=labelled)


def _map(axes: Axes, panel: ResidualPanel) -> None:
    """Draw the screen with mean ΔL* and error / noise at each position."""
    from matplotlib.patches import Rectangle

    lightness = panel.lab[:, 0]
    reach = max(float(np.abs(lightness).max()), LEAST_LAB)
    axes.add_patch(Rectangle((0, 0), 1, 1, facecolor="#f4f4f4", edgecolor=GREY))
    (across, up), low, high = panel.places.T, -2 * reach, 2 * reach
    axes.scatter(across, up, c=lightness, s=1500, cmap="PuOr", vmin=low, vmax=high, edgecolor=GREY)
    for (u, v), value, ratio in zip(panel.places, lightness, panel.ratio, strict=True):
        axes.text(u, v, f"{value:+.2f}\n{_short(ratio)} ×", ha="center", va="center", fontsize=9)
    axes.set(xlim=(-0.08, 1.08), ylim=(1.08, -0.08), xticks=[], yticks=[])
    axes.set_xlabel("the screen: mean ΔL*, and × the noise", fontsize=9)
    axes.spines[:].set_visible(False)


def _short(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"
