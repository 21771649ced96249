"""Count the distinct colours of an image in one pass over a file of any size.

A sum over pixels, such as a mean ΔE2000, is then a weighted sum over distinct colours. An 8-bit image has at most 16.7
million distinct colours, and a tissue image has a few hundred thousand.

8-bit colours are counted exactly, in a table of all 8-bit colours: 67 MB, or twice this for a slide of 2³² pixels.
Other colours are counted in 16 bits per channel, which is exact for 16-bit images. When there are more than ``LIMIT``
distinct colours, they are counted in 15, 14, … bits: the largest number of bits that gives at most ``LIMIT`` colours.
Neither counts nor bits depend on the order of the pixels. Pixels of alpha 0 are not counted; each other pixel counts as
1.

The lightness of these colours separates bare glass from tissue. The threshold is Otsu's (1979,
doi:10.1109/TSMC.1979.4310076) on the histogram of CIE L* of all pixels. Otsu's method splits every image in two, also a
field full of tissue. So the bright part is left out only if it looks like bare glass in bright field: bright, nearly
without colour, and clearly separated from the rest.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import CHUNK, Array, code_to_linear, linear_to_lab
from lutgen.errors import LutgenError
from lutgen.names import SIGNAL
from lutgen.pictures.blocks import open_blocks
from lutgen.pictures.encoding import Decoder, Keys, NotFiniteError, Storage, Stored, joined, levels_of, not_finite
from lutgen.progress import Progress, unseen

#: Most distinct colours of images of more than 8 bits; the sort of so many colours takes 130 MB.
LIMIT = 1 << 20

#: Bits per channel of the finest bins.
FINEST = 16

#: Pixels, or entries of the table of 8-bit colours, that are processed at a time, to bound the memory.
_SLICE = 1 << 18

Counts = NDArray[Any]


@dataclass(frozen=True)
class Colours:
    """The distinct colours of an image, and how often each occurs."""

    #: Key of each colour, increasing, shape (n,).
    keys: Keys
    #: Number of pixels of each colour, shape (n,).
    counts: Counts
    #: Function from keys (m,) to code values (m, 3) in 0..1.
    decode: Callable[[Keys], Array]
    #: Bits per channel in which colours are distinguished.
    bits: int
    #: Largest distance between a pixel's code values and the code values of its colour; 0: colours are exact.
    half_bin: float = 0.0

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def pixels(self) -> int:
        """Number of counted pixels."""
        return int(self.counts.sum())

    def code(self, part: slice = slice(None)) -> Array:
        """Return the code values of the colours in ``part``, (m, 3) in 0..1."""
        return self.decode(self.keys[part])


def count_colours(path: Path, source: str = "auto", progress: Progress = unseen) -> Colours:
    """Count the distinct colours of an image or a slide. Raises LutgenError: unreadable, NaN, or fully transparent."""
    with open_blocks(path, source) as blocks:
        storage = blocks.storage
        exact = storage.dtype == np.uint8 and not storage.associated
        pixels = blocks.height * blocks.width
        counter: _Exact | _Binned = _Exact(storage, pixels) if exact else _Binned(storage)
        for place, stored in blocks.read(progress):
            flat = stored.reshape(-1, storage.channels)
            visible = flat[:, 3] != 0 if storage.alpha else np.ones(len(flat), np.bool_)
            try:
                counter.add(flat if visible.all() else flat[visible])
            except NotFiniteError:
                bad = ~np.isfinite(flat).all(axis=1) & visible
                row, column = divmod(int(bad.argmax()), stored.shape[1])
                raise not_finite(path, place.left + column, place.top + row) from None
    colours = counter.colours()
    if not len(colours):
        raise LutgenError(f"{path}: every pixel is transparent (alpha 0): there is nothing to see.")
    return colours


class _Exact:
    """Counts 8-bit colours in a table of all 8-bit colours."""

    def __init__(self, storage: Storage, pixels: int) -> None:
        self._table = np.zeros(1 << 24, np.uint32 if pixels < 1 << 32 else np.uint64)
        self._decoder = Decoder(storage, SIGNAL)

    def add(self, stored: Stored) -> None:
        """Count pixels (n, channels)."""
        np.add.at(self._table, joined(stored[:, :3].T, 8, np.uint32), self._table.dtype.type(1))

    def colours(self) -> Colours:
        """Return the colours and counts. The table cannot be used again."""
        keys, counts = _squeezed(self._table)
        # Released before the keys are concatenated: table and keys together exceed the memory limit.
        del self._table
        return Colours(np.concatenate(keys), counts, self._code, 8)

    def _code(self, keys: Keys) -> Array:
        stored, channels = levels_of(keys, 8).T.astype(np.uint8), self._decoder.storage.channels
        return self._decoder(np.pad(stored, ((0, 0), (0, channels - 3)), constant_values=255))[0].T


def _squeezed(table: Counts) -> tuple[list[Keys], Counts]:
    """Return the indices of a table's entries above 0, in parts, and their values. The table is overwritten."""
    keys, size = [], 0
    for start in range(0, len(table), _SLICE):
        part = table[start : start + _SLICE]
        places = np.flatnonzero(part)
        keys.append((places + start).astype(np.uint32))
        table[size : size + len(places)] = part[places]
        size += len(places)
    few = table[:size].max(initial=0) < 1 << 32
    return keys, table[:size].astype(np.uint32 if few else np.int64)


