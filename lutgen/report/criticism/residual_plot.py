"""The picture of where a model fails: size and direction of the error by hour, colour and condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_lab
from lutgen.criticism.anchored import is_anchor, noise_only
from lutgen.criticism.compare import CLEAR
from lutgen.criticism.direction import CALLED
from lutgen.criticism.families import condition_of, slices
from lutgen.criticism.linear import whiten
from lutgen.numerals import spaced
from lutgen.report.criticism.comparison import NAMES
from lutgen.report.drawing.figure import BAND, BLACK, BLUE, GREY, RED, picture, tidy

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.compare import Comparison
    from lutgen.criticism.problem import Problem

#: Colour families in the order in which people think of them.
FAMILIES = (
    "black", "grey", "red ramp", "green ramp", "blue ramp", "secondary", "mixture", "tips", "lens cap",
)  # fmt: skip

#: Panels side by side; ratios from which on an axis is logarithmic; ΔL*, Δa*, Δb* that it shows at least.
ACROSS, LOGARITHMIC, LEAST_LAB = 4, 6.0, 0.3

#: Dimensions that are conditions, and how readings that depart from rest in them are called.
CONDITIONS = {
    "position": "position",
    "ambient_lx": "ambient",
    "warmup_min": "cold",
    "temperature_c": "heat",
    "window": "window",
}

#: Axes of L*a*b*: name, colour and mark.
AXES = (("ΔL*", BLACK, "o"), ("Δa*", RED, "s"), ("Δb*", BLUE, "^"))


@dataclass(frozen=True)
class Panel:
    """Errors by one dimension, k slices in order.

    Attributes
    ----------
    by
        The dimension.
    told
        Index of the slice that the title tells: the worst, of a condition the worst that departs from rest.
    labels, places
        Name and position on the axis of each slice; for ``position`` u, v of shape (k, 2).
    ratio, band
        Root mean square over that of noise alone, (k,), and its span in campaigns of noise alone, (k, 2).
    lab, scatter
        Mean ΔL*, Δa*, Δb*, measured less predicted, (k, 3), and two standard deviations of noise alone, (k, 3).

    """

    by: str
    told: int
    labels: tuple[str, ...]
    places: Array
    ratio: Array
    band: Array
    lab: Array
    scatter: Array

    @property
    def worst(self) -> float:
        """Error over noise in the slice that the title tells."""
        return float(self.ratio[self.told])

    @property
    def title(self) -> str:
        """Say where the error of this dimension is largest."""
        if self.worst < CLEAR:
            return f"{NAMES[self.by]}: at most {self.worst:.1f} × noise"
        where = self.labels[self.told].replace("u ", "").replace("v ", "")
        return f"{NAMES[self.by]}: {_short(self.worst)} × noise at {where}"


def panels(comparison: Comparison) -> list[Panel]:
    """Sort the residuals of a comparison into panels."""
    problem, predicted = comparison.problem, comparison.predicted
    judged = ~is_anchor(problem)
    white = problem.measured_tips[0, 0]
    lab = xyz_to_lab(predicted, white)

    def sizes(residual: Array) -> tuple[Array, Array]:
        return (whiten(problem, residual) ** 2).mean(axis=1), xyz_to_lab(predicted + residual, white) - lab

    found = sizes(comparison.residual)
    noise = [sizes(each) for each in noise_only(problem, predicted)]
    made = []
    for by, label in slices(problem).items():
        among = judged & _comparable(problem, by)
        names = _in_order(problem, by, label, among)
        chosen = [among & (label == name) for name in names]
        if len(names) < 2:
            continue
        drawn = np.array([[each[0][here].mean() for here in chosen] for each in noise])
        floor = np.sqrt(drawn.mean(axis=0))
        means = np.array([[each[1][here].mean(axis=0) for here in chosen] for each in noise])
        ratio = np.sqrt([found[0][here].mean() for here in chosen]) / floor
        made.append(
            Panel(
                by,
                _told(problem, by, chosen, ratio),
                tuple(names),
                _places(problem, by, chosen),
                ratio,
                np.stack([np.sqrt(drawn.min(axis=0)), np.sqrt(drawn.max(axis=0))], axis=1) / floor[:, np.newaxis],
                np.array([found[1][here].mean(axis=0) for here in chosen]),
                2.0 * np.sqrt((means**2).mean(axis=0)),
            )
        )
    return made


def _comparable(problem: Problem, by: str) -> NDArray[np.bool_]:
    """Readings that only the dimension tells apart: of a condition, patches that were read in and out of rest."""
    condition = condition_of(problem)
    everything = np.ones(problem.rows.size, dtype=bool)
    if by not in CONDITIONS or not (condition == CONDITIONS[by]).any():
        return everything
    drive = problem.readings.drive[problem.rows]
    off = {tuple(code) for code in drive[condition == CONDITIONS[by]].tolist()}
    known = np.array([tuple(code) in off for code in drive.tolist()])
    return known & np.isin(condition, ["", CONDITIONS[by]])


def _told(problem: Problem, by: str, chosen: Sequence[NDArray[np.bool_]], ratio: Array) -> int:
    condition = condition_of(problem)
    off = [by in CONDITIONS and bool((condition[here] == CONDITIONS[by]).any()) for here in chosen]
    return int(np.argmax(np.where(off, ratio, -1.0) if any(off) else ratio))


def _column(problem: Problem, by: str) -> Array:
    if by == "hour":
        return problem.hours[problem.hour_of]
    if by == "level":
        return np.asarray(problem.readings.drive[problem.rows].max(axis=1))
    if by == "position":
        conditions = problem.readings.conditions
        return np.asarray(conditions["v"][problem.rows] * 1e3 + conditions["u"][problem.rows])
    return problem.readings.conditions[by][problem.rows]


def _in_order(problem: Problem, by: str, label: NDArray[np.str_], among: NDArray[np.bool_]) -> list[str]:
    names = [str(name) for name in np.unique(label[among])]
    if by == "family":
        return sorted(names, key=FAMILIES.index)
    column = np.nan_to_num(_column(problem, by), nan=np.inf)
    return sorted(names, key=lambda name: float(column[among & (label == name)].mean()))


def _places(problem: Problem, by: str, chosen: Sequence[NDArray[np.bool_]]) -> Array:
    if by == "hour":
        return np.array([float(_column(problem, by)[here].mean()) for here in chosen])
    if by == "position":
        u, v = (problem.readings.conditions[name][problem.rows] for name in ("u", "v"))
        return np.array([(float(u[here].mean()), float(v[here].mean())) for here in chosen])
    return np.arange(len(chosen), dtype=np.float64)


def plot_residuals(
    comparison: Comparison, path: Path, *, force: bool, added: str = "", before: Comparison | None = None
) -> None:
    """Draw the page; what was ``before`` effects were ``added`` is hollow. Errors as in :func:`picture`."""
    drawn = panels(comparison)
    earlier = {panel.by: panel for panel in panels(before)} if before else {}
    first, _, rest = comparison.sentence().partition(". ")
    first = f"With {added}: {first[:1].lower()}{first[1:]}" if added else first
    foot = (
        f"{'Hollow: before. ' if before else ''}Above: root mean square error over that of noise alone; grey: "
        "simulated campaigns of nothing but noise. Below: mean of measured − predicted; grey: ± 2 standard deviations "
        "of noise. By a condition: the patches that were read under several of its values. "
        f"{comparison.problem.readings.provenance}"
    )
    rows = max(-(-len(drawn) // ACROSS), 1)
    height = 5.6 if rows == 1 else 10.4
    with picture(path, first.rstrip("."), second=rest, foot=foot, height=height, force=force) as (figure, low, high):
        if drawn:
            _draw(figure, drawn, earlier, _most_telling(comparison), (low + 0.75 / height, high - 0.35 / height))
        else:
            figure.text(0.5, 0.5, "There are no readings but the tips.", ha="center", fontsize=14)


def _most_telling(comparison: Comparison) -> str:
    """Find the dimension in which the sentence says where the error is worst."""
    where = comparison.direction.where
    return next((each.by for each in comparison.where if CALLED[each.by].format(each.slice) == where), "")


def _draw(
    figure: Figure, drawn: Sequence[Panel], earlier: dict[str, Panel], telling: str, between: tuple[float, float]
) -> None:
    across = min(len(drawn), ACROSS)
    grid = figure.add_gridspec(
        -(-len(drawn) // across),
        across,
        left=0.055,
        right=0.985,
        bottom=between[0],
        top=between[1],
        wspace=0.24,
        hspace=0.38,
    )
    most = max(float(panel.ratio.max()) for panel in (*drawn, *earlier.values()))
    widest = max(LEAST_LAB, 1.15 * max(float(np.abs(panel.lab).max()) for panel in drawn))
    for place, panel in enumerate(drawn):
        cell = grid[place // across, place % across]
        clear = panel.worst > CLEAR
        bold = "bold" if panel.by == telling and clear else "normal"
        if panel.by == "position":
            axes = figure.add_subplot(cell)
            _map(axes, panel)
        else:
            halves = cell.subgridspec(2, 1, hspace=0.1)
            axes, below = figure.add_subplot(halves[0]), figure.add_subplot(halves[1])
            _sizes(axes, panel, earlier.get(panel.by), most)
            _directions(below, panel, widest, legend=place == 0)
        axes.set_title(panel.title, loc="left", fontsize=11, color=RED if clear else BLACK, weight=bold)


def _sizes(axes: Axes, panel: Panel, earlier: Panel | None, most: float) -> None:
    low, high = _widened(panel.band).T
    axes.fill_between(panel.places, low, high, color=BAND, linewidth=0)
    axes.axhline(1.0, color=GREY, linewidth=1.0)
    if earlier is not None:
        axes.plot(
            earlier.places, earlier.ratio, "o--", color=GREY, markerfacecolor="white", markersize=5, linewidth=1.0
        )
    axes.plot(panel.places, panel.ratio, "-", color=BLACK, linewidth=1.0, alpha=0.5)
    for clear, colour in ((True, RED), (False, BLACK)):
        here = (panel.ratio > CLEAR) == clear
        axes.plot(panel.places[here], panel.ratio[here], "o", color=colour, markersize=6.5)
    if most > LOGARITHMIC:
        axes.set_yscale("log")
        axes.set_ylim(0.5, 1.6 * most)
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.yaxis.set_minor_formatter(lambda _value, _: "")
    else:
        axes.set_ylim(0.0, max(2.0, 1.15 * most))
    axes.set_ylabel("error / noise", fontsize=9)
    _ticks(axes, panel, labelled=False)


def _widened(band: Array) -> Array:
    """Eight campaigns show two thirds of what noise does: make their span what twenty would show."""
    middle = band.mean(axis=1, keepdims=True)
    return np.asarray(middle + 1.3 * (band - middle))


def _directions(axes: Axes, panel: Panel, widest: float, *, legend: bool) -> None:
    limit = panel.scatter.max(axis=1)
    axes.fill_between(panel.places, -limit, limit, color=BAND, linewidth=0)
    axes.axhline(0.0, color=GREY, linewidth=1.0)
    for index, (name, colour, mark) in enumerate(AXES):
        axes.plot(
            panel.places, panel.lab[:, index], f"{mark}-", color=colour, markersize=4.5, linewidth=1.2, label=name
        )
    axes.set_ylim(-widest, widest)
    axes.set_ylabel("mean Δ", fontsize=9)
    if legend:
        axes.legend(loc="best", ncols=3, fontsize=8.5, frameon=False, handlelength=1.2, columnspacing=0.9)
    _ticks(axes, panel, labelled=True)


def _ticks(axes: Axes, panel: Panel, *, labelled: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    tidy(axes)
    if panel.by == "hour":
        axes.set_xlim(-0.04 * panel.places[-1], 1.04 * panel.places[-1])
        if labelled:
            axes.xaxis.set_major_formatter(lambda value, _: spaced(value))
            axes.xaxis.set_major_locator(MaxNLocator(4))
    else:
        labels = [label.removesuffix(" ramp") if panel.by == "family" else label for label in panel.labels]
        long = sum(map(len, labels)) > 34
        axes.set_xticks(
            panel.places, labels, rotation=35 if long else 0, ha="right" if long else "center", rotation_mode="anchor"
        )
        axes.set_xlim(-0.4, len(labels) - 0.6)
    axes.tick_params(labelsize=9, labelbottom=labelled)


def _map(axes: Axes, panel: Panel) -> None:
    """Draw the screen: mean ΔL* at each position, and the error over noise."""
    from matplotlib.patches import Rectangle

    lightness = panel.lab[:, 0]
    reach = max(float(np.abs(lightness).max()), LEAST_LAB)
    axes.add_patch(Rectangle((0, 0), 1, 1, facecolor="#f4f4f4", edgecolor=GREY))
    axes.scatter(
        panel.places[:, 0],
        panel.places[:, 1],
        c=lightness,
        s=1500,
        cmap="PuOr",
        vmin=-2 * reach,
        vmax=2 * reach,
        edgecolor=GREY,
    )
    for (u, v), value, ratio in zip(panel.places, lightness, panel.ratio, strict=True):
        axes.text(u, v, f"{value:+.2f}\n{_short(ratio)} ×", ha="center", va="center", fontsize=9)
    axes.set(xlim=(-0.08, 1.08), ylim=(1.08, -0.08), xticks=[], yticks=[])
    axes.set_xlabel("the screen: mean ΔL*, and error / noise", fontsize=9)
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)


def _short(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"
