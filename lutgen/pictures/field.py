"""One field of view, whole in memory: which pixel has which colour.

What must know a pixel's neighbours, as finding nuclei must, cannot work on distinct colours alone. Colours are kept in
16 bits a channel: those of 8- and 16-bit images exactly, of floats the nearest.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lutgen.errors import LutgenError
from lutgen.names import SIGNAL
from lutgen.pictures.blocks import SUFFIXES
from lutgen.pictures.encoding import Decoder, NotFiniteError
from lutgen.pictures.images import open_source

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: Pixels of the largest field: 4096 × 4096, some ten thousand nuclei, half a minute and up to 2 GB on two cores.
LIMIT = 1 << 24

#: A truth value for each pixel, shape (rows, columns).
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Field:
    """A field.

    Attributes
    ----------
    file
        Its path.
    keys
        Colour of each pixel as one number, shape (rows, columns).
    visible
        Where alpha is not 0, shape (rows, columns).

    """

    file: str
    keys: NDArray[np.uint64]
    visible: Mask

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.keys.shape
        return rows, columns

    def rgb(self) -> NDArray[np.uint8]:
        """Code values in 8 bits, as a screen shows them, (rows, columns, 3); white where nothing is visible."""
        pixels = np.full((*self.shape, 3), 255, np.uint8)
        for channel, shift in enumerate((32, 16, 0)):
            level = (self.keys >> np.uint64(shift)) & np.uint64(0xFFFF)
            pixels[..., channel][self.visible] = ((level + np.uint64(128)) // np.uint64(257))[self.visible]
        return pixels


def code_of(keys: NDArray[np.uint64]) -> Array:
    """Code values of colours, (n,) → (n, 3) in 0..1."""
    levels = [(keys >> np.uint64(shift)) & np.uint64(0xFFFF) for shift in (32, 16, 0)]
    return np.stack(levels, axis=1) / 65535.0


def read_field(file: str | Path, source: str = "auto") -> Field:
    """Read a field.

    Parameters
    ----------
    file
        PNG, JPEG, TIFF or EXR of at most ``LIMIT`` pixels.
    source
        What the numbers are: ``auto``, ``signal`` or ``linear``, as for ``apply``.

    Raises
    ------
    LutgenError
        A file that cannot be read to its end, a slide, more than ``LIMIT`` pixels, a pixel that is NaN or infinite, or
        nothing but pixels of one colour or of alpha 0.

    """
    path = Path(file)
    if path.suffix.lower() in SUFFIXES:
        message = f"{file}: is a slide. Give a field of it, at most {LIMIT:,} pixels, exported as TIFF or PNG."
        raise LutgenError(message)
    with open_source(path, source) as image:
        check_size(file, image.height, image.width)
        decoder = Decoder(image.storage, SIGNAL)
        keys = np.empty((image.height, image.width), np.uint64)
        visible = np.ones(keys.shape, np.bool_)
        for first, last in image.bands():
            stored = image.read(first, last)
            if image.storage.alpha:
                visible[first:last] = stored[..., 3] != 0
                stored = np.where(visible[first:last, :, np.newaxis], stored, np.zeros((), stored.dtype))
            keys[first:last] = _keys(file, decoder, stored, first)
    if not visible.any():
        raise LutgenError(f"{file}: every pixel is transparent (alpha 0): there is nothing to see.")
    seen = keys[visible]
    if (seen == seen[0]).all():
        raise LutgenError(f"{file}: all pixels have one colour, so that nothing stands out. Give an image of tissue.")
    return Field(str(file), keys, visible)


def check_size(file: str | Path, rows: int, columns: int) -> None:
    """Raise LutgenError for a picture of more than ``LIMIT`` pixels."""
    if rows * columns > LIMIT:
        message = (
            f"{file}: {columns} × {rows} pixels are more than the {LIMIT:,} in which nuclei are looked for. Crop a "
            "field of view, such as 4096 × 4096 pixels."
        )
        raise LutgenError(message)


def _keys(file: str | Path, decoder: Decoder, stored: NDArray[Any], first: int) -> NDArray[np.uint64]:
    rows, columns, channels = stored.shape
    try:
        planes, _ = decoder(stored.reshape(-1, channels))
    except NotFiniteError as error:
        row, column = divmod(error.index, columns)
        message = (
            f"{file}: pixel ({column}, {first + row}) is NaN or infinite, which no display can show. "
            "Repair the image first."
        )
        raise LutgenError(message) from None
    red, green, blue = np.rint(planes * 65535.0).astype(np.uint64)
    return np.asarray((red << np.uint64(32) | green << np.uint64(16) | blue).reshape(rows, columns))
