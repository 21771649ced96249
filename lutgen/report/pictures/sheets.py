"""Sheets of one image at several ages, on neutral grey: rows of modes and columns of hours, or the paper's layout.

The paper's Figures 2 to 4 have the un-aged image at the centre; clockwise from the top: chroma 10 000 h (top), chroma
18 000 h (right), chroma-luma 10 000 h (bottom), chroma-luma 18 000 h (left). Pixels are copied one to one there, never
resampled.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from lutgen.numerals import spaced
from lutgen.report.drawing import Pixels, Text, grey_page, new_png, save_page, wrapped

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from lutgen.pictures.aged_series import AgedSeries

#: Width of a sheet in pixels, about: pictures of many hours are reduced to fit.
ACROSS = 3600

#: Pixels of a picture's longest side, at most and at least.
MOST, LEAST = 1000, 160

#: Columns of a sheet, at most: more pictures would be too small to be compared.
COLUMNS = 20


@dataclass(frozen=True)
class _Layout:
    """Where everything is on a sheet of ``rows`` × ``columns`` pictures of ``height`` × ``width`` pixels."""

    rows: int
    columns: int
    height: int
    width: int

    @property
    def cell(self) -> int:
        return max(self.width, LEAST)

    @property
    def text(self) -> int:
        return max(12, self.cell // 30)

    @property
    def gap(self) -> int:
        return self.text

    @property
    def sheet_width(self) -> int:
        return max(self.columns * (self.cell + self.gap) + self.gap, 640)

    def top(self, row: int, heading: int) -> int:
        return heading + row * (self.height + 4 * self.text)

    def left(self, column: int) -> int:
        return self.gap + column * (self.cell + self.gap) + (self.cell - self.width) // 2


def check_hours(hours: Sequence[float]) -> list[float]:
    """Return hours, increasing, each once. Raises LutgenError for more than a sheet has columns for."""
    chosen = sorted(set(map(float, hours)))
    if len(chosen) > COLUMNS:
        message = (
            f"{len(chosen)} hours are more than the {COLUMNS} columns of a sheet. Give a step, such as 0..18000:3000, "
            "or make an animation of them."
        )
        raise LutgenError(message)
    return chosen


def longest(columns: int) -> int:
    """Return the longest side that a picture may have on a sheet of so many columns."""
    return min(max(ACROSS // columns, LEAST), MOST)


def age_sheet(series: AgedSeries, hours: Sequence[float], path: str | Path, *, force: bool = False) -> Path:
    """Write a sheet of the modes of ``series`` and of ``hours`` of it, as a PNG: the same bytes on every run.

    Raises
    ------
    LutgenError
        Too many hours, or a path that cannot be written.

    """
    chosen, modes = check_hours(hours), list(series.curves)
    layout = _Layout(len(modes), len(chosen), *series.source.shape[:2])
    heading = wrapped(sheet_title(series, chosen), layout.sheet_width - 2 * layout.gap, round(1.5 * layout.text))
    above = round(2.0 * layout.text * len(heading)) + 2 * layout.gap
    foot = wrapped(footer(series), layout.sheet_width - 2 * layout.gap, layout.text)
    below = layout.top(len(modes), above)
    height = below + round(1.5 * layout.text * len(foot)) + layout.gap

    def texts() -> Iterator[Text]:
        yield Text(layout.gap, layout.gap, "\n".join(heading), round(1.5 * layout.text))
        for row, mode in enumerate(modes):
            for column, hour in enumerate(chosen):
                top = layout.top(row, above) + layout.height + layout.text // 2
                caption = f"{mode}, {spaced(hour)} h\n{series.told(mode, hour)}"
                yield Text(layout.left(column) + layout.width // 2, top, caption, layout.text, "center")
        yield Text(layout.gap, below, "\n".join(foot), layout.text)

    with new_png(path, force=force) as partial:
        sheet = grey_page(height, layout.sheet_width, texts())
        for row, mode in enumerate(modes):
            for column, hour in enumerate(chosen):
                top, left = layout.top(row, above), layout.left(column)
                sheet[top : top + layout.height, left : left + layout.width] = series.seen(mode, hour)
        save_page(sheet, partial)
    return Path(path)


def sheet_title(series: AgedSeries, hours: Sequence[float]) -> str:
    """State the mean ΔE2000 at the last hour."""
    parts = [f"{series.told(mode, hours[-1])} in {mode}" for mode in series.curves]
    return f"{Path(series.file).name} by {spaced(hours[-1])} h: {', '.join(parts)}"


def footer(series: AgedSeries) -> str:
    """Explain the pictures and the numbers, and name model and readings."""
    model = series.model
    smaller = f" Each pixel is the mean light of {series.factor} × {series.factor}." if series.factor > 1 else ""
    return (
        f"As an un-aged sRGB viewer shows it.{smaller} ΔE2000 against the un-aged display, over all "
        f"{spaced(series.pixels)} pixels. Model: Avanaki et al. 2015{' with effects' if model.effects else ''}, "
        f"selection {model.selection}, luminance law {model.luminance.name}. {model.measurements.provenance}"
    )


#: Where the images go, in the order in which they are given, as (column, row) of a 3 × 3 grid.
PLACES = {"centre": (1, 1), "top": (1, 0), "right": (2, 1), "bottom": (1, 2), "left": (0, 1)}

#: Cells are no narrower than this in pixels, so that captions of small images do not meet.
MIN_CELL = 400


@dataclass(frozen=True)
class Layout:
    """Where everything is on a sheet of images of ``height`` × ``width`` pixels."""

    height: int
    width: int

    @property
    def cell(self) -> int:
        """Width of a column."""
        return max(self.width, MIN_CELL)

    @property
    def text(self) -> int:
        """Height of the text in pixels; it grows with the images, because people look at the sheet as a whole."""
        return max(13, self.cell // 30)

    @property
    def gap(self) -> int:
        """Grey between cells, and around the sheet."""
        return 2 * self.text

    @property
    def caption(self) -> int:
        """Height of the space under each image for a caption of two lines."""
        return 4 * self.text

    @property
    def sheet_width(self) -> int:
        """Width of the whole sheet."""
        return 3 * self.cell + 4 * self.gap

    def corner(self, place: str) -> tuple[int, int]:
        """Row and column of the upper left pixel of the image at ``place``."""
        column, row = PLACES[place]
        left = self.gap + column * (self.cell + self.gap) + (self.cell - self.width) // 2
        return self.gap + row * (self.height + self.caption), left


def contact_sheet(
    images: Mapping[str, Pixels], path: str | Path, *, title: str, footer: str, force: bool = False
) -> Path:
    """Write a contact sheet as a PNG: the same bytes on every run.

    Parameters
    ----------
    images
        Caption (two lines of up to 50 letters) → code values, uint8 of shape (h, w, 3), all of one size, in the order
        of ``PLACES``: un-aged, then clockwise from the top.
    path
        A .png file.
    title
        Written in the free corner at the upper left; wrapped.
    footer
        Display and model of the images; wrapped.
    force
        Replace an existing file.

    Raises
    ------
    LutgenError
        Not five images of one size and of type uint8, or a path that cannot be written.

    """
    layout = _checked(images)
    with new_png(path, force=force) as partial:
        sheet = _write_texts(layout, list(images), title, footer)
        for place, pixels in zip(PLACES, images.values(), strict=True):
            top, left = layout.corner(place)
            sheet[top : top + layout.height, left : left + layout.width] = pixels
        save_page(sheet, partial)
    return Path(path)


def _checked(images: Mapping[str, Pixels]) -> Layout:
    if len(images) != len(PLACES):
        message = f"a contact sheet has {len(PLACES)} images ({', '.join(PLACES)}), not {len(images)}."
        raise LutgenError(message)
    first = next(iter(images.values()))
    for caption, pixels in images.items():
        if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape:
            message = f"image {caption!r} is {pixels.dtype} of shape {pixels.shape}; give uint8 of shape (h, w, 3)."
            raise LutgenError(message)
        if pixels.shape != first.shape:
            message = f"image {caption!r} has shape {pixels.shape}, the first {first.shape}; all must be of one size."
            raise LutgenError(message)
    return Layout(*first.shape[:2])


def _write_texts(layout: Layout, captions: list[str], title: str, footer: str) -> Pixels:
    """Return the sheet with all its texts and no images, shape (H, W, 3)."""
    below = wrapped(footer, layout.sheet_width - 2 * layout.gap, layout.text)
    rows = layout.corner("bottom")[0] + layout.height + layout.caption
    height = rows + round(1.5 * layout.text * len(below)) + layout.gap
    return grey_page(height, layout.sheet_width, _texts(layout, captions, title, below, rows))


def _texts(layout: Layout, captions: list[str], title: str, below: list[str], rows: int) -> Iterator[Text]:
    """Yield title, captions and footer with their places."""
    heading = round(1.5 * layout.text)
    yield Text(layout.gap, layout.gap, "\n".join(wrapped(title, layout.cell, heading)), heading)
    for place, caption in zip(PLACES, captions, strict=True):
        top, left = layout.corner(place)
        yield Text(left + layout.width // 2, top + layout.height + layout.text // 2, caption, layout.text, "center")
    yield Text(layout.gap, rows, "\n".join(below), layout.text)
