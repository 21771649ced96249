"""Pixels as files store them, and the signal that they mean.

A file stores *signal* (code values, as PNG, JPEG and TIFF do) or *linear* light (as EXR does), in 8 or 16 bits or
in half or single floats, its colours multiplied by alpha (*associated*) or not. Inside, a block of pixels is three
planes of double precision, shape (3, n), in 0..1: the display clips what its source sends beyond.
"""

from __future__ import annotations

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


#: Colours as one number each, shape (n,): the levels of red, green and blue beside one another, blue lowest.
Keys = NDArray[Any]


def joined(levels: Stored, bits: int, kind: type[np.unsignedinteger[Any]] = np.uint64) -> Keys:
    """Join levels of so many bits, (3, ...), to keys of a ``kind`` that holds them, (...)."""
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
    """A stored pixel is NaN or infinite; ``index`` says which of its block."""

    def __init__(self, index: int) -> None:
        """Keep the pixel's index in its block."""
        super().__init__(index)
        self.index = index


def not_finite(path: object, column: int, row: int) -> LutgenError:
    """Return the error of an image with such a pixel, for people."""
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
    #: Whether there is a fourth channel, and whether colours are multiplied by it.
    alpha: bool = False
    associated: bool = False

    @property
    def channels(self) -> int:
        """Numbers of a pixel: 3, or 4 with alpha."""
        return 4 if self.alpha else 3

    @property
    def white(self) -> float:
        """The stored number that means 1."""
        return 1.0 if self.dtype.kind == "f" else float(np.iinfo(self.dtype).max)


@dataclass(frozen=True)
class Decoder:
    """Stored pixels → planes in ``encoding``; 8- and 16-bit numbers, halves among them, by a table of all values."""

    storage: Storage
    encoding: str

    def __call__(self, stored: Stored) -> tuple[Array, int]:
        """Decode (n, channels) → planes (3, n), and how many pixels were clipped. Raises NotFiniteError."""
        if self.storage.associated and (stored[:, 3] != self.storage.white).any():
            return self._clipped(self._unassociated(_finite(stored)))
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
        return self._converted(np.clip(values, 0.0, 1.0))

    def _unassociated(self, single: Stored) -> Array:
        values = single.astype(np.float64) / self.storage.white
        alpha = values[:, 3:]
        # Colours of alpha 0 are not divided by it.
        return np.asarray(values[:, :3] / np.where(alpha > 0.0, alpha, 1.0))

    def _clipped(self, values: Stored) -> tuple[Array, int]:
        outside = int(np.count_nonzero(outside_gamut(values)))
        return self._converted(np.clip(values.T.astype(np.float64, order="C"), 0.0, 1.0)), outside

    def _converted(self, values: Array) -> Array:
        return convert(values, self.storage.encoding, self.encoding)


@dataclass(frozen=True)
class Encoder:
    """Planes in ``encoding`` → stored pixels, rounded to the nearest number, without dither."""

    storage: Storage
    encoding: str

    def __call__(self, planes: Array, source: Stored, source_white: float, out: Stored) -> None:
        """Encode planes (3, n) into ``out`` (n, channels); alpha is that of ``source``, whose 1 is ``source_white``."""
        values = convert(planes, self.encoding, self.storage.encoding)
        white = self.storage.white
        if self.storage.alpha:
            alpha = source[:, 3] / np.float64(source_white)
            if self.storage.associated:
                values = values * np.where(alpha > 0.0, alpha, 1.0)
            out[:, 3] = source[:, 3] if source.dtype == out.dtype else self._stored(alpha, white)
        for channel, plane in enumerate(values):
            out[:, channel] = self._stored(plane, white)

    def _stored(self, values: Array, white: float) -> Stored:
        # Assigning to the array casts; single precision first, since numpy's cast from double to half is slow.
        if self.storage.dtype.kind == "f":
            return values.astype(np.float32)
        return np.rint(np.clip(values, 0.0, 1.0) * white)


def convert(values: Array, source: str, target: str) -> Array:
    """Convert between ``SIGNAL`` and ``LINEAR`` by the sRGB curve. Any shape."""
    if source == target:
        return values
    return code_to_linear(values) if target == LINEAR else linear_to_code(values)


def _finite(stored: Stored) -> Stored:
    """The numbers as single floats, all finite."""
    single: Stored = stored.astype(np.float32, copy=False)
    finite = np.isfinite(single)
    if not finite.all():
        raise NotFiniteError(int(np.argmin(finite.all(axis=1))))
    return single
