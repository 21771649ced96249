"""Whether curves of a native display come from greys or from ramps of single channels, if no mixtures can judge them.

On most displays mixtures, and greys too, are brighter than the sum of their channels: curves from ramps are then wrong
for both. On an additive display ramps, which have more readings, give the better curves, also between the greys.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lutgen.display.own_model.ladder import errors_of
from lutgen.display.own_model.native_curves import Curves3, added_up
from lutgen.display.own_model.sample import FOLDS, Sample
from lutgen.errors import LutgenError

#: Ramps are used if their error on greys is at most this share of the error of curves from the other greys.
CLEARLY = 0.5

#: Curves from a source, "greys" or "ramps", without the readings (indices of the sample) that are left out. Raises
#: LutgenError: the source has too few levels, or falls.
CurvesFrom = Callable[[str, Sequence[int]], Curves3]


def by_greys(sample: Sample, is_grey: NDArray[np.bool_], curves_from: CurvesFrom) -> str:
    """Return "ramps" if they predict the greys clearly better than curves from the other greys do, otherwise "greys".

    Five-fold cross-validation by level gives the error of curves from the other greys. ``is_grey``: greys between black
    and white, (n,).
    """
    level = np.unique(sample.drive[is_grey, 0], return_inverse=True)[1].reshape(-1)
    if level.max(initial=0) < FOLDS:
        return "ramps"
    greys = np.flatnonzero(is_grey)
    by_others = sample.share.copy()
    try:
        for fold in range(FOLDS):
            out = greys[level % FOLDS == fold]
            by_others[out] = added_up(sample, curves_from("greys", out.tolist()), sample.drive[out])
        by_ramps = added_up(sample, curves_from("ramps", ()), sample.drive)
    except LutgenError:
        return "ramps"
    other, own = (float(errors_of(sample, share)[is_grey].mean()) for share in (by_others, by_ramps))
    return "ramps" if own <= CLEARLY * other else "greys"
