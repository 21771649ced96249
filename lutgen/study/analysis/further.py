"""Beside the paper's tests: those that assume less, and how large the effects are."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING

from lutgen.study.analysis.agreement import odds_ratio
from lutgen.study.analysis.paper_tables import same_measure
from lutgen.study.analysis.statistics import Interval, hedges_g, newcombe, pairs_of, welch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.analysis.agreement import AgreementCounts, ReadingPair
    from lutgen.study.analysis.statistics import StudySample


@dataclass(frozen=True)
class FurtherMeans:
    """Two means once more.

    Attributes
    ----------
    measure, first, second
        What is compared.
    difference, difference_ci95
        second − first, with Welch's interval.
    welch_t, welch_df, welch_p
        Welch's t-test, two-sided: no equal variances assumed.
    rank_p
        Mann–Whitney's, two-sided: no normal distribution assumed; NaN where the answers themselves are not known,
        or all the same.
    hedges_g, hedges_g_ci95
        The difference in standard deviations.

    """

    measure: str
    first: str
    second: str
    difference: float
    difference_ci95: Interval
    welch_t: float
    welch_df: float
    welch_p: float
    rank_p: float
    hedges_g: float
    hedges_g_ci95: Interval


@dataclass(frozen=True)
class McNemar:
    """Images that the same reader read under both conditions: pairs in all, and those that agreed under one alone."""

    pairs: int
    first_only: int
    second_only: int
    p: float


@dataclass(frozen=True)
class FurtherAgreement:
    """Two shares of agreement once more.

    Attributes
    ----------
    first, second
        What is compared.
    fisher_one_tailed, fisher
        p of Fisher's exact test that ``first`` agrees more often, and of the two-sided one.
    difference, difference_ci95
        second − first in percentage points, with Newcombe's interval.
    odds_ratio, odds_ratio_ci95
        Odds of agreeing, second over first.
    mcnemar
        Exact, two-sided, where the same reader read the same images under both conditions; else None.

    """

    first: str
    second: str
    fisher_one_tailed: float
    fisher: float
    difference: float
    difference_ci95: Interval
    odds_ratio: float
    odds_ratio_ci95: Interval
    mcnemar: McNemar | None


def further_means(samples: Sequence[StudySample]) -> tuple[FurtherMeans, ...]:
    """Compare means once more, pair by pair."""
    return tuple(_means(first, second) for first, second in same_measure(samples))


def _means(first: StudySample, second: StudySample) -> FurtherMeans:
    from scipy.stats import t as student

    t, df, p = map(float, welch(second, first))
    difference = second.mean - first.mean
    half = float(student.ppf(0.975, df)) * (first.sd**2 / first.n + second.sd**2 / second.n) ** 0.5
    g, g_ci95 = hedges_g(first, second)
    return FurtherMeans(
        first.measure,
        first.condition,
        second.condition,
        difference,
        (difference - half, difference + half),
        t,
        df,
        p,
        _rank_p(first, second),
        g,
        g_ci95,
    )


def _rank_p(first: StudySample, second: StudySample) -> float:
    if len({*first.values, *second.values}) < 2:
        return nan
    from scipy.stats import mannwhitneyu

    # Exact where a sample is of 8 or fewer and no two values are alike, else asymptotic.
    return float(mannwhitneyu(first.values, second.values, alternative="two-sided", method="auto").pvalue)


def further_agreement(
    rows: Sequence[AgreementCounts], reading_pairs: Sequence[ReadingPair] = ()
) -> tuple[FurtherAgreement, ...]:
    """Compare shares of agreement once more, condition by condition; without ``reading_pairs`` no test is paired."""
    return tuple(_agreement(first, second, reading_pairs) for first, second in pairs_of(rows))


def _agreement(
    first: AgreementCounts, second: AgreementCounts, reading_pairs: Sequence[ReadingPair]
) -> FurtherAgreement:
    from scipy.stats import fisher_exact

    table = [[first.agreed, first.disagreed], [second.agreed, second.disagreed]]
    low, high = newcombe((second.agreed, second.n), (first.agreed, first.n))
    odds, odds_ci95 = odds_ratio(first, second)
    return FurtherAgreement(
        first.condition,
        second.condition,
        float(fisher_exact(table, alternative="greater").pvalue),
        float(fisher_exact(table).pvalue),
        100 * (second.share - first.share),
        (100 * low, 100 * high),
        odds,
        odds_ci95,
        _mcnemar(first.condition, second.condition, reading_pairs),
    )


def _mcnemar(first: str, second: str, reading_pairs: Sequence[ReadingPair]) -> McNemar | None:
    """Exact test on the images of which a reader agreed under one condition and not under the other."""
    from scipy.stats import binomtest

    agreed: dict[str, dict[tuple[str, str], bool]] = {first: {}, second: {}}
    for pair in reading_pairs:
        if pair.answer.condition in agreed:
            # The first of several readings under one condition: one pair an image and reader.
            agreed[pair.answer.condition].setdefault((pair.answer.reader, pair.answer.image), pair.agreed)
    both = sorted(agreed[first].keys() & agreed[second].keys())
    if not both:
        return None
    first_only = sum(agreed[first][key] and not agreed[second][key] for key in both)
    second_only = sum(agreed[second][key] and not agreed[first][key] for key in both)
    apart = first_only + second_only
    return McNemar(len(both), first_only, second_only, float(binomtest(first_only, apart).pvalue) if apart else 1.0)
