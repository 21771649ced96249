"""The pictures of ``lutgen compare``, ``diagnose`` and ``refine``, as files in a folder."""

from __future__ import annotations

from math import isinf
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.compare.comparison import Comparison, compare_problem
from lutgen.criticism.compare.fit_view import View
from lutgen.criticism.verdict.visibility import relative_size
from lutgen.numerals import percent, readable, times
from lutgen.readings.conditions import COLUMNS
from lutgen.report.comparison import LOGARITHMIC, plot_residuals
from lutgen.report.drawing import (
    BAND,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    RED,
    YELLOW,
    beside,
    hour_axis,
    picture,
    plain_log,
    tidy,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.refine import Refinement
    from lutgen.criticism.verdict.visibility import Visibility
    from lutgen.effects import Effect

RESIDUALS, STEPS, FIT, VISIBILITY = "residuals.png", "steps.png", "fit.png", "visibility.png"

#: Pictures that compare, diagnose and refine may write.
OF_COMPARE, OF_DIAGNOSE, OF_REFINE = (RESIDUALS,), (RESIDUALS, STEPS, FIT, VISIBILITY), (RESIDUALS, STEPS, FIT)

#: Name of the model before an effect is added.
FIRST = "the model"


def plot_comparison(comparison: Comparison, folder: str | Path, *, force: bool = False) -> list[Path]:
    """Draw the residuals of a comparison. Raises LutgenError if the picture cannot be written."""
    path = Path(folder) / RESIDUALS
    plot_residuals(comparison, path, force=force)
    return [path]


def plot_diagnosis(
    diagnosis: Diagnosis, effects: Mapping[str, Effect], folder: str | Path, *, force: bool = False
) -> list[Path]:
    """Draw a diagnosis, and the fit of the named effects; for ``unexplained``, of the best effect."""
    place, foot = Path(folder), diagnosis.problem.readings.provenance
    explanation, problem = diagnosis.explanation, diagnosis.problem
    # If the verdict names no effect, the steps of the search were rejected.
    steps = explanation.steps if diagnosis.verdict.effects else ()
    pictures = plot_comparison(diagnosis.comparison, folder, force=force)
    trail = zip(steps, explanation.trail, strict=False)
    stages = {FIRST: diagnosis.comparison}
    stages |= {f"+ {step.name}": compare_problem(problem, fit.terms) for step, fit in trail}
    plot_steps(stages, diagnosis, place / STEPS, foot=foot, force=force)
    plot_visibility(diagnosis.visibility, effects, place / VISIBILITY, foot=foot, force=force)
    pictures += [place / STEPS, place / VISIBILITY]
    if steps:
        title, terms = diagnosis.verdict.sentence.rstrip("."), explanation.final.terms
        shown = [step.chosen.effect for step in steps]
    elif diagnosis.verdict.name == "unexplained" and explanation.first:
        nearest = explanation.first[0]
        title = f"No known effect explains the error: {nearest.name} is the best, with a large residual"
        terms, shown = nearest.best.fit.terms, [nearest.effect]
    else:
        return pictures
    views = [View.of(problem, terms, effect) for effect in shown]
    plot_fit(views, place / FIT, title=title, foot=foot, force=force)
    return [*pictures, place / FIT]


def plot_refinement(
    refinement: Refinement, effects: Mapping[str, Effect], folder: str | Path, *, force: bool = False
) -> list[Path]:
    """Draw a refinement; errors as in :func:`plot_comparison`."""
    place, foot, steps = Path(folder), refinement.final.problem.readings.provenance, refinement.steps
    added, before = ", ".join(step.effect for step in steps), refinement.before if steps else None
    plot_residuals(refinement.after, place / RESIDUALS, force=force, added=added, before=before)
    stages = {FIRST: refinement.before, **{f"+ {step.effect}": step.comparison for step in steps}}
    plot_steps(stages, None, place / STEPS, foot=foot, force=force)
    pictures = [place / RESIDUALS, place / STEPS]
    if not steps:
        return pictures
    views = [View.of(refinement.final.problem, refinement.final.terms, effects[step.effect]) for step in steps]
    plot_fit(views, place / FIT, title=refinement.sentence().rstrip("."), foot=foot, force=force)
    return [*pictures, place / FIT]


#: Most single effects in the picture.
ALONE = 12

#: Half the height of the band around 1 where an error counts as noise.
NEAR = 0.1


def alone(diagnosis: Diagnosis) -> list[tuple[str, float]]:
    """Return the single effects that lower the error / noise of a comparison, and this ratio, best first."""
    families = diagnosis.explanation.first[:ALONE]
    ratios = {each.name: compare_problem(diagnosis.problem, each.best.fit.terms).ratio for each in families}
    # An effect that lowers the error by less than 1 % is not drawn.
    lowering = [(name, ratio) for name, ratio in ratios.items() if ratio < 0.99 * diagnosis.comparison.ratio]
    return sorted(lowering, key=lambda each: each[1])


def plot_steps(
    stages: Mapping[str, Comparison], diagnosis: Diagnosis | None, path: Path, *, foot: str, force: bool
) -> None:
    """Draw the error of each model (by name), and single effects or the errors in ΔE2000. Raises as :func:`picture`."""
    legend = (
        "× the noise: root mean square error in σ / error of noise alone, of the readings that are predicted from "
        "white and primaries; at 1 × the error is only noise. "
    )
    height = 6.4
    with picture(path, _steps_title(stages), foot=legend + foot, height=height, force=force) as (figure, low, high):
        bottom, top = low + 0.85 / height, high - 0.4 / height
        left = figure.add_axes((0.115, bottom, 0.325, top - bottom))
        rows = [(name, each.ratio, BLUE if each.agrees else RED) for name, each in stages.items()]
        most = max(ratio for _, ratio, _ in rows)
        _ratios(left, rows, most)
        left.set_title("Effect by effect", loc="left", fontsize=12)
        if diagnosis:
            right = figure.add_axes((0.60, bottom, 0.36, top - bottom))
            effects, named = alone(diagnosis), diagnosis.verdict.effects
            bars = [(name, ratio, "#7fb8dc" if name in named else "#bbbbbb") for name, ratio in effects]
            _ratios(right, [(FIRST, stages[FIRST].ratio, RED), *bars], most)
            title = "With one effect alone (blue: named)" if effects else "No effect alone lowers the error"
            right.set_title(title, loc="left", fontsize=12)
        else:
            _colours(figure.add_axes((0.55, bottom, 0.42, top - bottom)), stages)


def _steps_title(stages: Mapping[str, Comparison]) -> str:
    first, last = stages[FIRST], [*stages.values()][-1]
    if len(stages) == 1:
        return f"The error is {times(first.ratio)} the noise, and no effect is added"
    added = ", ".join(name.removeprefix("+ ") for name in [*stages][1:])
    end = "" if last.agrees else ": an error remains"
    return f"With {added} the error falls from {times(first.ratio)} to {times(last.ratio)} the noise{end}"


def _ratios(axes: Axes, rows: Sequence[tuple[str, float, str]], most: float) -> None:
    """Draw one labelled bar for each row (name, error / noise, colour)."""
    logarithmic = most > LOGARITHMIC
    start = 0.5 if logarithmic else 0.0
    if logarithmic:
        plain_log(axes, "x")
    # The label of the longest bar needs a fifth of the axis.
    axes.set_xlim(start, start * (most / start) ** 1.28 if logarithmic else max(1.25 * most, 2.0))
    axes.axvspan(1.0 - NEAR, 1.0 + NEAR, color=BAND, linewidth=0, zorder=0)
    for row, (_, ratio, colour) in enumerate(rows):
        axes.barh(row, max(ratio - start, 0.0), 0.62, left=start, color=colour)
        place = (max(ratio, 1.0 + NEAR), row)
        beside(axes, times(ratio), place, (7, 0), va="center", fontsize=10.5, weight="bold")
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=10.5)
    axes.set_ylim(max(len(rows), 4) - 0.4, -0.6)
    axes.set_xlabel("error, × the noise" + (" (logarithmic)" if logarithmic else ""), fontsize=10)
    tidy(axes, grid="x")


