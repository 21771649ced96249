"""A neutral grey page with white text, on which pictures are placed pixel by pixel."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.report.drawing.png_file import METADATA

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

Pixels = NDArray[np.uint8]

#: Code value of L* = 50: a surround halfway between light and dark pictures.
GREY = 119


class Text(NamedTuple):
    """A text: its column, row of its top, the text, its height in pixels, its side at the column (``left``, …)."""

    column: int
    top: int
    letters: str
    size: int
    side: str = "left"


def grey_page(height: int, width: int, texts: Iterable[Text]) -> Pixels:
    """Return a page with texts, shape (height, width, 3)."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context("default"):
        # At 72 dots per inch a point is a pixel; a tenth of a pixel more, so that rounding does not lose a row.
        figure = Figure(figsize=((width + 0.1) / 72, (height + 0.1) / 72), dpi=72, facecolor=(GREY / 255,) * 3)
        canvas: Any = FigureCanvasAgg(figure)
        for text in texts:
            figure.text(
                text.column / width,
                1.0 - text.top / height,
                text.letters,
                fontsize=text.size,
                color="white",
                ha=text.side,
                va="top",
                linespacing=1.3,
                parse_math=False,
            )
        canvas.draw()
        return np.array(canvas.buffer_rgba())[..., :3]


def wrapped(text: str, width: int, size: int) -> list[str]:
    """Break a text into lines of ``width`` pixels: a character of DejaVu Sans is on average at most 0.6 em wide."""
    return textwrap.wrap(text, max(int(width / (0.6 * size)), 10))


def save_page(page: Pixels, path: Path) -> None:
    """Write a page as PNG, whatever the path's suffix: the same bytes on every run."""
    from matplotlib.image import imsave

    imsave(path, page, format="png", metadata=METADATA)
