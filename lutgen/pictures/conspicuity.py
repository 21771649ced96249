"""``nuclei``: colour contrast between nuclei and their surroundings on un-aged and on aged displays.

The abstract of the paper announces conspicuity of nuclei by ΔE2000. For each nucleus this module computes ΔE2000
between the mean Lab of the nucleus and the mean Lab of a ring around the nucleus. A display shows both colours
(:mod:`lutgen.pictures.difference`); the contrast on the un-aged display is compared with the contrast on aged displays.
The contrast is between mean colours only. It includes no texture, no edge and no reader. It includes errors of the
segmentation.

A mean over pixels is a weighted mean over distinct colours. So the aged Lab is computed once for each colour and
display. One sparse matrix, colours × (nuclei and rings), holds how often each colour occurs in each nucleus and ring.

Intervals are percentile bootstraps over nuclei (Efron 1979, doi:10.1214/aos/1176344552), seeded. The un-aged and the
aged ΔE2000 of a nucleus are drawn together. The intervals hold for other nuclei of the same tissue, as if nuclei were
drawn one by one. They do not hold for another slide, another stain or another segmentation.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.cells import csv_text
from lutgen.colorimetry import CHUNK, Array, delta_e_2000
from lutgen.display import AgedDisplay, DisplayModel, hour_name, seen_on, what_pictures_carry
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import AGING_MODES, SOURCES
from lutgen.pictures.blocks import Field, Mask, code_of, read_field, threads
from lutgen.pictures.difference import shown_lab
from lutgen.pictures.lifetime import hours_from_0
from lutgen.pictures.nuclei import NEIGHBOURS, Labels, Nuclei, read_mask, segment
from lutgen.progress import Progress, unseen

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray


#: Widths of the gap and of the ring as shares of a typical nucleus's width. Optics and compression mix colours of both
#: sides in the gap. The ring is 2 µm wide for a nucleus of 6 µm; most cytoplasm extends so far. ``LEAST_`` are the
#: smallest widths in pixels.
GAP, RING = 0.1, 1 / 3
LEAST_GAP, LEAST_RING = 1, 2

#: Pixels of the smallest ring that represents the surroundings of a nucleus.
LEAST_PIXELS = 8


@dataclass(frozen=True)
class Rings:
    """The ring of pixels around each nucleus. The nucleus's colour is compared with the ring's colour."""

    #: Number of the nucleus to whose ring each pixel belongs; 0: no ring.
    labels: Labels
    #: Width of the gap between nucleus and ring, and of the ring, in pixels.
    gap: int
    width: int


def rings_of(nuclei: Nuclei, visible: Mask) -> tuple[Nuclei, Rings, int]:
    """Return the nuclei with a ring of ``visible`` pixels, renumbered, their rings, and the number of other nuclei."""
    from scipy import ndimage

    gap = max(round(GAP * nuclei.width), LEAST_GAP)
    width = max(round(RING * nuclei.width), LEAST_RING)
    distance, (row, column) = ndimage.distance_transform_edt(nuclei.labels == 0, return_indices=True)
    around = (distance > gap) & (distance <= gap + width) & visible
    labels = np.where(around, np.maximum(nuclei.labels[row, column], 0), 0)
    enough = np.bincount(labels.ravel(), minlength=nuclei.count + 1) >= LEAST_PIXELS
    enough[0] = True
    number = np.where(enough, np.cumsum(enough) - 1, -1).astype(np.int32)
    renumbered = np.where(nuclei.labels > 0, number[nuclei.labels], nuclei.labels)
    count = int(enough.sum()) - 1
    rings = Rings(np.maximum(number[labels], 0), gap, width)
    return replace(nuclei, labels=renumbered, count=count), rings, nuclei.count - count


def outlines(labels: Labels) -> NDArray[np.bool_]:
    """Return which pixels of labels above 0 have a neighbour with another label: (rows, columns)."""
    edge = np.zeros(labels.shape, np.bool_)
    for before, after in NEIGHBOURS:
        differs = labels[before] != labels[after]
        edge[before] |= differs
        edge[after] |= differs
    return edge & (labels > 0)


#: Percentiles over nuclei that a report shows.
PERCENT = (5, 25, 50, 75, 95)

#: Number of resamples, and their percentiles that are the ends of an interval.
DRAWS, BETWEEN = 400, (2.5, 97.5)

#: Least number of nuclei for an interval: the scatter of fewer nuclei is not known well enough.
FEWEST = 10

#: Drawn indices in memory at a time, 32 MB.
_HELD = 1 << 22


@dataclass(frozen=True)
class Contrast:
    """ΔE2000 between n nuclei and their rings in one mode, at h hours."""

    #: ΔE2000 on the un-aged display, shape (n,).
    unaged: Array
    #: ΔE2000 on the aged display, shape (h, n).
    aged: Array
    #: Percentiles ``PERCENT`` of ``aged`` over nuclei, shape (h, 5).
    percentiles: Array
    #: Relative change of the median: aged / un-aged − 1, shape (h,); NaN where the un-aged median is 0.
    change: Array
    #: Share of nuclei that lose more than the given loss, shape (h,).
    lost: Array
    #: Ends of the 95 % intervals of median, change and lost, shape (h, 3, 2); None for fewer than ``FEWEST`` nuclei.
    intervals: Array | None

    @property
    def median(self) -> Array:
        """Median of ``aged`` over nuclei, shape (h,)."""
        return np.asarray(self.percentiles[:, PERCENT.index(50)])

    def points(self, hours: Array) -> list[dict[str, Any]]:
        """Return the numbers at each hour, for JSON; null where a number is undefined."""
        named = {f"p{percent}": self.percentiles[:, place] for place, percent in enumerate(PERCENT)}
        named["median"] = named.pop("p50")
        columns = {"hours": hours, **named, "change": self.change, "lost_share": self.lost}
        points = []
        for place in range(len(hours)):
            at = {name: float(values[place]) for name, values in columns.items()}
            point: dict[str, Any] = {name: value if isfinite(value) else None for name, value in at.items()}
            for number, name in enumerate(("median", "change", "lost_share")):
                ends = None if self.intervals is None else self.intervals[place, number]
                point[f"{name}_interval"] = None if ends is None or np.isnan(ends).any() else list(map(float, ends))
            points.append(point)
        return points


def contrast_of(unaged: Array, aged: Array, loss: float) -> Contrast:
    """Return the statistics of n nuclei from their ΔE2000 ``unaged`` (n,) and ``aged`` (h, n); ``loss`` in per cent."""
    losing = aged < (1.0 - loss / 100.0) * unaged
    percentiles = np.percentile(aged, PERCENT, axis=1).T
    change = _change(np.median(aged, axis=1), np.median(unaged))
    intervals = _intervals(unaged, aged, losing) if unaged.size >= FEWEST else None
    return Contrast(unaged, aged, percentiles, change, losing.mean(axis=1), intervals)


def _intervals(unaged: Array, aged: Array, losing: NDArray[np.bool_]) -> Array:
    """Return the ends of the intervals of median, change and share, (h, 3, 2)."""
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


#: Default loss of ΔE2000 in per cent: a report gives the share of nuclei that lose more.
LOSS = 10.0


@dataclass(frozen=True)
class Conspicuity:
    """The result of :func:`nuclei`."""

    field: Field
    #: The compared pixels.
    nuclei: Nuclei
    rings: Rings
    #: Number of nuclei left out because neighbouring nuclei leave no space for a ring.
    ringless: int
    #: Operating hours, increasing from 0, shape (h,).
    hours: Array
    #: Loss in per cent: ``contrasts`` give the share of nuclei that lose more.
    loss: float
    #: Mode → ΔE2000 against hours.
    contrasts: dict[str, Contrast]
    #: The display.
    model: DisplayModel

    def remarks(self) -> list[str]:
        """Return sentences on the viewing conditions of the display; none where the model depends on none."""
        return what_pictures_carry(self.model)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: see ``lutgen/pictures/schema/nuclei.json``."""
        rows, columns = self.field.shape
        return {
            "schema": 1,
            **seen_on(self.model),
            "file": self.field.file,
            "width": columns,
            "height": rows,
            "nuclei": self.nuclei.count,
            "method": self.nuclei.method,
            "left_out": {"small": self.nuclei.small, "large": self.nuclei.large, "without_ring": self.ringless},
            "nucleus_width": self.nuclei.width,
            "ring": {"gap": self.rings.gap, "width": self.rings.width},
            "loss_percent": self.loss,
            "modes": {mode: contrast.points(self.hours) for mode, contrast in self.contrasts.items()},
        }

    def as_csv(self) -> str:
        """Return what ``--csv`` writes: a line for each nucleus with its centre, number of pixels and ΔE2000."""
        from scipy import ndimage

        labels, numbers = self.nuclei.labels, np.arange(1, self.nuclei.count + 1)
        middles = np.array(ndimage.center_of_mass(labels > 0, labels, numbers))
        sizes = [
            np.bincount(each[each > 0], minlength=self.nuclei.count + 1)[1:] for each in (labels, self.rings.labels)
        ]
        displays = list(product(self.contrasts, range(len(self.hours))))
        names = [f"{mode}_{hour_name(self.hours[place])}" for mode, place in displays]
        rows = [["nucleus", "x", "y", "pixels", "ring_pixels", "unaged", *names]]
        unaged = next(iter(self.contrasts.values())).unaged
        for each in range(self.nuclei.count):
            aged = (self.contrasts[mode].aged[place, each] for mode, place in displays)
            where = [f"{middles[each, 1]:.1f}", f"{middles[each, 0]:.1f}", *(str(size[each]) for size in sizes)]
            rows.append([str(each + 1), *where, *(f"{value:.4f}" for value in (unaged[each], *aged))])
        return csv_text(rows)


