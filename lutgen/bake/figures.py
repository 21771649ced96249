"""The summary of many colour differences: mean, 99 % quantile and maximum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array


#: What a .cube of 33³ keeps on any plausible display where colours are smooth: largest ΔE2000, and 99 % quantile.
MAX_DELTA_E, P99 = 1.0, 0.2


@dataclass(frozen=True)
class Figures:
    """ΔE2000 over ``colours`` colours: mean, 99 % quantile and maximum; all 0 where there are none."""

    colours: int
    mean: float
    p99: float
    max: float


def figures(error: Array, usual: NDArray[np.bool_] | None = None) -> Figures:
    """Summarise ΔE2000 values, shape (n,).

    ``usual``, (n,): which of them tell the mean and the quantile, where there are any; colours that were added to find
    the largest error do not.
    """
    if not error.size:
        return Figures(0, 0.0, 0.0, 0.0)
    spread = error if usual is None or not usual.any() else error[usual]
    return Figures(error.size, float(spread.mean()), float(np.quantile(spread, 0.99)), float(error.max()))


def rounded(value: Any) -> Any:
    """Round all numbers in a tree of dictionaries to the precision of float32 LUTs."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return round(value, 6) if isinstance(value, float) else value
