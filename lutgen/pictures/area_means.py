"""A smaller picture of a large one: each of its pixels is the mean of the area that it covers, gathered by blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.names import LINEAR
from lutgen.pictures.encoding import Decoder

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.pictures.blocks import Blocks, Place
    from lutgen.pictures.encoding import Storage, Stored


class Grid(NamedTuple):
    """Cells laid over a picture: their edges, in pixels from its upper left corner, shapes (h + 1,) and (w + 1,)."""

    rows: Array
    columns: Array

    @classmethod
    def of(cls, height: int, width: int, *, high: int, wide: int) -> Grid:
        """Cut a picture of ``height`` × ``width`` pixels into ``high`` × ``wide`` cells of one size."""
        return cls(np.linspace(0.0, height, high + 1), np.linspace(0.0, width, wide + 1))

    @classmethod
    def squares(cls, height: int, width: int, factor: int) -> Grid:
        """Cut it into squares of ``factor`` × ``factor`` pixels; those at the lower and right edge may be less."""
        rows, columns = (np.append(np.arange(0.0, length, factor), length) for length in (height, width))
        return cls(rows, columns)


def whole_factor(height: int, width: int, longest: int) -> int:
    """Return the smallest factor by which no side is longer than ``longest``."""
    return -(-max(height, width) // longest)


class AreaMeans:
    """Means over the cells of a grid; a pixel across an edge counts on both sides, by its share."""

    def __init__(self, grid: Grid, channels: int) -> None:
        """Begin with nothing."""
        self._grid = grid
        self._sums = np.zeros((len(grid.rows) - 1, len(grid.columns) - 1, channels + 1))

    def add(self, place: Place, values: Array, counted: Array) -> None:
        """Add a block: values (rows, columns, channels), and which pixels count, 0 or 1, (rows, columns)."""
        weighted = np.where(counted[..., np.newaxis] > 0, values, 0.0)
        sums = np.concatenate([weighted, counted[..., np.newaxis]], axis=2)
        cells = []
        spans = (place.top, place.bottom), (place.left, place.right)
        for axis, (edges, (start, stop)) in enumerate(zip(self._grid, spans, strict=True)):
            first = int(np.searchsorted(edges, start, side="right")) - 1
            last = int(np.searchsorted(edges, stop, side="left"))
            sums = _cut(sums, np.clip(edges[first : last + 1], start, stop) - start, axis)
            cells.append(slice(first, last))
        self._sums[tuple(cells)] += sums

    def means(self) -> Array:
        """Give the smaller picture, (h, w, channels); NaN where no pixel counts."""
        counted = self._sums[..., -1:]
        return np.where(counted > 0, self._sums[..., :-1] / np.where(counted > 0, counted, 1.0), np.nan)


def light_means(blocks: Blocks, grid: Grid, progress: Callable[[int, int], None] = lambda _done, _total: None) -> Array:
    """Give the mean linear light of each cell, (h, w, 3); NaN where all is transparent.

    What a file stores as NaN, or as infinite, is black.
    """
    decoder, means = Decoder(blocks.storage, LINEAR), AreaMeans(grid, 3)
    for place, stored in blocks.read(progress):
        means.add(place, *_light(stored, blocks.storage, decoder))
    return means.means()


def _light(stored: Stored, storage: Storage, decoder: Decoder) -> tuple[Array, Array]:
    """Linear light of a block, (rows, columns, 3), and where it counts: alpha is not 0, (rows, columns)."""
    flat = np.where(np.isfinite(stored), stored, 0).astype(stored.dtype).reshape(-1, storage.channels)
    seen = flat[:, 3] != 0 if storage.alpha else np.ones(len(flat), bool)
    light = np.zeros((len(flat), 3))
    if seen.any():
        planes, _ = decoder(flat[seen])
        light[seen] = planes.T
    return light.reshape(*stored.shape[:2], 3), seen.astype(np.float64).reshape(stored.shape[:2])


def _cut(values: Array, edges: Array, axis: int) -> Array:
    """Add up values between consecutive edges along an axis: from 0 to its length, increasing."""
    whole = edges.astype(np.intp)
    sums = np.add.reduceat(values, whole[:-1], axis=axis)
    across = np.moveaxis(sums, axis, 0)
    # Between two edges within one pixel reduceat takes that pixel whole.
    across[whole[:-1] == whole[1:]] = 0.0
    share = (edges - whole).reshape(-1, *[1] * (values.ndim - 1))
    if share.any():
        straddling = np.moveaxis(values, axis, 0)[np.minimum(whole, values.shape[axis] - 1)]
        across += np.diff(share * straddling, axis=0)
    return sums