class _Binned:
    """Counts colours in a sorted array, in as many bits per channel as ``LIMIT`` allows."""

    def __init__(self, storage: Storage) -> None:
        self._decoder, self._bits = Decoder(storage, SIGNAL), FINEST
        self._keys: Keys = np.zeros(0, np.uint64)
        self._counts: Counts = np.zeros(0, np.int64)
        self._pending: list[tuple[Keys, Counts]] = []
        # Keys hold a 16-bit signal exactly; other numbers are rounded to 16 bits.
        self._exact = storage.dtype == np.uint16 and storage.encoding == SIGNAL and not storage.associated

    def add(self, stored: Stored) -> None:
        """Count pixels (n, channels). Raises NotFiniteError for NaN and infinity."""
        for start in range(0, len(stored), _SLICE):
            planes, _ = self._decoder(stored[start : start + _SLICE])
            levels = np.rint(planes * 65535.0).astype(np.uint64) >> np.uint64(FINEST - self._bits)
            self._pending.append(np.unique(joined(levels, self._bits), return_counts=True))
            if sum(len(keys) for keys, _ in self._pending) > LIMIT:
                self._merge()

    def colours(self) -> Colours:
        """Return the colours and counts."""
        self._merge()
        half = ((1 << (FINEST - self._bits)) - self._exact) / 2.0 / 65535.0
        return Colours(self._keys, self._counts, partial(_code_of_bin, self._bits), self._bits, half)

    def _merge(self) -> None:
        keys, counts = zip((self._keys, self._counts), *self._pending, strict=True)
        together = np.concatenate(keys), np.concatenate(counts)
        # Released before the sort, which needs this memory.
        del keys, counts
        self._pending.clear()
        self._keys, self._counts = _merged(*together)
        del together
        while len(self._keys) > LIMIT:
            self._keys = _coarser(self._keys, self._bits)
            self._bits -= 1
            self._keys, self._counts = _merged(self._keys, self._counts)


def _merged(keys: Keys, counts: Counts) -> tuple[Keys, Counts]:
    """Sort keys, and add up the counts of equal keys."""
    if not len(keys):
        return keys, counts
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    first = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    return keys[first], np.add.reduceat(counts[order], first)


def _coarser(keys: Keys, bits: int) -> Keys:
    """Drop the lowest bit of each channel: (n,) keys → (n,)."""
    coarser = keys >> np.uint64(2 * bits + 1) << np.uint64(2 * bits - 2)
    mask = np.uint64((1 << (bits - 1)) - 1)
    for place in (1, 0):
        coarser |= (keys >> np.uint64(place * bits + 1) & mask) << np.uint64(place * (bits - 1))
    return coarser