def _colours(axes: Axes, stages: Mapping[str, Comparison]) -> None:
    keys = {"mean": "delta_e_mean", "95 % below": "delta_e_p95", "largest": "delta_e_max"}
    shades = [RED, *["#bbbbbb"] * max(len(stages) - 2, 0), BLUE][: len(stages)]
    columns = [(name, each.error, shade) for (name, each), shade in zip(stages.items(), shades, strict=True)]
    columns.append(("noise alone", [*stages.values()][-1].floor, BAND))
    width = 0.8 / len(columns)
    for index, (name, errors, colour) in enumerate(columns):
        values = [getattr(errors, key) for key in keys.values()]
        places = np.arange(len(keys)) + (index - (len(columns) - 1) / 2) * width
        axes.bar(places, values, 0.9 * width, color=colour, label=name)
        for place, value in zip(places, values, strict=True):
            axes.text(place, value, f"{value:.2f}", ha="center", va="bottom", fontsize=9)
    axes.set_xticks(range(len(keys)), list(keys), fontsize=11)
    axes.set_title("ΔE2000", loc="left", fontsize=12)
    axes.legend(frameon=False, fontsize=10)
    tidy(axes, grid="y")


#: Background of a label, so that the label can be read over lines and bars.
_BOX = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}

#: Height of an effect's row, in inches.
ROW = 0.34

