"""Sizes of effects with 95 % intervals: Hedges' g, and the odds ratio."""

from __future__ import annotations

from math import exp, lgamma, nan, sqrt
from typing import TYPE_CHECKING

from lutgen.study.analysis.intervals import Interval, Z
from lutgen.study.analysis.t_test import pooled

if TYPE_CHECKING:
    from lutgen.study.analysis.agreement import Counts
    from lutgen.study.analysis.sample import Sample

#: An effect and its interval; NaN where there is none.
Sized = tuple[float, Interval]


def hedges_g(first: Sample, second: Sample) -> Sized:
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


def odds_ratio(first: Counts, second: Counts) -> Sized:
    """Odds of agreeing, second over first, with the exact conditional interval (Cornfield 1956; as R's fisher.test).

    NaN or infinite where a count is 0.
    """
    from scipy.stats.contingency import odds_ratio as conditional

    found = conditional([[second.agreed, second.disagreed], [first.agreed, first.disagreed]])
    low, high = found.confidence_interval(0.95)
    return float(found.statistic), (float(low), float(high))
