"""The paper's Figure 5 of an image: mean ΔE2000 ± 2 SD against hours, tolerances, and where they are reached."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.numerals import spaced
from lutgen.report.drawing.figure import BLACK, BLUE, GREY, RED, named_once, picture, tidy
from lutgen.report.pictures.lifetime import COLUMNS, counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from lutgen.pictures.curve import Curve
    from lutgen.pictures.lifetime import ImageLifetime, Lifetimes

#: Colour of each statistic of Table 1: mean, and mean + 2 SD.
COLOURS = {"mean": BLUE, "max": RED}

#: Height of a bar of the hours until a tolerance is reached, in inches.
_ROW = 0.27

#: Top of the axis over the highest curve: space for labels.
_HEADROOM = 1.12


def picture_names(images: Sequence[str]) -> list[str]:
    """Name the picture of each image. Raises LutgenError where two would have the same name."""
    return named_once([f"lifetime-{Path(image).stem}.png" for image in images], "images")


def plot_lifetimes(lifetimes: Lifetimes, folder: str | Path, *, force: bool = False) -> list[Path]:
    """Draw one picture an image into a folder; the same bytes on every run. Errors as :func:`picture_names`."""
    names = picture_names([image.file for image in lifetimes.images])
    paths = [Path(folder) / name for name in names]
    for image, path in zip(lifetimes.images, paths, strict=True):
        plot_lifetime(lifetimes, image, path, force=force)
    return paths


def plot_lifetime(lifetimes: Lifetimes, image: ImageLifetime, path: Path, *, force: bool = False) -> None:
    """Draw one image's picture: the same bytes on every run."""
    foot = (
        "Dots: mean over all pixels; bars: ± 2 standard deviations, not below 0 (the paper's Figure 5). Dashed: "
        "tolerances; rings: where mean (Avg) and mean + 2 SD (Max) reach them, and below the hours until then"
        f"{', with 95 % intervals from the uncertainty of the model' if image.intervals else ''}. "
    )
    height = 7.6 + _ROW * 2 * len(lifetimes.tolerances)
    title, whole = title_of(lifetimes, image), foot + lifetimes.model.measurements.provenance
    with picture(path, title, second=counted(image), foot=whole, height=height, force=force) as (figure, low, high):
        top = max(float(np.maximum(curve.max, curve.p99).max()) for curve in image.curves.values())
        top = _HEADROOM * max(top, 1.2 * min(lifetimes.tolerances))
        width, strip = 0.92 / len(image.curves), _ROW * 2 * len(lifetimes.tolerances) / height
        bottom = low + 0.6 / height
        for number, (mode, curve) in enumerate(image.curves.items()):
            left, across = 0.05 + number * width, width - 0.04
            lives = figure.add_axes((left, bottom, across, strip))
            above = bottom + strip + 0.12 / height
            axes = figure.add_axes((left, above, across, high - above - 0.45 / height), sharex=lives)
            draw_curve(axes, curve, lifetimes.tolerances, top)
            draw_lives(lives, lifetimes, image, mode)
            axes.set_title(mode, fontsize=13, weight="bold", loc="left")
            if number == 0:
                axes.set_ylabel("ΔE2000, un-aged against aged", fontsize=11)


def title_of(lifetimes: Lifetimes, image: ImageLifetime) -> str:
    """Say when the mean reaches the first tolerance in each mode."""
    tolerance = min(lifetimes.tolerances)
    parts = []
    for mode, curve in image.curves.items():
        hours = curve.hours_until("mean", tolerance)
        parts.append(
            f"{mode} at {spaced(round(hours))} h" if hours is not None else f"{mode} not by {spaced(lifetimes.last)} h"
        )
    return f"The mean ΔE2000 reaches {tolerance:g}: {', '.join(parts)}"


def draw_curve(axes: Axes, curve: Curve, tolerances: Sequence[float], top: float) -> None:
    """Draw one mode: Figure 5."""
    hours = curve.hours
    for values, line, share in ((curve.p99, ":", 99), (curve.p95, "-", 95)):
        axes.plot(hours, values, line, color=GREY, linewidth=1.0, label=f"{share} % of the pixels are below")
    below = np.minimum(2.0 * curve.sd, curve.mean)
    axes.errorbar(
        hours, curve.mean, yerr=(below, 2.0 * curve.sd), fmt="o-", color=BLUE, ecolor=RED, elinewidth=1.1, capsize=3,
        markersize=5, linewidth=1.8, label="mean ± 2 SD", zorder=3,
    )  # fmt: skip
    axes.set_ylim(0.0, top)
    axes.tick_params(labelbottom=False)
    tidy(axes)
    for tolerance in tolerances:
        if tolerance >= top:
            continue
        axes.axhline(tolerance, color=BLACK, linewidth=1.0, linestyle="--", zorder=1)
        axes.text(0.01, tolerance + 0.004 * top, f"ΔE2000 {tolerance:g}", ha="left", va="bottom", fontsize=10,
                  transform=axes.get_yaxis_transform())  # fmt: skip
        for statistic, colour in COLOURS.items():
            when = curve.hours_until(statistic, tolerance)
            if when is not None:
                axes.vlines(when, 0.0, tolerance, color=colour, linewidth=1.0, zorder=1)
                axes.plot(when, tolerance, "o", markersize=9, markerfacecolor="white", markeredgecolor=colour,
                          markeredgewidth=2.0, zorder=5)  # fmt: skip
    axes.legend(loc="upper left", frameon=False, fontsize=10)


def draw_lives(axes: Axes, lifetimes: Lifetimes, image: ImageLifetime, mode: str) -> None:
    """Draw one mode's row of Table 1: a bar from hour 0 until each tolerance is reached."""
    curve, last = image.curves[mode], lifetimes.last
    rows = [(tolerance, statistic) for tolerance in lifetimes.tolerances for statistic in COLUMNS]
    axes.set(xlim=(-0.02 * last, 1.02 * last), ylim=(len(rows) - 0.4, -0.6))
    for row, (tolerance, statistic) in enumerate(rows):
        when, colour = curve.hours_until(statistic, tolerance), COLOURS[statistic]
        axes.barh(row, last if when is None else when, 0.66, color=colour, alpha=0.25 if when is None else 0.85)
        text, end = f"not within {spaced(last)} h" if when is None else f"{spaced(round(when))} h", when or 0.0
        if image.intervals:
            low, high = (last if each is None else each for each in image.intervals[mode][tolerance][statistic])
            axes.hlines(row, low, high, color=BLACK, linewidth=2.5)
            end = max(end, high) if when is not None else end
        inside = end > 0.8 * last
        place, side, shade = (0.005 * last, "left", BLACK) if when is None else (end + 0.01 * last, "left", BLACK)
        if inside:
            place, side, shade = min(when or end, end) - 0.02 * last, "right", "white"
        axes.text(place, row, text, ha=side, va="center", fontsize=10, color=shade)
    axes.set_yticks(range(len(rows)), [f"{COLUMNS[name]} {tolerance:g}" for tolerance, name in rows], fontsize=10)
    axes.set_xlabel("operating hours", fontsize=11)
    axes.xaxis.set_major_formatter(lambda value, _place: spaced(value))
    tidy(axes)
    axes.grid(visible=False, axis="y")
