"""The median over slides, and its 95 % interval.

The interval of a median lies between two of the slides' own values, by their order (Conover, Practical Nonparametric
Statistics, 3rd ed., section 3.2): nothing is assumed of how slides differ but that they were drawn independently. A
lifetime that is never reached is longer than all others; it takes part in the order and is not left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, inf
from typing import TYPE_CHECKING

import numpy as np

from lutgen.pictures.difference import STATISTICS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.pictures.difference import DifferenceCurve

#: Confidence of the interval of a median. Fewer than six slides cannot reach it, and get no interval.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Lives:
    """Lifetimes of several slides, in hours; None for each that is beyond the hours that were looked at.

    Attributes
    ----------
    median
        The median. Of an even number the mean of the two in the middle; None where one of these is never reached.
    interval
        95 % interval of the median, its ends either of them None as above; None for fewer than six slides.
    range
        The shortest and the longest.
    reached
        How many slides reach the tolerance.

    """

    median: float | None
    interval: tuple[float | None, float | None] | None
    range: tuple[float | None, float | None]
    reached: int


@dataclass(frozen=True)
class Band:
    """A statistic of ΔE2000 over several slides at each hour, shape (h,): the median and the range."""

    median: Array
    low: Array
    high: Array


def lives_of(lives: Sequence[float | None]) -> Lives:
    """Bring the lifetimes of at least one slide together."""
    ordered = sorted(inf if life is None else life for life in lives)
    size, half = len(ordered), len(ordered) // 2
    median = ordered[half] if size % 2 else (ordered[half - 1] + ordered[half]) / 2.0
    outside = left_out(size)
    interval = None if outside is None else (_finite(ordered[outside]), _finite(ordered[-1 - outside]))
    reached = sum(life is not None for life in lives)
    return Lives(_finite(median), interval, (_finite(ordered[0]), _finite(ordered[-1])), reached)


def left_out(size: int) -> int | None:
    """Return how many of ``size`` ordered values lie outside the interval of the median at either end; None: no 95 %.

    The probability that the median lies below the (k + 1)-th value is that of at most k heads in ``size`` tosses of a
    coin.
    """
    below, outside = 0, None
    for k in range(size // 2):
        below += comb(size, k)
        # Integers, since 2 to the power of some thousand slides is no float.
        if 2 * below * 1000 > round((1.0 - CONFIDENCE) * 1000) * 2**size:
            break
        outside = k
    return outside


def coverage(size: int) -> float | None:
    """Return the chance that the interval of ``size`` slides holds the median, at least 95 %; None: there is none."""
    outside = left_out(size)
    if outside is None:
        return None
    return float(1.0 - 2 * sum(comb(size, k) for k in range(outside + 1)) / 2**size)


def bands_of(curves: Sequence[DifferenceCurve]) -> dict[str, Band]:
    """Bring the curves of at least one slide together: statistic → band."""
    bands = {}
    for name in STATISTICS:
        values = np.array([getattr(curve, name) for curve in curves])
        bands[name] = Band(np.median(values, axis=0), values.min(axis=0), values.max(axis=0))
    return bands


def _finite(hours: float) -> float | None:
    return None if hours == inf else hours
