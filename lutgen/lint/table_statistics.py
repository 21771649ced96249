"""Statistics of a 3D table, computed in one pass over its rows, with memory for one block of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Points an axis of the largest table that is kept whole for a trial: OpenColorIO takes no larger one.
MAX_KEPT = 129


@dataclass(frozen=True)
class TableStatistics:
    """Statistics of a table; ``nan`` where it has no finite rows."""

    #: Number of rows seen.
    rows: int
    #: Smallest and largest finite value of each channel, (3,).
    low: Array
    high: Array
    #: Of channel (row) with position along the fastest, middle and slowest index (column), (3, 3).
    correlation: Array
    #: Channel values of the rows on the neutral axis, (n, 3).
    greys: Array
    #: Number of rows at the end that are 0 0 0.
    black_tail: int
    #: All rows, where they were asked for, (rows, 3).
    table: Array | None


@dataclass
class Gatherer:
    """Collects the rows of a table of ``size``³, first index fastest; with size 0 it only counts them."""

    size: int
    keep: bool = False
    rows: int = 0
    black_tail: int = 0
    low: Array = field(default_factory=lambda: np.full(3, np.inf))
    high: Array = field(default_factory=lambda: np.full(3, -np.inf))
    _moments: Array = field(default_factory=lambda: np.zeros((7, 7)))
    _greys: list[Array] = field(default_factory=list)
    _kept: list[Array] = field(default_factory=list)

    def add(self, rows: Array) -> None:
        """Take the next rows, (n, 3)."""
        finite = rows[np.isfinite(rows).all(axis=1)]
        if len(finite):
            self.low = np.minimum(self.low, finite.min(axis=0))
            self.high = np.maximum(self.high, finite.max(axis=0))
        lit = np.flatnonzero((rows != 0).any(axis=1))
        self.black_tail = len(rows) - 1 - int(lit[-1]) if len(lit) else self.black_tail + len(rows)
        if self.keep and self.size <= MAX_KEPT:
            self._kept.append(rows)
        if self.size > 1:
            self._place(rows, np.arange(self.rows, self.rows + len(rows)))
        self.rows += len(rows)

    def _place(self, rows: Array, index: NDArray[np.intp]) -> None:
        size = self.size
        inside = (index < size**3) & np.isfinite(rows).all(axis=1)
        rows, index = rows[inside], index[inside]
        if not len(rows):
            return
        step = size * size + size + 1
        self._greys.append(rows[index % step == 0])
        where = np.stack([index % size, index // size % size, index // (size * size)], axis=1) / (size - 1)
        # The squares of huge values would overflow; `low` and `high` hold these values.
        all_of = np.column_stack([np.ones(len(rows)), np.clip(rows, -1e6, 1e6), where])
        self._moments += all_of.T @ all_of

    def gathered(self) -> TableStatistics:
        """Return the statistics of all rows added so far."""
        none = np.full(3, np.nan)
        seen = bool(np.isfinite(self.low).all())
        return TableStatistics(
            rows=self.rows,
            low=self.low if seen else none,
            high=self.high if seen else none,
            correlation=self._correlation(),
            greys=np.concatenate(self._greys) if self._greys else np.empty((0, 3)),
            black_tail=self.black_tail,
            table=np.concatenate(self._kept) if self._kept else None,
        )

    def _correlation(self) -> Array:
        count = self._moments[0, 0]
        if count < 2:
            return np.full((3, 3), np.nan)
        mean = self._moments[0, 1:] / count
        spread = self._moments[1:, 1:] / count - np.outer(mean, mean)
        deviation = np.sqrt(np.maximum(np.diag(spread), 0.0))
        scale = np.outer(deviation[:3], deviation[3:])
        return np.asarray(np.divide(spread[:3, 3:], scale, out=np.zeros((3, 3)), where=scale > 1e-9))
