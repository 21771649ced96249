"""The page and the pictures of ``lutgen nuclei``: contrast of nuclei against hours, and outlines of nuclei."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import listed
from lutgen.numerals import in_percent, spaced
from lutgen.pictures.conspicuity import Conspicuity, outlines
from lutgen.report.drawing import BLUE, GREY, RED, hour_axis, new_png, picture, save_page, tidy
from lutgen.report.parts import Headline, Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray


#: Most rows of a mode's table; JSON and the plot have all hours.
ROWS = 5

#: Definition of the contrast, and its limits.
MEASURED = (
    "ΔE2000 between the mean colours of each nucleus and of a ring around it, as the un-aged and the aged display "
    "show them to an eye adapted to the un-aged white. It is a contrast of mean colours: no texture, no sharpness, no "
    "reader. Wrong outlines change it: look at the outlines (--plots)."
)


def nuclei_page(conspicuity: Conspicuity) -> Iterator[Part]:
    """Yield what ``lutgen nuclei`` prints."""
    yield Headline(headline(conspicuity))
    yield table_of(conspicuity)
    yield ""
    yield f"{conspicuity.field.file}: {counted(conspicuity)}"
    yield (
        f"{MEASURED} In brackets: 95 % bootstrap intervals, as if nuclei were independent."
        if next(iter(conspicuity.contrasts.values())).intervals is not None
        else f"{MEASURED} No intervals: too few nuclei to say how they scatter."
    )
    yield conspicuity.model.measurements.provenance
    yield from conspicuity.remarks()


def headline(conspicuity: Conspicuity) -> str:
    """Return a sentence on the contrast of nuclei on the new display and at the last hour."""
    contrasts = conspicuity.contrasts
    new = contrasts[next(iter(contrasts))].percentiles[0, 2]
    parts = [f"{each.median[-1]:.1f} in {mode} ({percent(each.change[-1])})" for mode, each in contrasts.items()]
    of = f"median of {spaced(conspicuity.nuclei.count)}" if conspicuity.nuclei.count > 1 else "the only one"
    return (
        f"Nuclei stand out by ΔE2000 {new:.1f} ({of}) when the display is new; at {spaced(conspicuity.hours[-1])} h by "
        f"{listed(parts)}."
    )


def counted(conspicuity: Conspicuity) -> str:
    """Return one or two sentences on the number of nuclei compared and left out."""
    nuclei, rings = conspicuity.nuclei, conspicuity.rings
    sentence = (
        f"{spaced(nuclei.count)} {'nucleus' if nuclei.count == 1 else 'nuclei'}, {nuclei.method}, typically "
        f"{nuclei.width:.0f} pixels wide; rings of {rings.width} pixels after a gap of {rings.gap}"
    )
    kinds = {"too small": nuclei.small, "too large": nuclei.large, "without room for a ring": conspicuity.ringless}
    left = [f"{spaced(number)} {why}" for why, number in kinds.items() if number]
    return f"{sentence}. Left out: {', '.join(left)}." if left else f"{sentence}."


def table_of(conspicuity: Conspicuity) -> Table:
    """Return a table of the distribution over nuclei and its change, for each mode and some hours."""
    heads = ("median ΔE2000", "middle half", "5–95 %", "change of the median", f"losing > {conspicuity.loss:g} %")
    rows = []
    for mode, contrast in conspicuity.contrasts.items():
        for place in shown_hours(len(conspicuity.hours)):
            low, first, median, third, high = contrast.percentiles[place]
            ends = None if contrast.intervals is None else contrast.intervals[place]
            spread = (f"{median:.1f}", f"{first:.1f}–{third:.1f}", f"{low:.1f}–{high:.1f}")
            change = f"{percent(contrast.change[place])}{_between(ends, 1)}"
            lost = f"{in_percent(contrast.lost[place])}{_between(ends, 2)}"
            rows.append((mode, spaced(conspicuity.hours[place]), *spread, change, lost))
    return Table(("mode", "hours", *heads), rows, unbroken=True)


def shown_hours(count: int) -> Sequence[int]:
    """Return the indices of at most ``ROWS`` of ``count`` hours, with the first and the last."""
    return sorted({round(step * (count - 1) / (ROWS - 1)) for step in range(ROWS)})


def percent(change: float) -> str:
    """Return a change as text with its sign: −14 %, +3.1 %; a dash if it is not finite."""
    if not isfinite(change):
        return "–"
    number = f"{abs(100.0 * change):.{0 if abs(change) >= 0.0995 else 1}f}"
    return "±0 %" if float(number) == 0.0 else f"{'+' if change > 0 else '−'}{number} %"


def _between(ends: Sequence[Sequence[float]] | None, number: int) -> str:
    if ends is None or not all(map(isfinite, ends[number])):
        return ""
    low, high = (percent(end) if number == 1 else in_percent(end) for end in ends[number])
    return "" if low == high else f" ({low} to {high})"


#: Code values of outlines: nuclei in a green that no stain has, rings in black.
NUCLEUS, RING = (0, 255, 60), (20, 20, 20)

#: Least width of the picture of outlines in pixels, and largest factor by which a pixel of the image is enlarged.
WIDE, ZOOM = 1500, 4

#: Side of the part of the image that the page shows, in pixels.
DETAIL = 150


def picture_names(image: str) -> list[str]:
    """Return the names of an image's pictures: the page, and the outlines."""
    stem = Path(image).stem
    return [f"nuclei-{stem}.png", f"nuclei-{stem}-outlines.png"]


