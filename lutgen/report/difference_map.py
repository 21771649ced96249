"""The picture of a ΔE2000 map: the map, its scale, and a histogram of ΔE2000.

The scale is the same for every map unless the user chooses another scale, so that maps can be compared. The colours are
matplotlib's viridis, which is perceptually uniform (van der Walt & Smith 2015, https://bids.github.io/colormap/).
Pixels above the scale are magenta and pixels below the scale are black: viridis contains neither colour.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError
from lutgen.numerals import in_percent, pixels_of_colours, spaced
from lutgen.pictures.difference_map import BIN, DifferenceMap
from lutgen.report.drawing import BLACK, DPI, WIDTH, picture, tidy

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: The paper's Figure 6: its maps from top to bottom, and the ΔE2000 at the ends of its colour bar.
MAPS = (("chroma", 8100.0), ("chroma-luma", 4100.0))
MAP_RANGE = (1.0, 8.0)

#: ΔE2000 at the ends of the scale. On the default display almost all pixels stay within the scale for 18 000 h in
#: chroma and for 10 000 h in chroma-luma, the paper's ages. The tolerances 3 and 5 have clearly different colours.
RANGE = (0.0, 12.0)

#: Colour of pixels above the scale.
MAGENTA = "#E6007E"

#: Largest total height of the maps, and largest width of a map, in inches.
_TALL, _WIDE = 10.0, 9.2

#: Widths in inches: margin left of a map, gap before the scale, scale, gap before the histogram, labels to its right.
_LEFT, _GAP, _SCALE, _NEXT, _LABELS = 0.6, 0.35, 0.3, 0.9, 1.35

#: Least height of a histogram in inches.
_LEAST = 3.4

#: Length of the pointed ends of the scale, as a share of its length.
_POINT = 0.04


def check_range(low: float, high: float) -> tuple[float, float]:
    """Return the ends of a scale. Raises LutgenError unless they are finite, from 0 on and increasing."""
    if not (np.isfinite([low, high]).all() and low >= 0.0):
        raise LutgenError(f"range {low:g},{high:g}: a scale runs between finite ΔE2000 from 0 on, such as 0,12.")
    if low >= high:
        raise LutgenError(f"range {low:g},{high:g}: the second number must be larger than the first, as in 0,12.")
    return float(low), float(high)


def plot_map(
    difference: DifferenceMap, path: str | Path, *, ends: tuple[float, float] = RANGE, force: bool = False
) -> Path:
    """Draw a map as a PNG. Raises LutgenError: ``ends`` is no scale, or ``path`` cannot be written."""
    return _draw([difference], Path(path), title_of(difference), check_range(*ends), force=force)


def plot_figure_6(difference: Sequence[DifferenceMap], path: str | Path, *, force: bool = False) -> Path:
    """Draw maps below one another on the scale of the paper's Figure 6, 1 to 8."""
    parts = [f"{each.mode} at {spaced(each.hours)} h by {each.mean:.1f}" for each in difference]
    title = f"Mean change of a pixel, ΔE2000: {', '.join(parts)} (Figure 6)"
    return _draw(difference, Path(path), title, MAP_RANGE, force=force)


def title_of(difference: DifferenceMap) -> str:
    """Return the title: the mean and the largest change of pixels."""
    return (
        f"{difference.mode} at {spaced(difference.hours)} h changes pixels by ΔE2000 {difference.mean:.1f} on average, "
        f"{difference.largest:.1f} at most"
    )


def counted(difference: DifferenceMap) -> str:
    """Return a sentence on the image, its pixels and colours, and the precision of the statistics."""
    sentence = f"{Path(difference.file).name}: {pixels_of_colours(difference.pixels, difference.colours)}"
    if difference.binning_error:
        sentence += f" (statistics to ± {difference.binning_error:.1g}, since colours were counted in bins)"
    if difference.factor > 1:
        sentence += f". Each point of the map is the mean of {difference.factor} × {difference.factor} pixels"
    return f"{sentence}."