def nuclei(
    image: str | Path,
    model: DisplayModel,
    *,
    stain: str | None = None,
    mask: str | Path | None = None,
    modes: Sequence[str] = AGING_MODES,
    hours: Sequence[float] | None = None,
    min_area: int | None = None,
    loss: float = LOSS,
    source: str = "auto",
    progress: Progress = unseen,
) -> Conspicuity:
    """Compute the ΔE2000 between nuclei of an image and their surroundings, on the un-aged and on aged displays.

    Parameters
    ----------
    image
        A field of at most 16.8 million pixels: PNG, JPEG, TIFF or EXR, RGB or RGBA.
    model
        The display.
    stain
        ``he``, ``hdab`` or ``auto``; None: ``auto``. Must be None with a mask.
    mask
        PNG or TIFF of the image's size: labels of nuclei, or black and white. None: find nuclei by their stain.
    modes
        Aging modes.
    hours
        Operating hours; None: every measured time. Hour 0 is added.
    min_area
        Pixels of the smallest nucleus; None: computed from the width of a typical nucleus, or with a mask no limit.
    loss
        Loss of ΔE2000 in per cent, above 0 and below 100; the result gives the share of nuclei that lose more.
    source
        Encoding of the image's numbers: ``auto``, ``signal`` or ``linear``, as for ``apply``.
    progress
        Called with the number of displays done and of all displays.

    Raises
    ------
    LutgenError
        The image or the mask cannot be read, their sizes differ, the image has one colour or no nuclei, hours are
        outside the span of the measurements or of the luminance law, or there is neither a mask nor scikit-image.

    """
    refuse_unknown("source", source, SOURCES)
    if mask is not None and stain is not None:
        raise LutgenError("--mask says where the nuclei are: leave --stain out.")
    if min_area is not None and min_area < 1:
        raise LutgenError(f"--min-area {min_area}: give the pixels of the smallest nucleus, at least 1.")
    if not (isfinite(loss) and 0.0 < loss < 100.0):
        raise LutgenError(f"--loss {loss:g}: give the loss in per cent, above 0 and below 100, such as 10.")
    chosen = hours_from_0(model, modes, hours)
    displays = [model.at(mode, hour) for mode, hour in product(modes, chosen)]
    field = read_field(image, source)
    if mask is None:
        segmented = segment(field, stain=stain or "auto", min_area=min_area)
    else:
        segmented = read_mask(mask, field, min_area=min_area)
    segmented, rings, ringless = rings_of(segmented, field.visible)
    if not segmented.count:
        raise LutgenError(
            f"{image}: no nucleus (of {ringless}) has room around it for a ring of {rings.width} pixels. Give a mask "
            "in which nuclei are apart."
        )
    contrast = _contrast(field, segmented, rings)
    unaged = contrast(model.at("stable", 0.0))
    aged = np.empty((len(displays), segmented.count))
    with ThreadPoolExecutor(threads()) as workers:
        for done, row in enumerate(workers.map(contrast, displays)):
            aged[done] = row
            progress(done + 1, len(displays))
    by_mode = aged.reshape(len(modes), len(chosen), segmented.count)
    contrasts = {mode: contrast_of(unaged, part, loss) for mode, part in zip(modes, by_mode, strict=True)}
    return Conspicuity(field, segmented, rings, ringless, np.array(chosen), float(loss), contrasts, model)


