"""Colour differences in a few numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
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


def figures(error: Array) -> Figures:
    """Summarise ΔE2000 values, shape (n,)."""
    if not error.size:
        return Figures(0, 0.0, 0.0, 0.0)
    return Figures(error.size, float(error.mean()), float(np.quantile(error, 0.99)), float(error.max()))


def rounded(value: Any) -> Any:
    """Round all numbers in a tree of dictionaries to what float32 LUTs can mean."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return round(value, 6) if isinstance(value, float) else value