def _draw(maps: Sequence[DifferenceMap], path: Path, title: str, ends: tuple[float, float], *, force: bool) -> Path:
    first = maps[0]
    high, wide = first.shown.shape
    inches = min(_WIDE / wide, _TALL / len(maps) / high)
    across, up = wide * inches, high * inches
    where = first.on_screen.sentences() if first.on_screen else []
    foot = " ".join([scale_of(ends), *where, first.model.measurements.provenance])
    each = max(up, _LEAST)
    height = len(maps) * (each + 0.75) + 1.6
    with picture(path, title, second=counted(first), foot=foot, height=height, force=force) as (figure, low, top):
        bottom = low * height + 0.6
        row_height = (top * height - bottom) / len(maps)
        for row, difference in enumerate(reversed(maps)):
            base = bottom + row * row_height
            drawn = draw_map(_axes(figure, (_LEFT, base + (each - up) / 2.0, across, up), height), difference, ends)
            if len(maps) > 1:
                name = f"{difference.mode}, {spaced(difference.hours)} h"
                drawn.axes.set_title(name, fontsize=13, weight="bold", loc="left")
            left = _LEFT + across + _GAP
            below = _POINT * each if ends[0] > 0 else 0.0
            scale = _axes(figure, (left, base - below, _SCALE, (1.0 + _POINT) * each + below), height)
            figure.colorbar(drawn, cax=scale, extend="both" if below else "max", extendfrac=_POINT)
            scale.yaxis.set_visible(False)
            left += _SCALE + _NEXT
            beside = _axes(figure, (left, base, WIDTH - left - _LABELS, each), height)
            draw_histogram(beside, difference, ends, drawn)
            if difference.largest > ends[1]:
                beside.set_title(share_above(difference, ends), fontsize=11, loc="left", color=MAGENTA, weight="bold")
            if row == 0:
                beside.set_xlabel(f"% of the pixels in a bin of {BIN:g}", fontsize=11)
    return path


def scale_of(ends: tuple[float, float]) -> str:
    """Explain the colours and the histogram."""
    kind = {RANGE: "the usual one, so that maps compare", MAP_RANGE: "as in the paper"}.get(ends, "as asked for")
    below = "; black: below it" if ends[0] > 0 else ""
    return (
        f"Scale: ΔE2000 {ends[0]:g} to {ends[1]:g}, {kind}; magenta: above it{below}. At the right: how many pixels "
        f"have which ΔE2000, in bins of {BIN:g}; largest: of all pixels."
    )


def _axes(figure: Figure, inches: tuple[float, float, float, float], height: float) -> Axes:
    left, bottom, across, up = inches
    return figure.add_axes((left / WIDTH, bottom / height, across / WIDTH, up / height))


def share_above(difference: DifferenceMap, ends: tuple[float, float]) -> str:
    """Return the share of pixels above the scale; for a large share also a scale that holds all pixels."""
    share = difference.share(ends[1])
    # Another scale is suggested if more than 1 % of the pixels are above the scale.
    suggested = share > 0.01 and ends != MAP_RANGE
    more = f"; --range {ends[0]:g},{np.ceil(difference.largest):g} holds all" if suggested else ""
    return f"{in_percent(share, 1) if share > 0.0005 else '< 0.1 %'} above{more}"


def draw_map(axes: Axes, difference: DifferenceMap, ends: tuple[float, float]) -> Any:
    """Draw the map. Return matplotlib's image of it, which holds the scale."""
    from matplotlib import colormaps

    colours = colormaps["viridis"].with_extremes(over=MAGENTA, under=BLACK, bad="white")
    # interpolation="auto" averages the points of a map that is larger than its area on the page.
    drawn = axes.imshow(difference.shown, cmap=colours, vmin=ends[0], vmax=ends[1], interpolation="auto", aspect="auto")
    axes.set(xticks=[], yticks=[])
    return drawn


def draw_histogram(axes: Axes, difference: DifferenceMap, ends: tuple[float, float], drawn: Any) -> None:
    """Draw a histogram of ΔE2000 (upwards) in the colours of the map, with mean and quantiles."""
    shares = 100.0 * difference.histogram() / difference.pixels
    middles = BIN * (np.arange(len(shares)) + 0.5)
    axes.barh(middles, shares, BIN, color=drawn.cmap(drawn.norm(middles)))
    axes.set_ylim(*ends)
    axes.set_ylabel("ΔE2000", fontsize=11)
    tidy(axes)
    inside = shares[(middles > ends[0]) & (middles < ends[1])]
    axes.set_xlim(0.0, 1.05 * max(inside.max(initial=0.0), 0.1))
    # Height of a label, in inches.
    line = 0.17 * (ends[1] - ends[0]) * DPI / axes.get_window_extent().height
    place = -np.inf
    marks = {"mean": difference.mean, "95 %": difference.p95, "99 %": difference.p99, "largest": difference.largest}
    for name, value in marks.items():
        if ends[0] <= value <= ends[1]:
            place = max(value, place + line)
            axes.axhline(value, color=BLACK, linewidth=1.0, linestyle="-" if name == "mean" else ":")
            axes.annotate(
                f"{name} {value:.2f}", (1.0, value), (1.05, place), xycoords=axes.get_yaxis_transform(),
                textcoords=axes.get_yaxis_transform(), va="center", fontsize=10, annotation_clip=False,
                arrowprops={"arrowstyle": "-", "color": BLACK, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip
