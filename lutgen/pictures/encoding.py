"""Conversion between the pixels that files store and planes of signal or linear light.

A file stores *signal* (code values, as PNG, JPEG and TIFF do) or *linear* light (as EXR does), in 8 or 16 bits or in
half or single floats. Its colours may be multiplied by alpha (*associated*). In this program a block of pixels is three
planes of double precision, shape (3, n), in 0..1: the display clips numbers outside this range.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, code_to_linear, linear_to_code
from lutgen.display.chain import outside_gamut
from lutgen.errors import LutgenError
from lutgen.names import LINEAR

#: Pixels as stored, shape (n, channels): RGB, or RGB and alpha.
Stored = NDArray[Any]

#: One number for each colour, shape (n,): the bits of red, green and blue side by side, blue lowest.
Keys = NDArray[Any]


def joined(levels: Stored, bits: int, kind: type[np.unsignedinteger[Any]] = np.uint64) -> Keys:
    """Join levels of ``bits`` bits, (3, ...), to keys of the integer type ``kind``, (...)."""
    keys: Keys = levels[0].astype(kind)
    for level in levels[1:]:
        keys <<= kind(bits)
        keys |= level.astype(kind)
    return keys


def level_of(keys: Keys, channel: int, bits: int) -> Stored:
    """Return one channel's levels of keys, in the keys' type and shape."""
    number = keys.dtype.type
    return np.asarray(keys >> number((2 - channel) * bits) & number((1 << bits) - 1))


def levels_of(keys: Keys, bits: int) -> Stored:
    """Return the levels of keys, (...) → (3, ...), in the keys' type."""
    return np.stack([level_of(keys, channel, bits) for channel in range(3)])


class NotFiniteError(ValueError):
    """A stored pixel is NaN or infinite; ``index`` is its index in its block."""

    def __init__(self, index: int) -> None:
        """Keep the pixel's index in its block."""
        super().__init__(index)
        self.index = index


def not_finite(path: object, column: int, row: int) -> LutgenError:
    """Return the error message for an image whose pixel (column, row) is not finite."""
    return LutgenError(
        f"{path}: pixel ({column}, {row}) is NaN or infinite, which no display can show. Repair the image first."
    )


@dataclass(frozen=True)
class Storage:
    """How a file stores pixels."""

    #: ``uint8``, ``uint16``, ``float16`` or ``float32``.
    dtype: np.dtype[Any]
    #: ``SIGNAL`` or ``LINEAR``.
    encoding: str
    #: Whether there is an alpha channel, and whether colours are multiplied by alpha.
    alpha: bool = False
    associated: bool = False

    @property
    def channels(self) -> int:
        """Number of channels: 3, or 4 with alpha."""
        return 4 if self.alpha else 3

    @property
    def white(self) -> float:
        """The stored number that means 1."""
        return 1.0 if self.dtype.kind == "f" else float(np.iinfo(self.dtype).max)


@dataclass(frozen=True)
class Decoder:
    """Converts stored pixels to planes in ``encoding``: 8- and 16-bit numbers and halves by a table of all values."""

    storage: Storage
    encoding: str

    def __call__(self, stored: Stored) -> tuple[Array, int]:
        """Return planes (3, n) of pixels (n, channels), and how many pixels were clipped. Raises NotFiniteError."""
        if self.storage.associated and (stored[:, 3] != self.storage.white).any():
            values = _finite(stored).astype(np.float64) / self.storage.white
            # Colours are not divided by an alpha of 0.
            return self._clipped(values[:, :3] / np.where(values[:, 3:] > 0.0, values[:, 3:], 1.0))
        if self.storage.dtype.kind == "u":
            return self._looked_up(stored), 0
        single = _finite(stored)
        if self.storage.dtype.itemsize == 4:
            return self._clipped(single[:, :3])
        return self._looked_up(stored.view(np.uint16)), int(np.count_nonzero(outside_gamut(single[:, :3])))

    def _looked_up(self, numbers: Stored) -> Array:
        planes = np.empty((3, len(numbers)))
        for channel, plane in enumerate(planes):
            # All indices are valid; with mode "clip" numpy needs no buffer.
            np.take(self._table, numbers[:, channel], out=plane, mode="clip")
        return planes

    @cached_property
    def _table(self) -> Array:
        numbers = np.arange(2 ** (8 * self.storage.dtype.itemsize), dtype=f"u{self.storage.dtype.itemsize}")
        values = np.nan_to_num(numbers.view(self.storage.dtype).astype(np.float64)) / self.storage.white
        return convert(np.clip(values, 0.0, 1.0), self.storage.encoding, self.encoding)

    def _clipped(self, values: Stored) -> tuple[Array, int]:
        planes = np.clip(values.T.astype(np.float64, order="C"), 0.0, 1.0)
        outside = int(np.count_nonzero(outside_gamut(values)))
        return convert(planes, self.storage.encoding, self.encoding), outside


@dataclass(frozen=True)
class Encoder:
    """Converts planes in ``encoding`` to stored pixels, rounded to the nearest number, without dither."""

    storage: Storage
    encoding: str

    def __call__(self, planes: Array, source: Stored, source_white: float, out: Stored) -> None:
        """Encode planes (3, n) into ``out`` (n, channels). Copy alpha from ``source``, whose 1 is ``source_white``."""
        values = convert(planes, self.encoding, self.storage.encoding)
        if self.storage.alpha:
            alpha = source[:, 3] / np.float64(source_white)
            if self.storage.associated:
                values = values * np.where(alpha > 0.0, alpha, 1.0)
            out[:, 3] = source[:, 3] if source.dtype == out.dtype else self._stored(alpha)
        for channel, plane in enumerate(values):
            out[:, channel] = self._stored(plane)

    def _stored(self, values: Array) -> Stored:
        # Assignment to the array casts. Cast to single precision first: numpy's cast from double to half is slow.
        if self.storage.dtype.kind == "f":
            return values.astype(np.float32)
        return np.rint(np.clip(values, 0.0, 1.0) * self.storage.white)


def convert(values: Array, source: str, target: str) -> Array:
    """Convert values of any shape between ``SIGNAL`` and ``LINEAR`` by the sRGB curve."""
    if source == target:
        return values
    return code_to_linear(values) if target == LINEAR else linear_to_code(values)


def _finite(stored: Stored) -> Stored:
    """Return the numbers as single floats. Raises NotFiniteError."""
    single: Stored = stored.astype(np.float32, copy=False)
    finite = np.isfinite(single)
    if not finite.all():
        raise NotFiniteError(int(np.argmin(finite.all(axis=1))))
    return single
