"""Statistics of two samples, from their answers or from n, mean and SD alone: intervals, tests, sizes of effects.

The tests take arrays too, study by study, so that thousands of simulated studies take a moment. Where both samples have
no variance there is nothing to test by, and p is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import exp, lgamma, nan, sqrt
from statistics import NormalDist, fmean, stdev
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lutgen.colorimetry import Array

Item = TypeVar("Item")

#: What is measured beside the diagnosis → what it is and its unit: the paper's TTS and EOR.
MEASURES = {"time": "time to score, s", "ease": "ease of reading"}


@dataclass(frozen=True)
class StudySample:
    """One measure under one condition.

    Attributes
    ----------
    measure
        A key of ``MEASURES``.
    condition
        How images were shown.
    n, mean, sd
        Answers, their mean, and their standard deviation with n − 1; NaN where n does not allow it.
    values
        The answers themselves; empty where only figures are known.

    """

    measure: str
    condition: str
    n: int
    mean: float
    sd: float
    values: tuple[float, ...] = ()


def sample_of(measure: str, condition: str, values: Sequence[float]) -> StudySample:
    """Make the sample of at least one answer."""
    sd = stdev(values) if len(values) > 1 else float("nan")
    return StudySample(measure, condition, len(values), fmean(values), sd, tuple(map(float, values)))


def pairs_of(items: Iterable[Item]) -> list[tuple[Item, Item]]:
    """Return every item with every later one: conditions are compared in their order, the un-aged one first."""
    return list(combinations(items, 2))


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


def mean_interval(sample: StudySample, kind: str = "normal") -> Interval:
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


class SampleFigures(NamedTuple):
    """Answers, mean and SD: numbers, or arrays with an entry a study. A ``StudySample`` has them too."""

    n: Any
    mean: Any
    sd: Any


class Tested(NamedTuple):
    """Statistic, degrees of freedom and p."""

    t: Array
    df: Array
    p: Array


def pooled(first: Any, second: Any, *, one_tailed: bool = False) -> Tested:
    """Student's two-sample t of equal variances.

    Parameters
    ----------
    first, second
        Anything with n, mean and sd: ``SampleFigures``, ``StudySample``.
    one_tailed
        p is that of a larger mean of ``first``; else of a different one.

    """
    df = np.asarray(first.n + second.n - 2, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = ((first.n - 1) * np.square(first.sd) + (second.n - 1) * np.square(second.sd)) / df
        error = np.sqrt(variance * (1 / first.n + 1 / second.n))
        return _tested(first.mean - second.mean, error, df, one_tailed=one_tailed)


def welch(first: Any, second: Any) -> Tested:
    """Welch's t of unequal variances, two-sided, with Satterthwaite's degrees of freedom; parameters as ``pooled``."""
    one, two = np.square(first.sd) / first.n, np.square(second.sd) / second.n
    with np.errstate(divide="ignore", invalid="ignore"):
        df = (one + two) ** 2 / (one**2 / (first.n - 1) + two**2 / (second.n - 1))
        return _tested(first.mean - second.mean, np.sqrt(one + two), df, one_tailed=False)


def _tested(difference: Any, error: Any, df: Any, *, one_tailed: bool) -> Tested:
    from scipy.special import stdtr

    t = np.where(error > 0, difference / np.where(error > 0, error, 1.0), np.nan)
    return Tested(t, np.asarray(df), stdtr(df, -t) if one_tailed else 2 * stdtr(df, -np.abs(t)))


def equal_variances(first: Any, second: Any) -> Array:
    """F-test of equal variances: its two-sided p; parameters as ``pooled``."""
    from scipy.special import fdtr, fdtrc

    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.square(first.sd) / np.square(second.sd)
    df = (first.n - 1, second.n - 1)
    return np.asarray(np.minimum(2 * np.minimum(fdtr(*df, ratio), fdtrc(*df, ratio)), 1.0))


#: An effect and its interval; NaN where there is none.
Sized = tuple[float, Interval]


def hedges_g(first: StudySample, second: StudySample) -> Sized:
    """Difference of means, second − first, in pooled standard deviations, without the bias of small samples.

    Hedges 1981, doi:10.3102/10769986006002107, with the exact factor; the interval by the large-sample variance of
    Hedges & Olkin 1985, Statistical Methods for Meta-Analysis, chapter 5.
    """
    t, df, _ = map(float, pooled(second, first))
    shares = 1 / first.n + 1 / second.n
    factor = _gamma_ratio(df) if df > 1 else nan
    g = factor * t * sqrt(shares)
    half = Z * sqrt(shares + g**2 / (2 * (first.n + second.n)))
    return g, (g - half, g + half)


def _gamma_ratio(df: float) -> float:
    """c(df) = Γ(df/2) / (√(df/2) Γ((df − 1)/2)), about 1 − 3/(4 df − 1)."""
    return exp(lgamma(df / 2) - lgamma((df - 1) / 2)) / sqrt(df / 2)
