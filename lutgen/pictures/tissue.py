"""Tissue apart from the bare glass around it, by the lightness of an image's distinct colours.

The threshold is Otsu's (1979, doi:10.1109/TSMC.1979.4310076) on the histogram of CIE L* of all pixels. It cuts every
image in two, a field full of tissue too; so the bright part is left out only where it looks like bare glass in bright
field: bright, nearly without colour, and clearly apart from the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import CHUNK, code_to_linear, linear_to_lab
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.pictures.distinct import Colours

#: Bins of the histogram of L*, 0..100.
BINS = 256

#: Bare glass has at least this L* and at most this chroma C*ab, on average; a scanner's white has 90 and 5.
GLASS_L, GLASS_C = 80.0, 12.0

#: Glass and tissue lie at least this far apart in L*, on average; the noise of a scanner alone gives about 3.
CONTRAST = 8.0


@dataclass(frozen=True)
class Tissue:
    """What was left out.

    Attributes
    ----------
    threshold
        L* above which pixels are glass; None where no glass was found and nothing was left out.
    left_out_share
        Share of pixels left out.

    """

    threshold: float | None
    left_out_share: float


def tissue_only(colours: Colours, path: Path) -> tuple[Colours, Tissue]:
    """Leave out the colours of bare glass. Raises LutgenError where nothing else is in the image."""
    bins, sums = _histogram(colours)
    first = otsu(sums[:, 3])
    whole, rest, glass = (_mean(part) for part in (sums, sums[:first], sums[first:]))
    # Written so that a class without pixels, NaN, is no contrast.
    if not glass[0] - rest[0] >= CONTRAST:
        if _like_glass(whole):
            message = (
                f"{path}: no tissue was found: all of it is bright and without colour, like bare glass (L* "
                f"{whole[0]:.0f}). Leave --tissue out to take the image whole."
            )
            raise LutgenError(message)
        return colours, Tissue(None, 0.0)
    if not _like_glass(glass):
        return colours, Tissue(None, 0.0)
    tissue = bins < first
    kept = replace(colours, keys=colours.keys[tissue], counts=colours.counts[tissue])
    return kept, Tissue(first * 100.0 / BINS, 1.0 - kept.pixels / colours.pixels)


def otsu(histogram: Array) -> int:
    """Return the bin that begins the bright class: both classes' variances between them are largest; (bins,) → index.

    A histogram of one bin has no classes: that bin then begins the bright one.
    """
    places = np.arange(len(histogram))
    dark, dark_sum = np.cumsum(histogram), np.cumsum(histogram * places)
    bright, bright_sum = dark[-1] - dark, dark_sum[-1] - dark_sum
    between = (dark > 0) & (bright > 0)
    if not between.any():
        return int(np.argmax(histogram))
    apart = dark_sum / np.where(between, dark, 1.0) - bright_sum / np.where(between, bright, 1.0)
    return int(np.argmax(np.where(between, dark * bright * apart**2, -1.0))) + 1


def _histogram(colours: Colours) -> tuple[NDArray[np.uint8], Array]:
    """Bin of each colour, (n,), and of each bin the sums of L*, a*, b* and 1 over its pixels, (BINS, 4)."""
    bins, sums = np.empty(len(colours), np.uint8), np.zeros((BINS, 4))
    for start in range(0, len(colours), CHUNK):
        part = slice(start, start + CHUNK)
        lab, counts = linear_to_lab(code_to_linear(colours.code(part))), colours.counts[part]
        bins[part] = np.clip(lab[:, 0] * (BINS / 100.0), 0, BINS - 1)
        for place, values in enumerate((*lab.T, np.ones(len(lab)))):
            sums[:, place] += np.bincount(bins[part], values * counts, BINS)
    return bins, sums


def _mean(sums: Array) -> Array:
    """Mean L*, a*, b* of the pixels in some bins, shape (3,); NaN of none."""
    total = sums.sum(axis=0)
    return np.asarray(total[:3] / total[3]) if total[3] else np.full(3, np.nan)


def _like_glass(lab: Array) -> bool:
    return bool(lab[0] >= GLASS_L and np.hypot(lab[1], lab[2]) <= GLASS_C)
