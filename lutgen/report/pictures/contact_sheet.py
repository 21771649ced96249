"""The contact sheet: one image un-aged and at four ages, laid out as Figures 2 to 4 of the paper are.

The un-aged image is at the centre; clockwise from the top: chroma 10 000 h (top), chroma 18 000 h (right), chroma-luma
10 000 h (bottom), chroma-luma 18 000 h (left). Pixels are copied one to one, never resampled, onto neutral grey.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from lutgen.report.drawing.grey_page import GREY, Pixels, Text, grey_page, save_page, wrapped
from lutgen.report.drawing.png_file import new_png

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

__all__ = ["GREY", "PLACES", "Layout", "Pixels", "contact_sheet"]

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