def plot_nuclei(conspicuity: Conspicuity, folder: str | Path, *, force: bool = False) -> list[Path]:
    """Draw both pictures into a folder. Raises LutgenError: one exists without ``force``, or cannot be written."""
    page, outlines_path = (Path(folder) / name for name in picture_names(conspicuity.field.file))
    _page(conspicuity, page, force=force)
    with new_png(outlines_path, force=force) as partial:
        save_page(outlined(conspicuity, *((0, size) for size in conspicuity.field.shape)), partial)
    return [page, outlines_path]


def _page(conspicuity: Conspicuity, path: Path, *, force: bool) -> None:
    foot = (
        "Line: median over nuclei of the ΔE2000 between the mean colours of a nucleus and of its ring; bands: "
        "middle half, and 5 to 95 %; dashed: un-aged median. Right: the part of the image with most nuclei, which are "
        f"outlined in green, rings in black. {conspicuity.model.measurements.provenance}"
    )
    second, title = f"{Path(conspicuity.field.file).name}: {counted(conspicuity)}", headline(conspicuity)
    with picture(path, title, second=second, foot=foot, height=6.4, force=force) as (figure, low, high):
        top = 1.1 * max(float(each.percentiles.max()) for each in conspicuity.contrasts.values())
        width, bottom = 0.6 / len(conspicuity.contrasts), low + 0.6 / 6.4
        for number, (mode, contrast) in enumerate(conspicuity.contrasts.items()):
            axes = figure.add_axes((0.05 + number * width, bottom, width - 0.03, high - bottom - 0.4 / 6.4))
            draw_contrast(axes, conspicuity, mode)
            axes.set_ylim(0.0, max(top, 1.0))
            axes.set_title(f"{mode}: {percent(contrast.change[-1])}", fontsize=13, weight="bold", loc="left")
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
    hour_axis(axes)
    axes.legend(loc="lower left", frameon=False, fontsize=10, labelcolor=GREY)
    tidy(axes)


def crowded(conspicuity: Conspicuity) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return first and last row, and first and last column, of the image part with the largest share of nuclei."""
    from scipy import ndimage

    rows, columns = conspicuity.field.shape
    side = min(DETAIL, rows, columns)
    share = ndimage.uniform_filter((conspicuity.nuclei.labels > 0).astype(np.float32), side, mode="constant")
    inside = share[side // 2 : rows - (side - 1) // 2, side // 2 : columns - (side - 1) // 2]
    row, column = np.unravel_index(int(np.argmax(inside)), inside.shape)
    return (int(row), int(row) + side), (int(column), int(column) + side)


def outlined(conspicuity: Conspicuity, rows: tuple[int, int], columns: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a part of the image, enlarged, with the outlines of nuclei and rings, (height, width, 3)."""
    part = np.s_[rows[0] : rows[1], columns[0] : columns[1]]
    zoom = min(max(-(-WIDE // (columns[1] - columns[0])), 1), ZOOM)

    def grown(values: NDArray[Any]) -> NDArray[Any]:
        return values[part].repeat(zoom, axis=0).repeat(zoom, axis=1)

    enlarged = grown(conspicuity.field.rgb())
    for labels, colour in ((conspicuity.rings.labels, RING), (conspicuity.nuclei.labels, NUCLEUS)):
        enlarged[outlines(grown(labels))] = colour
    return enlarged
