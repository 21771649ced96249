"""The picture of ``lutgen show``: chromaticity, luminance and non-additivity of a display against hours.

Each plot has one function, which draws into given axes.
"""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import Array, linear_to_code, xy_to_uv, xyY_to_xyz, xyz_to_linear
from lutgen.display.aging import Shown, show
from lutgen.display.tips import luminance_law
from lutgen.numerals import spaced
from lutgen.readings import TIP_NAMES
from lutgen.report.drawing import beside, new_figure

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

    from lutgen.display import DisplayModel

#: Size in inches: 1500 × 900 pixels, which fit the screen of a laptop.
PAGE = (15.0, 9.0)

#: Characters in a line of the footer, which has two lines at most.
FOOTER = 180

#: Colours of the curves of white, red, green and blue: dark enough for a white page.
TIP_COLOURS = ("#222222", "#c8322d", "#2a8c3c", "#2f55c8")

#: Temperatures in kelvin that are marked on the Planckian locus.
_KELVINS = (3000, 4000, 5000, 6500, 9300, 15000)


def plot_display(model: DisplayModel, path: str | Path, *, force: bool = False) -> None:
    """Write the page of a display, over all its measured hours, as a PNG; errors as :func:`new_figure`."""
    ratios = {"width_ratios": (1.35, 1), "height_ratios": (1.7, 1)}
    with new_figure(path, PAGE, force=force) as figure:
        shown = show(model)
        grid = figure.add_gridspec(2, 2, left=0.05, right=0.97, top=0.86, bottom=0.1, wspace=0.14, hspace=0.3, **ratios)
        chromaticity(figure.add_subplot(grid[:, 0]), shown)
        luminance(figure.add_subplot(grid[0, 1]), shown, model)
        non_additivity(figure.add_subplot(grid[1, 1]), shown)
        first, _, rest = shown.sentence().partition("; ")
        figure.text(0.05, 0.955, first, fontsize=17, weight="bold", va="center")
        figure.text(0.05, 0.915, rest[:1].upper() + rest[1:], fontsize=13, va="center")
        source = textwrap.shorten(shown.provenance, 2 * FOOTER, placeholder=" …")
        figure.text(0.05, 0.012, textwrap.fill(source, FOOTER), fontsize=10, va="bottom", color="#444444")


def chromaticity(axes: Axes, shown: Shown) -> None:
    """Draw the CIE 1976 UCS diagram with the gamut and the drift of all tips, and an inset near white."""
    chromaticity_diagram(axes)
    for row, line in ((0, "-"), (-1, "--")):
        corners = np.vstack([shown.uv[row, 1:], shown.uv[row, 1:2]])
        axes.plot(*corners.T, line, color="#333333", linewidth=1.2, label=f"gamut at {spaced(shown.hours[row])} h")
    shade = _draw_drift(axes, shown, size=16)
    places = (("left", 12, -12), ("right", -16, -10), ("left", 6, -20), ("left", 12, 2))
    for i, (name, (align, right, up)) in enumerate(zip(TIP_NAMES, places, strict=True)):
        text, weight = f"{name}: {shown.shift[-1, i]:.3f}", "bold" if i == np.argmax(shown.shift[-1]) else "normal"
        beside(axes, text, shown.uv[-1, i], (right, up), ha=align, va="center", fontsize=10, weight=weight)
    axes.set(xlim=(-0.02, 0.66), ylim=(-0.02, 0.63), xlabel="u'", ylabel="v'", aspect="equal")
    axes.set_title("CIE 1976 chromaticity; the numbers are Δu'v' since hour 0")
    axes.legend(loc="upper right", frameon=False, fontsize=9)
    _draw_inset(axes, shown)
    bar = axes.figure.colorbar(shade, ax=axes, location="bottom", fraction=0.03, pad=0.08, aspect=50)
    bar.set_label("operating hours: light when new, dark when old")