#: Least range of the axis: ratio of an effect's typical size to its smallest detectable size.
LEAST_TIMES, MOST_TIMES = 0.1, 100.0


def plot_visibility(
    seen: Sequence[Visibility], effects: Mapping[str, Effect], path: Path, *, foot: str, force: bool
) -> None:
    """Draw one bar for each effect: typical size over smallest detectable size. Errors as :func:`picture`."""
    sizes = {each.effect: relative_size(each, effects) for each in seen}
    order = sorted(seen, key=lambda each: (not each.visible, sizes[each.effect] or 0.0))
    explained = (
        "Bar: how many times smaller than its typical size an effect may be so that nine of ten campaigns like this "
        "show it; left of the line it must be larger than typical. Right: how much of its signature white and "
        "primaries hide, since they are measured again. "
    )
    height, title = 2.2 + ROW * len(order), _visibility_title(order, sizes)
    with picture(path, title, foot=explained + foot, height=height, force=force) as (figure, low, high):
        bottom, tall = low + 0.62 / height, high - low - 0.95 / height
        _bars(figure.add_axes((0.16, bottom, 0.60, tall)), order, sizes, effects)
        _hidden(figure.add_axes((0.84, bottom, 0.1, tall)), order)


def _visibility_title(order: Sequence[Visibility], sizes: Mapping[str, float | None]) -> str:
    blind = [each.effect for each in order if not each.visible]
    weak = [each.effect for each in order if each.visible and (sizes[each.effect] or 0.0) > 1.0]
    if not blind and not weak:
        return f"These data can see all {len(order)} effects at their typical size"
    visible = len(order) - len(blind) - len(weak)
    parts = [f"These data can see {visible} of {len(order)} effects at their typical size"]
    parts += [f"{', '.join(weak)} only when larger"] if weak else []
    parts += [f"they cannot see {', '.join(blind)}"] if blind else []
    return "; ".join(parts)


def _bars(
    axes: Axes, order: Sequence[Visibility], sizes: Mapping[str, float | None], effects: Mapping[str, Effect]
) -> None:
    multiples = [1.0 / size for size in sizes.values() if size]
    low, high = min([LEAST_TIMES, *(0.7 * each for each in multiples)]), max([MOST_TIMES, *multiples])
    # The label of the longest bar needs a third of the axis.
    end = low * (high / low) ** 1.45
    axes.set(xscale="log", xlim=(low, end), ylim=(len(order) - 0.4, -0.6))
    axes.axvline(1.0, color=BLACK, linewidth=1.2)
    axes.text(1.0, -0.75, "typical size", ha="center", va="bottom", fontsize=10)
    for row, each in enumerate(order):
        size, colour = sizes[each.effect], BLACK
        unit = "" if each.unit == "1" else f" {each.unit}"
        place = low
        if not each.visible:
            label, colour = "cannot be seen at any size", RED
        elif size is None:
            smallest = each.smallest_detectable
            label, colour = f"seen up to {readable(smallest)}{unit}" if smallest else "seen when it is there", BLUE
        else:
            axes.barh(row, 1.0 / size - low, 0.62, left=low, color=BLUE if size <= 1 else RED)
            typical = readable(abs(effects[each.effect].parameters[each.parameter].value), 3)
            label = f"from {readable(each.smallest_detectable or 0.0, 3)}{unit} (typical: {typical})"
            place = max(1.0 / size, 1.0)
        beside(axes, label, (place, row), (6, 0), va="center", fontsize=10, color=colour, bbox=_BOX)
    axes.set_yticks(range(len(order)), [each.effect for each in order], fontsize=11)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.12g} ×".replace(",", "\N{NO-BREAK SPACE}"))
    axes.set_xlabel("seen when so many times smaller than typical: a long bar is seen well")
    tidy(axes, grid="x")


def _hidden(axes: Axes, order: Sequence[Visibility]) -> None:
    share = np.array([each.absorbed or 0.0 for each in order])
    rows = np.arange(len(order))
    axes.barh(rows, np.ones(len(order)), 0.62, color="#eeeeee")
    axes.barh(rows, share, 0.62, color="#999999")
    for row, each in enumerate(order):
        axes.text(1.06, row, percent(each.absorbed), va="center", fontsize=10)
    axes.set(xlim=(0.0, 1.0), xticks=[], ylim=(len(order) - 0.4, -0.6))
    axes.text(0.5, -0.75, "hidden by re-measured\nwhite and primaries", ha="center", va="bottom", fontsize=10)
    axes.tick_params(left=False, labelleft=False)
    axes.spines[:].set_visible(False)


#: Most effects in one picture; each effect has one row.
MOST = 3


