"""What surrounds each nucleus: a ring of cytoplasm or stroma, near it and near no other nucleus."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

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