def luminance(axes: Axes, shown: Shown, model: DisplayModel) -> None:
    """Draw the luminance of all tips against hours, and the luminance laws of mode chroma-luma."""
    for i, (name, colour) in enumerate(zip(TIP_NAMES, TIP_COLOURS, strict=True)):
        label = f"{name}, {'as the model shows it' if shown.effects else 'measured'}"
        # White's line is wider and below the other lines, so that it stays visible where all curves coincide.
        width, dot = (4.0, 9) if i == 0 else (1.4, 5)
        axes.plot(shown.hours, shown.luminance[:, i], ".-", color=colour, linewidth=width, markersize=dot, label=label)
    laws = {law.name: law for law in (luminance_law("paper"), model.luminance)}
    for law, line in zip((law for law in laws.values() if law.table), ("--", ":"), strict=False):
        hours, factors = np.array(law.table).T
        kept = np.append(hours[hours < shown.hours[-1]], min(hours[-1], shown.hours[-1]))
        label = f"white, law {law.name}" + (" (mode chroma-luma)" if law == model.luminance else "")
        axes.plot(kept, np.interp(kept, hours, factors), line, color="#777777", linewidth=1.8, label=label)
    axes.axhline(1.0, color="#bbbbbb", linewidth=0.8, zorder=0)
    axes.set(title="Luminance relative to hour 0", xlabel="operating hours", xlim=shown.hours[[0, -1]])
    axes.set_ylim(0.0, 1.08 * max(1.0, float(shown.luminance.max())))
    axes.legend(loc="lower left", frameon=False, fontsize=9)
    axes.grid(color="#eeeeee")


def non_additivity(axes: Axes, shown: Shown) -> None:
    """Draw the relative excess of the sum of the primaries' luminances over white's luminance against hours."""
    percent = 100.0 * shown.non_additivity
    axes.plot(shown.hours, percent, ".-", color=TIP_COLOURS[0], linewidth=1.4, markersize=5)
    axes.axhline(0.0, color="#bbbbbb", linewidth=0.8, zorder=0)
    # At least ±1 %, so that the repeatability of a meter does not look like an error.
    low, high = min(-1.0, float(percent.min())), max(1.0, float(percent.max()))
    axes.set(title="Non-additivity of luminance, (R + G + B − W) / W in %", xlabel="operating hours")
    axes.set(xlim=shown.hours[[0, -1]], ylim=(1.15 * low, 1.15 * high))
    axes.grid(color="#eeeeee")


def chromaticity_diagram(axes: Axes) -> None:
    """Draw the CIE 1976 diagram: the spectral locus, filled with pale sRGB colours of about its chromaticities."""
    from matplotlib.patches import Polygon

    locus, extent, points = _spectral_locus(), (0.0, 0.64, 0.0, 0.6), 400
    # At v' = 0, y is 0 and XYZ is infinite; the locus stays above 0.01.
    u, v = np.meshgrid(np.linspace(*extent[:2], points), np.linspace(0.002, extent[3], points))
    xy = np.stack([9 * u, 4 * v], axis=-1) / (6 * u - 16 * v + 12)[..., np.newaxis]
    linear = np.maximum(xyz_to_linear(xyY_to_xyz(np.dstack([xy, np.ones_like(u)]))), 0.0)
    code = linear_to_code(linear / linear.max(axis=-1, keepdims=True))
    image = axes.imshow(0.55 + 0.45 * code, extent=extent, origin="lower", interpolation="bilinear", zorder=0)
    image.set_clip_path(Polygon(locus, transform=axes.transData))
    axes.plot(*np.vstack([locus, locus[:1]]).T, color="#555555", linewidth=1.0)


def _spectral_locus() -> Array:
    """Return u', v' of monochromatic light from 390 to 700 nm, shape (n, 2)."""
    from colour.colorimetry import MSDS_CMFS

    observer = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    wavelengths = np.asarray(observer.wavelengths)
    xyz = np.asarray(observer.values, dtype=np.float64)[(wavelengths >= 390) & (wavelengths <= 700)]
    return xy_to_uv(xyz[:, :2] / xyz.sum(axis=1, keepdims=True))


def _draw_drift(axes: Axes, shown: Shown, size: float) -> ScalarMappable:
    """Draw every tip at every hour in greys, darker with time: a hue could be mistaken for a chromaticity."""
    hours = np.repeat(shown.hours[:, np.newaxis], len(TIP_NAMES), axis=1)
    return axes.scatter(
        shown.uv[..., 0], shown.uv[..., 1], c=hours, s=size, cmap="Greys", zorder=4, edgecolor="black", linewidth=0.4
    )


