"""Statistics over nuclei of how clearly they stand out: distribution, change with aging, and intervals.

Intervals are percentile bootstraps over nuclei (Efron 1979, doi:10.1214/aos/1176344552), seeded: un-aged and aged
ΔE2000 of a nucleus are drawn together. They tell how much other nuclei of the same tissue would differ, as if nuclei
were drawn one by one; not what another slide, another stain or another segmentation would give.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.pictures.field import Mask
    from lutgen.pictures.nuclei import Labels, Nuclei

#: Shares of a typical nucleus's width: the gap, whose pixels optics and compression mix from both sides, and the ring,
#: 2 µm around a nucleus of 6 µm, which most cytoplasm reaches. At least so many pixels each.
GAP, RING = 0.1, 1 / 3
LEAST_GAP, LEAST_RING = 1, 2

#: Pixels of the smallest ring that stands for what is around a nucleus.
LEAST_PIXELS = 8


@dataclass(frozen=True)
class Rings:
    """Rings of nuclei.

    Attributes
    ----------
    labels
        Which pixels belong to the ring of which nucleus; 0: of none.
    gap, width
        Pixels between nucleus and ring, and pixels across the ring.

    """

    labels: Labels
    gap: int
    width: int


def rings_of(nuclei: Nuclei, visible: Mask) -> tuple[Nuclei, Rings, int]:
    """Return the nuclei that have a ring, numbered anew, their rings, and how many had none.

    A pixel belongs to the ring of the nucleus that is nearest, when it is further than the gap from it and no further
    than gap and width; so it is outside the gap of every other nucleus, and of what is stained like one but not
    counted. ``visible``, (rows, columns), leaves out where the image shows nothing.
    """
    from scipy import ndimage

    gap = max(round(GAP * nuclei.width), LEAST_GAP)
    width = max(round(RING * nuclei.width), LEAST_RING)
    distance, (row, column) = ndimage.distance_transform_edt(nuclei.labels == 0, return_indices=True)
    around = (distance > gap) & (distance <= gap + width) & visible
    labels = np.where(around, np.maximum(nuclei.labels[row, column], 0), 0)
    enough = np.bincount(labels.ravel(), minlength=nuclei.count + 1) >= LEAST_PIXELS
    enough[0] = True
    number = np.where(enough, np.cumsum(enough) - 1, -1).astype(np.int32)
    kept = np.where(nuclei.labels > 0, number[nuclei.labels], nuclei.labels)
    count = int(enough.sum()) - 1
    return (
        replace(nuclei, labels=kept, count=count),
        Rings(np.maximum(number[labels], 0), gap, width),
        nuclei.count - count,
    )


def outlines(labels: Labels) -> NDArray[np.bool_]:
    """Pixels of labels above 0 at which another label, or none, begins: (rows, columns)."""
    edge = np.zeros(labels.shape, np.bool_)
    for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        differs = labels[one] != labels[other]
        edge[one] |= differs
        edge[other] |= differs
    return edge & (labels > 0)


#: Per cents of the nuclei below which the distribution is told.
PERCENT = (5, 25, 50, 75, 95)

#: Resamples, and the per cents of them between which an interval lies.
DRAWS, BETWEEN = 400, (2.5, 97.5)

#: Fewer nuclei than this get no interval: their scatter is not known well enough.
FEWEST = 10

#: Draws that are held at a time, 32 MB.
_HELD = 1 << 22


@dataclass(frozen=True)
class Contrast:
    """ΔE2000 between nuclei and rings in one mode, at h hours, of n nuclei.

    Attributes
    ----------
    unaged
        On the un-aged display, shape (n,).
    aged
        On the aged one, shape (h, n).
    percentiles
        Of ``aged`` over nuclei, at ``PERCENT``, shape (h, 5).
    change
        Of the median, aged over un-aged − 1, shape (h,); NaN where the un-aged median is 0.
    lost
        Share of nuclei that lose more than was asked for, shape (h,).
    intervals
        Low and high ends, 95 %, of median, change and lost, shape (h, 3, 2); None for fewer than ``FEWEST`` nuclei.

    """

    unaged: Array
    aged: Array
    percentiles: Array
    change: Array
    lost: Array
    intervals: Array | None

    @property
    def median(self) -> Array:
        """Of the nuclei, shape (h,)."""
        return np.asarray(self.percentiles[:, PERCENT.index(50)])

    def points(self, hours: Array) -> list[dict[str, Any]]:
        """Return numbers by hours, for JSON; null where there is none."""
        named = {f"p{percent}": self.percentiles[:, place] for place, percent in enumerate(PERCENT)}
        named["median"] = named.pop("p50")
        columns = {"hours": hours, **named, "change": self.change, "lost_share": self.lost}
        points = []
        for place in range(len(hours)):
            point: dict[str, Any] = {name: _number(values[place]) for name, values in columns.items()}
            for number, name in enumerate(("median", "change", "lost_share")):
                ends = None if self.intervals is None else self.intervals[place, number]
                point[f"{name}_interval"] = None if ends is None or np.isnan(ends).any() else list(map(float, ends))
            points.append(point)
        return points


def check_loss(loss: float) -> None:
    """Raise LutgenError for a loss that is not above 0 and below 100 per cent."""
    if not (isfinite(loss) and 0.0 < loss < 100.0):
        raise LutgenError(f"--loss {loss:g}: give the loss in per cent, above 0 and below 100, such as 10.")


def contrast_of(unaged: Array, aged: Array, loss: float) -> Contrast:
    """Return the statistics of n nuclei: ``unaged`` (n,), ``aged`` (h, n), ``loss`` in per cent."""
    losing = aged < (1.0 - loss / 100.0) * unaged
    percentiles = np.percentile(aged, PERCENT, axis=1).T
    return Contrast(
        unaged,
        aged,
        percentiles,
        _change(np.median(aged, axis=1), np.median(unaged)),
        losing.mean(axis=1),
        _intervals(unaged, aged, losing) if unaged.size >= FEWEST else None,
    )


def _intervals(unaged: Array, aged: Array, losing: NDArray[np.bool_]) -> Array:
    """Ends of median, change and share, (h, 3, 2)."""
    random, size = np.random.default_rng(0), unaged.size
    draws = np.empty((len(aged), 3, DRAWS))
    step = max(_HELD // size, 1)
    for start in range(0, DRAWS, step):
        stop = min(start + step, DRAWS)
        # Drawn one row at a time, so that the result does not depend on the number of draws in memory.
        drawn = np.stack([random.integers(0, size, size) for _ in range(start, stop)])
        before = np.median(unaged[drawn], axis=1)
        for row, values, lost in zip(draws, aged, losing, strict=True):
            row[0, start:stop] = np.median(values[drawn], axis=1)
            row[1, start:stop] = _change(row[0, start:stop], before)
            row[2, start:stop] = lost[drawn].mean(axis=1)
    return np.moveaxis(np.percentile(draws, BETWEEN, axis=2), 0, -1)


def _change(after: Array, before: Array | np.float64) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.asarray(after / before - 1.0)
    return np.where(np.isfinite(change), change, np.nan)


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None
