"""A picture small enough to be shown whole, and what displays make of it.

A large image is shrunk in linear light, each pixel of the frame being the mean of the area that it covers, in one
streaming pass; a small one is taken as it is. Aged frames are then computed from the frame's distinct colours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import linear_to_code
from lutgen.pictures.area_means import Grid, light_means
from lutgen.pictures.blocks import open_blocks
from lutgen.pictures.difference import differences

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay

Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Frame:
    """A picture of 8 bits, by its distinct colours.

    Attributes
    ----------
    colours
        Distinct colours, code values 0..255, shape (n, 3).
    places
        Index of each pixel's colour, shape (h, w).
    visible
        Pixels that show something: those of alpha 0 do not; (h, w).
    source_width, source_height
        Of the image that it was shrunk from, turned as a viewer turns it.

    """

    colours: Pixels
    places: NDArray[np.intp]
    visible: NDArray[np.bool_]
    source_width: int
    source_height: int

    @property
    def width(self) -> int:
        """Pixels in a row."""
        return int(self.places.shape[1])

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.places.shape[0])

    @property
    def whole(self) -> bool:
        """Whether the image is shown pixel by pixel."""
        return (self.width, self.height) == (self.source_width, self.source_height)

    def shown(self, display: AgedDisplay) -> Pixels:
        """Return what an un-aged sRGB viewer shows of the picture on a display, code values (h, w, 3)."""
        code = np.rint(display.code_to_code(self.colours / 255.0) * 255.0).astype(np.uint8)
        return np.asarray(code[self.places])

    def differences(self, unaged: AgedDisplay, aged: Sequence[AgedDisplay]) -> Array:
        """ΔE2000 of each pixel on each aged display, against the un-aged one: shape (len(aged), h, w)."""
        code = self.colours / 255.0
        return differences(code.__getitem__, len(code), unaged, aged)[:, self.places]


def read_frame(
    path: Path,
    *,
    pixels: int,
    width: int,
    source: str = "auto",
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Frame:
    """Read an image or a slide, and shrink it to at most so many ``pixels``, at most ``width`` in a row.

    Raises
    ------
    LutgenError
        As :func:`lutgen.pictures.distinct.count_colours`, apart from pixels that are NaN: these are shown black.

    """
    code, visible, size = read_pixels(path, pixels=pixels, width=width, source=source, progress=progress)
    colours, places = np.unique(code.reshape(-1, 3), axis=0, return_inverse=True)
    return Frame(colours, places.reshape(code.shape[:2]), visible, *size)


def read_pixels(
    path: Path,
    *,
    pixels: int,
    width: int,
    source: str = "auto",
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> tuple[Pixels, NDArray[np.bool_], tuple[int, int]]:
    """Read as :func:`read_frame`: code values (h, w, 3), visible pixels (h, w), and width and height of the image."""
    with open_blocks(path, source) as opened:
        high, wide = fitting(opened.height, opened.width, pixels, width)
        linear = light_means(opened, Grid.of(opened.height, opened.width, high=high, wide=wide), progress)
    linear = turned(linear, opened.orientation)
    code = np.rint(linear_to_code(np.clip(np.nan_to_num(linear), 0.0, 1.0)) * 255.0).astype(np.uint8)
    size = (opened.width, opened.height) if opened.orientation < 5 else (opened.height, opened.width)
    return code, np.isfinite(linear[..., 0]), size


def fitting(height: int, width: int, pixels: int, most: int) -> tuple[int, int]:
    """Return height and width of the largest frame of this shape; never larger than the image, at least 1 × 1."""
    share = min((pixels / (height * width)) ** 0.5, most / width, 1.0)
    # A millionth of a pixel: what rounding may take from a whole one.
    return max(int(height * share + 1e-6), 1), max(int(width * share + 1e-6), 1)


def turned(frame: Any, orientation: int) -> Any:
    """Turn a frame (h, w, …) as its file's Orientation (Exif, 1 to 8) asks viewers to."""
    if orientation in (5, 6, 7, 8):
        frame = frame.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        frame = frame[::-1]
    return frame[:, ::-1] if orientation in (2, 3, 6, 7) else frame
