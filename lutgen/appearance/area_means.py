"""A smaller picture of a large one: each of its pixels is the mean of a square, gathered block by block."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.appearance.blocks import Place
    from lutgen.colorimetry import Array


class AreaMeans:
    """Means of squares of ``factor`` × ``factor`` pixels; those at the lower and right edge may be cut."""

    def __init__(self, height: int, width: int, channels: int, longest: int) -> None:
        """Choose the smallest factor by which no side is longer than ``longest``."""
        self.factor = -(-max(height, width) // longest)
        self._sums = np.zeros((-(-height // self.factor), -(-width // self.factor), channels + 1))

    def add(self, place: Place, values: Array, counted: Array) -> None:
        """Add a block: values (rows, columns, channels), and which pixels count, 0 or 1, (rows, columns)."""
        weighted = np.where(counted[..., np.newaxis] > 0, values, 0.0)
        sums = np.concatenate([weighted, counted[..., np.newaxis]], axis=2)
        for axis, start in enumerate((place.top, place.left)):
            sums = self._added(sums, start, axis)
        top, left = place.top // self.factor, place.left // self.factor
        self._sums[top : top + sums.shape[0], left : left + sums.shape[1]] += sums

    def _added(self, sums: Array, start: int, axis: int) -> Array:
        if self.factor == 1:
            return sums
        first = np.arange(-start % self.factor, sums.shape[axis], self.factor)
        return np.add.reduceat(sums, first if first.size and first[0] == 0 else np.append(0, first), axis=axis)

    def means(self) -> Array:
        """Give the smaller picture, (h, w, channels); NaN where no pixel counts."""
        counted = self._sums[..., -1:]
        return np.where(counted > 0, self._sums[..., :-1] / np.maximum(counted, 1.0), np.nan)
