"""Replicates that cannot all be right: outliers in their group, and pairs that contradict each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.noise.replicates import ENOUGH, FLOOR_CD_M2, patch_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.noise.digits import Digits
    from lutgen.readings import Measurements

#: A replicate further than this many robust sigmas from the others is an outlier, not noise.
OUTLIER_SIGMA = 12.0

#: One of two contradictory replicates is an outlier if it differs from the patch at other hours by more than this
#: factor times the difference of the other replicate.
UNLIKE = 3.0


def wrong_replicates(
    xyz: Array, groups: NDArray[np.intp], start: tuple[float, float], digits: Digits
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the replicates that are further from their group than noise explains, and the contradictory pairs.

    In a group of three or more, the median shows which replicate is wrong. With only two replicates the median cannot
    show it; both are left out of the noise estimate if they contradict each other. ``start``: relative part and floor,
    cd/m², of an ordinary meter's noise. The rounding to ``digits`` may move two replicates apart by one step, and one
    of several by one step from their median.
    """
    deviations, beyond_step, rows = [], [], []
    for group in np.flatnonzero(np.bincount(groups) >= 2):
        here = np.flatnonzero(groups == group)
        middle = np.median(xyz[here], axis=0)
        sigma = np.sqrt((start[0] * middle) ** 2 + start[1] ** 2)
        off, step = np.abs(xyz[here] - middle), digits.farthest(middle[np.newaxis])[0]
        deviations.append((np.maximum(off - (step / 2.0 if here.size == 2 else 0.0), 0.0) / sigma).max(axis=1))
        beyond_step.append((np.maximum(off - step, 0.0) / sigma).max(axis=1))
        rows.append(here)
    # The scale comes from the data: the median over groups of the second largest deviation, robust against one outlier.
    # If there are few groups of two, leave them out of this median: a contradictory pair would inflate the scale.
    large = [each for each in deviations if each.size >= 3]
    seconds = [np.sort(each)[-2] for each in (deviations if len(deviations) - len(large) >= ENOUGH else large)]
    scale = max(float(np.median(seconds)), 0.05) if seconds else np.inf
    outliers: list[int] = []
    contradictory: list[int] = []
    for each, beyond, here in zip(deviations, beyond_step, rows, strict=True):
        order = np.argsort(each)
        if here.size == 2 and each[0] > OUTLIER_SIGMA * scale:
            contradictory += here.tolist()
        elif here.size > 2 and beyond[order[-1]] > OUTLIER_SIGMA * max(scale, each[order[-2]]):
            outliers.append(int(here[order[-1]]))
    return tuple(outliers), tuple(contradictory)


def unlike_other_hours(readings: Measurements, contradictory: Sequence[int]) -> tuple[int, ...]:
    """Return of each pair the reading that differs from the patch at other hours ``UNLIKE`` times as much as the other.

    ``contradictory``: the pairs, one after another. A pair without such a reading is left out.
    """
    wrong = []
    patch, xyz = patch_numbers(readings), readings.xyz_cd_m2
    for pair in zip(contradictory[::2], contradictory[1::2], strict=True):
        others = np.setdiff1d(np.flatnonzero(patch == patch[pair[0]]), contradictory)
        if others.size:
            light = np.abs(xyz[others]) + FLOOR_CD_M2
            near, far = sorted((float((np.abs(xyz[row] - xyz[others]) / light).max(axis=1).min()), row) for row in pair)
            if far[0] > UNLIKE * near[0]:
                wrong.append(far[1])
    return tuple(wrong)