def _code_of_bin(bits: int, keys: Keys) -> Array:
    """Return the centres of the bins, (n, 3) in 0..1."""
    width = 1 << (FINEST - bits)
    return np.asarray((levels_of(keys, bits) * float(width) + (width - 1) / 2.0).T / 65535.0)


#: Number of bins of the histogram of L* over 0..100.
BINS = 256

#: Bare glass has on average at least this L* and at most this chroma C*ab. A scanner's white has L* 90 and C*ab 5.
GLASS_L, GLASS_C = 80.0, 12.0

#: Least difference of mean L* between glass and tissue. The noise of a scanner alone gives about 3.
CONTRAST = 8.0


@dataclass(frozen=True)
class Tissue:
    """The part of an image that was left out as bare glass."""

    #: Pixels above this L* are glass; None: no glass was found, and nothing was left out.
    threshold: float | None
    #: Share of pixels left out.
    left_out_share: float


def tissue_only(colours: Colours, path: Path) -> tuple[Colours, Tissue]:
    """Return the colours without bare glass. Raises LutgenError if the image shows only bare glass."""
    bins, sums = _histogram(colours)
    first = otsu(sums[:, 3])
    whole, rest, glass = (_mean(part) for part in (sums, sums[:first], sums[first:]))
    # The mean of a class without pixels is NaN, and then there is no contrast.
    contrast = bool(glass[0] - rest[0] >= CONTRAST)
    if not contrast and _like_glass(whole):
        raise LutgenError(
            f"{path}: no tissue was found: all of it is bright and without colour, like bare glass (L* "
            f"{whole[0]:.0f}). Leave --tissue out to take the image whole."
        )
    if not (contrast and _like_glass(glass)):
        return colours, Tissue(None, 0.0)
    tissue = bins < first
    remaining = replace(colours, keys=colours.keys[tissue], counts=colours.counts[tissue])
    return remaining, Tissue(first * 100.0 / BINS, 1.0 - remaining.pixels / colours.pixels)


def otsu(histogram: Array) -> int:
    """Return the first bin of the bright class by Otsu's method: (bins,) → index; a single filled bin itself."""
    places = np.arange(len(histogram))
    dark, dark_sum = np.cumsum(histogram), np.cumsum(histogram * places)
    bright, bright_sum = dark[-1] - dark, dark_sum[-1] - dark_sum
    between = (dark > 0) & (bright > 0)
    if not between.any():
        return int(np.argmax(histogram))
    difference = dark_sum / np.where(between, dark, 1.0) - bright_sum / np.where(between, bright, 1.0)
    return int(np.argmax(np.where(between, dark * bright * difference**2, -1.0))) + 1


def _histogram(colours: Colours) -> tuple[NDArray[np.uint8], Array]:
    """Return each colour's bin, (n,), and each bin's sums of L*, a*, b* and 1 over its pixels, (BINS, 4)."""
    bins, sums = np.empty(len(colours), np.uint8), np.zeros((BINS, 4))
    for start in range(0, len(colours), CHUNK):
        part = slice(start, start + CHUNK)
        lab, counts = linear_to_lab(code_to_linear(colours.code(part))), colours.counts[part]
        bins[part] = np.clip(lab[:, 0] * (BINS / 100.0), 0, BINS - 1)
        for place, values in enumerate((*lab.T, np.ones(len(lab)))):
            sums[:, place] += np.bincount(bins[part], values * counts, BINS)
    return bins, sums


def _mean(sums: Array) -> Array:
    """Return the mean L*, a*, b* of the pixels in some bins, shape (3,); NaN without pixels."""
    total = sums.sum(axis=0)
    return np.asarray(total[:3] / total[3]) if total[3] else np.full(3, np.nan)


def _like_glass(lab: Array) -> bool:
    return bool(lab[0] >= GLASS_L and np.hypot(lab[1], lab[2]) <= GLASS_C)
