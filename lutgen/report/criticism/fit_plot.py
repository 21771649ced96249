"""The picture of what an effect explains: readings, the model without the effect (dashed) and with it (solid)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.numerals import spaced
from lutgen.report.drawing import BLACK, BLUE, GREEN, GREY, RED, YELLOW, picture, tidy

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.criticism.fit_view import View

#: Colours and marks of curves.
LOOKS = ((BLUE, "o"), (RED, "s"), (GREEN, "^"))

#: Effects in one picture, at most; each has one row.
MOST = 3


def plot_fit(views: Sequence[View], path: Path, *, title: str, foot: str, force: bool) -> None:
    """Draw one row an effect. Errors as :func:`lutgen.report.drawing.picture`."""
    shown = list(views)[:MOST]
    height = 1.9 + 4.3 * len(shown)
    when = " of hour 0" if shown[0].problem.baseline == "first-hour" else ""
    legend = (
        "Dots: measured, ± 1 σ. Dashed: the model without the effect. Solid: with it. All readings are predicted from "
        f"white and primaries{when} alone. "
    )
    with picture(path, title, foot=legend + foot, height=height, force=force) as (figure, low, high):
        bottom, top = low + 0.25 / height, high
        row = (top - bottom) / len(shown)
        for index, view in enumerate(shown):
            base = top - (index + 1) * row
            inner, tall = base + 0.75 / height, row - 1.45 / height
            figure.text(0.04, base + row - 0.2 / height, view.sentence(), fontsize=12, va="center")
            left = figure.add_axes((0.055, inner, 0.275, tall))
            if view.curves:
                _curves(left, view)
            else:
                left.axis("off")
            _patches(figure.add_axes((0.465, inner, 0.245, tall)), view)
            _against(figure.add_axes((0.77, inner, 0.21, tall)), view)


def _curves(axes: Axes, view: View) -> None:
    logarithmic = "warmup_min" in view.way.columns
    for curve, (colour, mark) in zip(view.curves, LOOKS, strict=False):
        places = np.where(np.isinf(curve.places), _warm(curve.places), curve.places)
        axes.errorbar(
            places, curve.measured, curve.sigma, fmt=mark, color=colour, markersize=5, capsize=2, label=curve.name
        )
        axes.plot(places, curve.with_it, "-", color=colour, linewidth=1.6)
    axes.axhline(0.0, color=BLACK, linewidth=1.4, linestyle="--")
    if logarithmic:
        axes.set_xscale("log")
        finite = np.unique([place for curve in view.curves for place in curve.places if np.isfinite(place)])
        axes.set_xticks([*finite, _warm(np.append(finite, np.inf))], [*(f"{value:g}" for value in finite), "warm"])
        axes.minorticks_off()
    if view.way.columns == ("hour",):
        axes.xaxis.set_major_formatter(lambda value, _: spaced(value))
        axes.locator_params(axis="x", nbins=4)
    _limit(axes, view)
    axes.set_xlabel(view.way.name)
    axes.set_title(
        f"{view.component}, measured − model without {view.effect.name}, {view.unit}", loc="left", fontsize=10.5
    )
    axes.legend(fontsize=9, frameon=False, loc="best")
    tidy(axes)


def _warm(places: np.ndarray) -> float:
    """Return the place of readings of a warm display on the axis of minutes: to the right of all others."""
    finite = places[np.isfinite(places)]
    return 2.2 * float(finite.max()) if finite.size else 100.0


def _limit(axes: Axes, view: View) -> None:
    """Fit the axis to the curves; readings three times as noisy as the median do not widen it."""
    values = np.concatenate([np.append(curve.with_it, 0.0) for curve in view.curves])
    measured = np.concatenate([curve.measured[curve.sigma < 3 * np.median(curve.sigma)] for curve in view.curves])
    low, high = float(min(values.min(), measured.min())), float(max(values.max(), measured.max()))
    margin = 0.18 * max(high - low, 1e-9)
    axes.set_ylim(low - margin, high + margin)


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
    tidy(axes)
    axes.grid(visible=False, axis="y")


def _against(axes: Axes, view: View) -> None:
    low = min(float(view.change.min()), float(view.residual.min()))
    high = max(float(view.change.max()), float(view.residual.max()))
    axes.plot(view.change, view.residual, ".", color=BLUE, markersize=4, alpha=0.5)
    axes.plot([low, high], [low, high], "-", color=BLACK, linewidth=1.2)
    axes.axhline(0.0, color=BLACK, linewidth=1.4, linestyle="--")
    axes.set_xlabel("change by the effect, σ")
    axes.set_title("Every reading: measured change, σ", loc="left", fontsize=10.5)
    tidy(axes)
