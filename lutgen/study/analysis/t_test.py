"""Two-sample tests from n, mean and SD alone: Student's t, pooled as in the paper; Welch's; F of the variances.

All take arrays too, study by study, so that thousands of simulated studies take a moment. Where both samples have no
variance there is nothing to test by, and p is NaN.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from lutgen.colorimetry import Array


class Figures(NamedTuple):
    """Answers, mean and SD: numbers, or arrays with an entry a study. A ``Sample`` has them too."""

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
        Anything with n, mean and sd: ``Figures``, ``Sample``.
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
