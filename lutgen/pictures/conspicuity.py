"""``nuclei``: how clearly nuclei stand out from what surrounds them, and how much of that an aged display leaves.

The abstract of the paper announces it: conspicuity of nuclei by ΔE2000. Here, for each nucleus, ΔE2000 between its mean
Lab and the mean Lab of a ring around it, both as a display shows them (:mod:`lutgen.pictures.difference`): un-aged
against aged. It is a contrast of mean colours: no texture, no edge, no reader; what segmentation gets wrong is in it.

A mean over pixels is a weighted mean over distinct colours: aged Lab is computed once a colour and display, and one
sparse matrix, colours × (nuclei and rings), holds how often each occurs where.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import CHUNK, delta_e_2000
from lutgen.display import seen_on, what_pictures_carry
from lutgen.display.hours import MAX_HOURS
from lutgen.errors import LutgenError, pick_one
from lutgen.names import AGING_MODES, SOURCES
from lutgen.pictures.contrast import Contrast, check_loss, contrast_of, rings_of
from lutgen.pictures.difference import shown_lab
from lutgen.pictures.field import code_of, read_field
from lutgen.pictures.nuclei import read_mask, segment
from lutgen.pictures.threads import threads

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay, DisplayModel
    from lutgen.pictures.contrast import Rings
    from lutgen.pictures.field import Field
    from lutgen.pictures.nuclei import Nuclei

#: Loss of ΔE2000 in per cent whose share of nuclei is told.
LOSS = 10.0


@dataclass(frozen=True)
class Conspicuity:
    """What :func:`nuclei` found.

    Attributes
    ----------
    field
        The image.
    nuclei, rings
        Which pixels were compared.
    ringless
        Nuclei left out because others leave no room for a ring.
    colours
        Distinct colours in nuclei and rings.
    hours
        Operating hours, increasing from 0, shape (h,).
    loss
        Loss in per cent whose share of nuclei is told.
    contrasts
        Mode → ΔE2000 against hours.
    model
        The display.

    """

    field: Field
    nuclei: Nuclei
    rings: Rings
    ringless: int
    colours: int
    hours: Array
    loss: float
    contrasts: dict[str, Contrast]
    model: DisplayModel

    def remarks(self) -> list[str]:
        """Say under which conditions the display was seen: sentences, none where nothing depends on them."""
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
            "found": self.nuclei.found,
            "left_out": {"small": self.nuclei.small, "large": self.nuclei.large, "without_ring": self.ringless},
            "nucleus_width": self.nuclei.width,
            "ring": {"gap": self.rings.gap, "width": self.rings.width},
            "loss_percent": self.loss,
            "modes": {mode: contrast.points(self.hours) for mode, contrast in self.contrasts.items()},
        }

    def as_csv(self) -> str:
        """Return what ``--csv`` writes: a line a nucleus, with its middle, its pixels and its ΔE2000."""
        from scipy import ndimage

        labels, numbers = self.nuclei.labels, np.arange(1, self.nuclei.count + 1)
        middles = np.array(ndimage.center_of_mass(labels > 0, labels, numbers))
        sizes = [
            np.bincount(each[each > 0], minlength=self.nuclei.count + 1)[1:] for each in (labels, self.rings.labels)
        ]
        displays = list(product(self.contrasts, range(len(self.hours))))
        names = [f"{mode}_{self.hours[place]:g}h" for mode, place in displays]
        lines = [",".join(["nucleus", "x", "y", "pixels", "ring_pixels", "unaged", *names])]
        unaged = next(iter(self.contrasts.values())).unaged
        for each in range(self.nuclei.count):
            aged = (self.contrasts[mode].aged[place, each] for mode, place in displays)
            where = [f"{middles[each, 1]:.1f}", f"{middles[each, 0]:.1f}", *(str(size[each]) for size in sizes)]
            lines.append(",".join([str(each + 1), *where, *(f"{value:.4f}" for value in (unaged[each], *aged))]))
        return "\n".join([*lines, ""])


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
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Conspicuity:
    """Find how clearly the nuclei of an image stand out, on the un-aged display and on aged ones.

    Parameters
    ----------
    image
        A field of at most 16.8 million pixels: PNG, JPEG, TIFF or EXR, RGB or RGBA.
    model
        The display.
    stain
        ``he``, ``hdab`` or ``auto``; None: ``auto``. Nothing may be said of it with a mask.
    mask
        PNG or TIFF of the image's size: labels of nuclei, or black and white. None: nuclei are found by their stain.
    modes
        Aging modes.
    hours
        Operating hours; None: every measured time. Hour 0 is added.
    min_area
        Pixels of the smallest nucleus; None: from a typical one's width; with a mask, all.
    loss
        Loss of ΔE2000 in per cent, above 0 and below 100, whose share of nuclei is told.
    source
        What the numbers of the image are: ``auto``, ``signal`` or ``linear``, as for ``apply``.
    progress
        Called with the displays done and the displays in all.

    Raises
    ------
    LutgenError
        An image or a mask that cannot be read or do not fit together, an image of one colour or without nuclei, hours
        outside the measured span or the luminance law's, or scikit-image is missing where nuclei are to be found.

    """
    if source not in SOURCES:
        raise pick_one("source", source, SOURCES)
    if mask is not None and stain is not None:
        raise LutgenError("--mask says where the nuclei are: leave --stain out.")
    if min_area is not None and min_area < 1:
        raise LutgenError(f"--min-area {min_area}: give the pixels of the smallest nucleus, at least 1.")
    check_loss(loss)
    chosen = sorted({0.0, *map(float, model.tips.hours if hours is None else hours)})
    if len(chosen) > MAX_HOURS:
        raise LutgenError(f"{len(chosen)} hours are more than {MAX_HOURS}. Give fewer.")
    displays = [model.at(mode, hour) for mode, hour in product(modes, chosen)]
    field = read_field(image, source)
    if mask is None:
        segmented = segment(field, stain=stain or "auto", min_area=min_area)
    else:
        segmented = read_mask(mask, field, min_area=min_area)
    segmented, rings, ringless = rings_of(segmented, field.visible)
    if not segmented.count:
        message = (
            f"{image}: no nucleus (of {ringless}) has room around it for a ring of {rings.width} pixels. Give a mask "
            "in which nuclei are apart."
        )
        raise LutgenError(message)
    means = _Means(field, segmented, rings)
    unaged = means.apart(model.at("stable", 0.0))
    aged = np.empty((len(displays), segmented.count))
    with ThreadPoolExecutor(threads()) as workers:
        for done, row in enumerate(workers.map(means.apart, displays)):
            aged[done] = row
            progress(done + 1, len(displays))
    by_mode = aged.reshape(len(modes), len(chosen), segmented.count)
    contrasts = {mode: contrast_of(unaged, part, loss) for mode, part in zip(modes, by_mode, strict=True)}
    return Conspicuity(
        field, segmented, rings, ringless, len(means.colours), np.array(chosen), float(loss), contrasts, model
    )


class _Means:
    """Mean Lab of nuclei and rings on any display, from their distinct colours."""

    def __init__(self, field: Field, segmented: Nuclei, rings: Rings) -> None:
        from scipy import sparse

        # Rings follow the nuclei: rows 0..n−1 and n..2n−1.
        part = np.where(rings.labels > 0, rings.labels + segmented.count, np.maximum(segmented.labels, 0))
        within = part > 0
        self.colours, colour = np.unique(field.keys[within], return_inverse=True)
        rows: NDArray[np.int32] = part[within] - 1
        counts = sparse.coo_matrix(
            (np.ones(rows.size), (rows, colour.ravel())), shape=(2 * segmented.count, len(self.colours))
        ).tocsr()
        self._shares = sparse.diags_array(1.0 / np.bincount(rows)) @ counts

    def apart(self, display: AgedDisplay) -> Array:
        """ΔE2000 between the means of each nucleus and its ring, (n,)."""
        lab = np.empty((len(self.colours), 3))
        for start in range(0, len(lab), CHUNK):
            code = code_of(self.colours[start : start + CHUNK])
            lab[start : start + CHUNK] = shown_lab(display.xyz(display.head_signal(code)))
        means = np.asarray(self._shares @ lab)
        return delta_e_2000(means[: len(means) // 2], means[len(means) // 2 :])