def _contrast(field: Field, segmented: Nuclei, rings: Rings) -> Callable[[AgedDisplay], Array]:
    """Return the function that gives ΔE2000 between the mean Lab of each nucleus and of its ring on a display, (n,)."""
    from scipy import sparse

    # Rows 0..n−1 of the matrix are nuclei, rows n..2n−1 are rings.
    part = np.where(rings.labels > 0, rings.labels + segmented.count, np.maximum(segmented.labels, 0))
    within = part > 0
    colours, colour = np.unique(field.keys[within], return_inverse=True)
    rows: NDArray[np.int32] = part[within] - 1
    counts = sparse.coo_matrix((np.ones(rows.size), (rows, colour.ravel())), shape=(2 * segmented.count, len(colours)))
    shares = sparse.diags_array(1.0 / np.bincount(rows)) @ counts.tocsr()

    def contrast(display: AgedDisplay) -> Array:
        lab = np.empty((len(colours), 3))
        for start in range(0, len(lab), CHUNK):
            code = code_of(colours[start : start + CHUNK])
            lab[start : start + CHUNK] = shown_lab(display.xyz(display.head_signal(code)))
        means = np.asarray(shares @ lab)
        return delta_e_2000(means[: len(means) // 2], means[len(means) // 2 :])

    return contrast
