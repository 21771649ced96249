"""Intervals of 95 %: of a mean, of a share, and of the difference of two shares."""

from __future__ import annotations

from math import nan, sqrt
from statistics import NormalDist
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lutgen.study.analysis.sample import Sample

#: Low and high end.
Interval = tuple[float, float]

#: The two-sided 95 % quantile of the normal distribution, 1.96.
Z = NormalDist().inv_cdf(0.975)


def half_width(n: int, kind: str = "normal") -> float:
    """Half the width of a mean's interval in standard deviations; NaN for fewer than two answers."""
    if n < 2:
        return nan
    if kind == "normal":
        return Z / sqrt(n)
    from scipy.stats import t

    return float(t.ppf(0.975, n - 1)) / sqrt(n)


def mean_interval(sample: Sample, kind: str = "normal") -> Interval:
    """Interval of a sample's mean, of a kind of ``INTERVALS``."""
    half = half_width(sample.n, kind) * sample.sd
    return sample.mean - half, sample.mean + half


def wilson(count: int, n: int) -> Interval:
    """Score interval of a share (Wilson 1927, doi:10.1080/01621459.1927.10502953), no continuity correction.

    Parameters
    ----------
    count, n
        How many of how many, n ≥ 1.

    """
    share, weight = count / n, Z**2 / n
    middle = (share + weight / 2) / (1 + weight)
    half = sqrt(weight * (share * (1 - share) + weight / 4)) / (1 + weight)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def newcombe(first: tuple[int, int], second: tuple[int, int]) -> Interval:
    """Interval of the difference of two shares, first − second, each (count, n).

    Method 10 of Newcombe 1998, doi:10.1002/(SICI)1097-0258(19980430)17:8<873::AID-SIM779>3.0.CO;2-I: the two Wilson
    intervals, put together.
    """
    (one, low_1, high_1), (two, low_2, high_2) = ((k / n, *wilson(k, n)) for k, n in (first, second))
    difference = one - two
    return (
        difference - sqrt((one - low_1) ** 2 + (high_2 - two) ** 2),
        difference + sqrt((high_1 - one) ** 2 + (two - low_2) ** 2),
    )