def _draw_inset(axes: Axes, shown: Shown) -> None:
    """Draw white's drift enlarged in the empty corner of the diagram, with rings of equal Δu'v' around hour 0."""
    reach = max(1.1 * float(shown.shift[:, 0].max()), 0.002)
    middle = 0.5 * (shown.uv[:, 0].max(axis=0) + shown.uv[:, 0].min(axis=0))
    inset = axes.inset_axes((0.585, 0.05, 0.405, 0.42))
    inset.set(xlim=middle[0] + np.array([-reach, reach]), ylim=middle[1] + np.array([-reach, reach]), aspect="equal")
    inset.text(0.03, 0.97, "white, with rings of Δu'v'", fontsize=9, va="top", transform=inset.transAxes)
    inset.set(xticks=[], yticks=[])  # the rings are its scale
    _draw_planck(inset, shown.uv[:, 0])
    _draw_rings(inset, shown.uv[0, 0], reach)
    _draw_drift(inset, shown, size=26)
    _label_ends(inset, shown)
    axes.indicate_inset_zoom(inset, edgecolor="#777777")


def _label_ends(axes: Axes, shown: Shown) -> None:
    """Write the first and the last hour beyond the ends of white's drift."""
    direction = shown.uv[-1, 0] - shown.uv[0, 0]
    direction = direction / np.hypot(*direction) if direction.any() else np.array([0.0, 1.0])
    for row, away in ((0, -direction), (-1, direction)):
        sideways = abs(away[0]) > abs(away[1])
        text, align = f"{spaced(shown.hours[row])} h", ("left" if away[0] > 0 else "right") if sideways else "center"
        beside(axes, text, shown.uv[row, 0], 11.0 * away, ha=align, va="center", fontsize=9, weight="bold")


def _draw_rings(axes: Axes, centre: Array, reach: float) -> None:
    """Draw circles of equal Δu'v' around ``centre``, two or more in a view of ``reach`` to each side."""
    power = 10.0 ** np.floor(np.log10(reach / 2.0))
    step = float(max(factor * power for factor in (1, 2, 5) if factor * power <= reach / 2.0 * (1 + 1e-9)))
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for radius in step * np.arange(1, 4):
        axes.plot(centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn), color="#aaaaaa", linewidth=0.8)
        place = centre + radius * np.array([np.cos(3.0), np.sin(3.0)])
        if _inside(axes, place, 0.02, 0.05):
            axes.text(place[0], place[1], f" {radius:g}", fontsize=8, color="#666666", ha="left", va="center")


def _inside(axes: Axes, place: Array, margin_x: float, margin_y: float) -> bool:
    """Return whether a point lies inside the axes, at least the margins (shares of the axes) from their edges."""
    across, up = axes.transAxes.inverted().transform(axes.transData.transform(place))
    return bool(margin_x < across < 1.0 - margin_x and margin_y < up < 1.0 - margin_y)


def _draw_planck(axes: Axes, white: Array) -> None:
    """Draw the Planckian locus with some temperatures, labelled on the side away from white's drift, (n, 2)."""
    from colour.temperature import CCT_to_uv_Ohno2013

    marked = np.array(_KELVINS, dtype=np.float64)
    for kelvins, line in ((np.geomspace(2500, 20_000, 60), "-"), (marked, "|")):
        uv = np.asarray(CCT_to_uv_Ohno2013(np.column_stack([kelvins, np.zeros_like(kelvins)]))) * (1.0, 1.5)
        axes.plot(*uv.T, line, color="#8a5a2b", linewidth=1.0, markersize=8)
    for place, kelvin in zip(uv, _KELVINS, strict=True):
        nearest = white[np.argmin(np.hypot(*(white - place).T))]
        side, align = (-6, "right") if nearest[0] > place[0] else (6, "left")
        if _inside(axes, place, 0.18, 0.08):
            offset = (side, -0.8 * side)
            beside(axes, f"{kelvin} K", place, offset, ha=align, va="center", fontsize=8, color="#8a5a2b")