def plot_fit(views: Sequence[View], path: Path, *, title: str, foot: str, force: bool) -> None:
    """Draw one row for each effect. Errors as :func:`lutgen.report.drawing.picture`."""
    shown = list(views)[:MOST]
    height = 1.9 + 4.3 * len(shown)
    when = " of hour 0" if shown[0].problem.from_first_hour else ""
    legend = (
        "Dots: measured, ± 1 σ. Dashed: the model without the effect. Solid: with it. All readings are predicted from "
        f"white and primaries{when} alone. "
    )
    with picture(path, title, foot=legend + foot, height=height, force=force) as (figure, low, high):
        bottom, top = low + 0.25 / height, high
        row = (top - bottom) / len(shown)
        for index, view in enumerate(shown, 1):
            base = top - index * row
            inner, tall = base + 0.75 / height, row - 1.45 / height
            figure.text(0.04, base + row - 0.2 / height, view.sentence(), fontsize=12, va="center")
            left = figure.add_axes((0.055, inner, 0.275, tall))
            if view.curves:
                _curves(left, view)
            else:
                left.axis("off")
            _patches(figure.add_axes((0.465, inner, 0.245, tall)), view)
            _against(figure.add_axes((0.77, inner, 0.21, tall)), view)


#: First word of a curve's name → its colour.
_COLOURS = {"black": BLACK, "grey": GREY, "red": RED, "green": GREEN, "blue": BLUE}


def _curves(axes: Axes, view: View) -> None:
    for curve, usual, mark in zip(view.curves, (BLUE, RED, GREEN), "os^", strict=False):
        colour = _COLOURS.get(curve.name.partition(" ")[0], usual)
        places = np.where(np.isinf(curve.places), _warm(curve.places), curve.places)
        axes.errorbar(
            places, curve.measured, curve.sigma, fmt=mark, color=colour, markersize=5, capsize=2, label=curve.name
        )
        axes.plot(places, curve.with_it, "-", color=colour, linewidth=1.6)
    axes.axhline(0.0, color=BLACK, linewidth=1.4, linestyle="--")
    if any(name in COLUMNS and isinf(COLUMNS[name].usual) for name in view.way.columns):
        axes.set_xscale("log")
        finite = np.unique([place for curve in view.curves for place in curve.places if np.isfinite(place)])
        axes.set_xticks([*finite, _warm(np.append(finite, np.inf))], [*(f"{value:g}" for value in finite), "warm"])
        axes.minorticks_off()
    if view.way.columns == ("hour",):
        hour_axis(axes)
        axes.locator_params(axis="x", nbins=4)
    # The axis fits the curves. Readings with three times the median noise do not widen it.
    values = np.concatenate([np.append(curve.with_it, 0.0) for curve in view.curves])
    measured = np.concatenate([curve.measured[curve.sigma < 3 * np.median(curve.sigma)] for curve in view.curves])
    low, high = float(min(values.min(), measured.min())), float(max(values.max(), measured.max()))
    margin = 0.18 * max(high - low, 1e-9)
    axes.set_ylim(low - margin, high + margin)
    axes.set_xlabel(view.way.name)
    title = f"{view.component}, measured − model without {view.effect.name}, {view.unit}"
    axes.set_title(title, loc="left", fontsize=10.5)
    axes.legend(fontsize=9, frameon=False, loc="best")
    tidy(axes)


def _warm(places: np.ndarray) -> float:
    """Return the place of readings of a warm display on the axis of minutes: to the right of all other readings."""
    finite = places[np.isfinite(places)]
    return 2.2 * float(finite.max()) if finite.size else 100.0


def _patches(axes: Axes, view: View) -> None:
    rows = view.patches()
    for row, bar in enumerate(rows):
        axes.barh(row, bar.measured, 0.7, color=tuple(bar.code), edgecolor=GREY, linewidth=0.8)
        for reach, colour, width in ((0.42, BLACK, 3.5), (0.38, YELLOW, 1.6)):
            axes.plot([bar.with_it] * 2, [row - reach, row + reach], "-", color=colour, linewidth=width)
    axes.axvline(0.0, color=BLACK, linewidth=1.4, linestyle="--")
    axes.set_yticks(range(len(rows)), [bar.name for bar in rows], fontsize=8.5)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_title("Where it shows most, in σ; line: with the effect", loc="left", fontsize=10.5, x=-0.3)
    axes.margins(x=0.08)
    tidy(axes, grid="x")


def _against(axes: Axes, view: View) -> None:
    low = min(float(view.change.min()), float(view.residual.min()))
    high = max(float(view.change.max()), float(view.residual.max()))
    axes.plot(view.change, view.residual, ".", color=BLUE, markersize=4, alpha=0.5)
    axes.plot([low, high], [low, high], "-", color=BLACK, linewidth=1.2)
    axes.axhline(0.0, color=BLACK, linewidth=1.4, linestyle="--")
    axes.set_xlabel("change by the effect, σ")
    axes.set_title("Every reading: measured change, σ", loc="left", fontsize=10.5)
    tidy(axes)
