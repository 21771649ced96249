"""Pictures of ``lutgen nuclei``: how clearly nuclei stand out against hours, and their outlines on the image."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from lutgen.numerals import spaced
from lutgen.pictures.rings import outlines
from lutgen.report.drawing.figure import BLUE, GREY, RED, picture, tidy
from lutgen.report.drawing.grey_page import save_page
from lutgen.report.drawing.png_file import new_png
from lutgen.report.pictures.nuclei import counted, headline, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from lutgen.pictures.conspicuity import Conspicuity

_Kind = TypeVar("_Kind", bound=np.generic)

#: Code values of outlines: nuclei in a green that stains do not have, rings in black.
NUCLEUS, RING = (0, 255, 60), (20, 20, 20)

#: Least width of the picture of outlines in pixels, and largest factor by which a pixel of the image is enlarged.
WIDE, ZOOM = 1500, 4

#: Side of the part of the image that the page shows, in pixels.
DETAIL = 150


def picture_names(image: str) -> list[str]:
    """Name the pictures of an image: the page, and the outlines."""
    stem = Path(image).stem
    return [f"nuclei-{stem}.png", f"nuclei-{stem}-outlines.png"]


def plot_nuclei(conspicuity: Conspicuity, folder: str | Path, *, force: bool = False) -> list[Path]:
    """Draw both pictures into a folder; the same bytes on every run.

    Raises
    ------
    LutgenError
        One of them cannot be written, or exists and ``force`` is not given.

    """
    page, whole = (Path(folder) / name for name in picture_names(conspicuity.field.file))
    _page(conspicuity, page, force=force)
    with new_png(whole, force=force) as partial:
        save_page(outlined(conspicuity, *((0, size) for size in conspicuity.field.shape)), partial)
    return [page, whole]


def _page(conspicuity: Conspicuity, path: Path, *, force: bool) -> None:
    foot = (
        "Line: median over nuclei of the ΔE2000 between a nucleus's mean colour and that of the ring around it; bands: "
        "middle half, and 5 to 95 %; dashed: un-aged median. Right: the part of the image with most nuclei, which are "
        "outlined in green, rings in black. "
    )
    whole = foot + conspicuity.model.measurements.provenance
    second = f"{conspicuity.field.file}: {counted(conspicuity)}"
    with picture(path, headline(conspicuity), second=second, foot=whole, height=6.4, force=force) as (
        figure,
        low,
        high,
    ):
        top = 1.1 * max(float(each.percentiles.max()) for each in conspicuity.contrasts.values())
        width, bottom = 0.6 / len(conspicuity.contrasts), low + 0.6 / 6.4
        for number, (mode, contrast) in enumerate(conspicuity.contrasts.items()):
            axes = figure.add_axes((0.05 + number * width, bottom, width - 0.03, high - bottom - 0.4 / 6.4))
            draw_contrast(axes, conspicuity, mode)
            axes.set_ylim(0.0, max(top, 1.0))
            change = percent(contrast.change[-1])
            axes.set_title(f"{mode}: {change}", fontsize=13, weight="bold", loc="left")
            if number == 0:
                axes.set_ylabel("ΔE2000, nucleus against ring", fontsize=11)
        axes = figure.add_axes((0.655, bottom - 0.3 / 6.4, 0.325, high - bottom + 0.2 / 6.4))
        axes.imshow(outlined(conspicuity, *crowded(conspicuity)), interpolation="antialiased")
        axes.set_axis_off()


def draw_contrast(axes: Axes, conspicuity: Conspicuity, mode: str) -> None:
    """Draw one mode: the distribution over nuclei against hours."""
    contrast, hours = conspicuity.contrasts[mode], conspicuity.hours
    low, first, median, third, high = contrast.percentiles.T
    axes.fill_between(hours, low, high, color=BLUE, alpha=0.15, linewidth=0, label="5–95 % of nuclei")
    axes.fill_between(hours, first, third, color=BLUE, alpha=0.3, linewidth=0, label="middle half")
    axes.plot(hours, median, "o-", color=BLUE, markersize=4, linewidth=2.0, label="median", zorder=3)
    axes.axhline(float(np.median(contrast.unaged)), color=RED, linestyle="--", linewidth=1.4, label="un-aged median")
    axes.set_xlabel("operating hours", fontsize=11)
    axes.locator_params(axis="x", nbins=5)
    axes.xaxis.set_major_formatter(lambda value, _place: spaced(value))
    axes.legend(loc="lower left", frameon=False, fontsize=10, labelcolor=GREY)
    tidy(axes)


def crowded(conspicuity: Conspicuity) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return rows and columns, each from and to, of the part of the image with the largest share of nuclei."""
    from scipy import ndimage

    rows, columns = conspicuity.field.shape
    side = min(DETAIL, rows, columns)
    share = ndimage.uniform_filter((conspicuity.nuclei.labels > 0).astype(np.float32), side, mode="constant")
    inside = share[side // 2 : rows - (side - 1) // 2, side // 2 : columns - (side - 1) // 2]
    row, column = np.unravel_index(int(np.argmax(inside)), inside.shape)
    return (int(row), int(row) + side), (int(column), int(column) + side)


def outlined(conspicuity: Conspicuity, rows: tuple[int, int], columns: tuple[int, int]) -> NDArray[np.uint8]:
    """Part of the image, enlarged, with the outlines of nuclei and rings, (height, width, 3)."""
    part = np.s_[rows[0] : rows[1], columns[0] : columns[1]]
    zoom = min(max(-(-WIDE // (columns[1] - columns[0])), 1), ZOOM)
    enlarged = _grown(conspicuity.field.rgb()[part], zoom)
    for labels, colour in ((conspicuity.rings.labels, RING), (conspicuity.nuclei.labels, NUCLEUS)):
        enlarged[outlines(_grown(labels[part], zoom))] = colour
    return enlarged


def _grown(values: NDArray[_Kind], zoom: int) -> NDArray[_Kind]:
    return values.repeat(zoom, axis=0).repeat(zoom, axis=1)
