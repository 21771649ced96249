"""The paper's Tables 2 to 4: time and ease with t-tests, agreement between sessions, and tests on agreement.

The tests of Table 2 are two-sample t-tests: unpaired, equal variances, two-sided. Among the interpretations of section
3.2, only this interpretation gives the paper's four p-values from its means and intervals; the intervals are then
± 1.96 SD/√n with n = 39 un-aged images. The tests of Table 4 are one-tailed t-tests on a 1 or a 0 for each pair of
readings; an F-test checks that the variances are equal. All tests are corrected together, as one family (Holm 1979,
Scandinavian Journal of Statistics 6:65).

Further tests assume less (Welch, ranks, exact, paired), and the sizes of the effects are given.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isfinite, nan

from lutgen.study import statistics
from lutgen.study.answers import Answer
from lutgen.study.statistics import hedges_g, odds_ratio


@dataclass(frozen=True)
class Mean:
    """A cell of Table 2."""

    measure: str
    condition: str
    n: int
    mean: float
    sd: float
    ci95: statistics.Interval


@dataclass(frozen=True)
class MeanTest:
    """A test of two means: ``difference`` is ``second`` − ``first``, p is from a pooled two-sided t-test."""

    measure: str
    first: str
    second: str
    difference: float
    t: float
    df: float
    p: float


@dataclass(frozen=True)
class Table2:
    """Table 2, and the tests in the paper's text below it."""

    means: tuple[Mean, ...]
    tests: tuple[MeanTest, ...]


def samples(conditions: Sequence[str], answers: Sequence[Answer]) -> tuple[statistics.StudySample, ...]:
    """Return time and ease by condition, from the sessions with aged images; from all sessions if there are none."""
    mixed = statistics.mixed_sessions(answers)
    taken = [answer for answer in answers if (answer.reader, answer.session) in mixed] or list(answers)
    collected = []
    for measure in statistics.MEASURES:
        for condition in conditions:
            shown = [answer for answer in taken if answer.condition == condition]
            values = [answer.seconds if measure == "time" else float(answer.ease) for answer in shown]
            if values:
                collected.append(statistics.sample_of(measure, condition, values))
    return tuple(collected)


def table_2(measured: Sequence[statistics.StudySample], *, ci: str = "normal") -> Table2:
    """Return the table and its tests for samples, in their order; ``ci`` is a key of ``INTERVALS``."""
    means = tuple(
        Mean(each.measure, each.condition, each.n, each.mean, each.sd, statistics.mean_interval(each, ci))
        for each in measured
    )
    tests = []
    for first, second in same_measure(measured):
        t, df, p = map(float, statistics.pooled(second, first))
        difference = second.mean - first.mean
        tests.append(MeanTest(first.measure, first.condition, second.condition, difference, t, df, p))
    return Table2(means, tuple(tests))


def same_measure(
    measured: Sequence[statistics.StudySample],
) -> list[tuple[statistics.StudySample, statistics.StudySample]]:
    """Return each pair of conditions for each measure, if both samples have a variance."""
    return [
        pair
        for measure in statistics.MEASURES
        for pair in combinations((each for each in measured if each.measure == measure and each.n > 1), 2)
    ]


@dataclass(frozen=True)
class Agreement:
    """A row of Table 3; ``percent`` and ``ci95`` in per cent."""

    condition: str
    agreed: int
    disagreed: int
    percent: float
    ci95: statistics.Interval


def table_3(rows: Sequence[statistics.AgreementCounts]) -> tuple[Agreement, ...]:
    """Return the table for counts of agreement."""
    intervals = [statistics.wilson(row.agreed, row.n) for row in rows]
    return tuple(
        Agreement(row.condition, row.agreed, row.disagreed, 100 * row.share, (100 * low, 100 * high))
        for row, (low, high) in zip(rows, intervals, strict=True)
    )


@dataclass(frozen=True)
class AgreementTest:
    """A row of Table 4: p is one-tailed; ``variances_p`` is from the two-sided F-test."""

    greater: str
    less: str
    t: float
    df: float
    p: float
    variances_p: float


def table_4(rows: Sequence[statistics.AgreementCounts]) -> tuple[AgreementTest, ...]:
    """Test each condition against each later condition. Conditions with a single pair are left out."""
    tests = []
    for greater, less in combinations((row for row in rows if row.n > 1), 2):
        figures = greater.figures(), less.figures()
        t, df, p = map(float, statistics.pooled(*figures, one_tailed=True))
        variances_p = float(statistics.equal_variances(*figures))
        tests.append(AgreementTest(greater.condition, less.condition, t, df, p, variances_p))
    return tuple(tests)


@dataclass(frozen=True)
class Corrected:
    """A test of Tables 2 and 4: its p, and Holm's corrected p (5 % chance of any false finding among all tests)."""

    measure: str
    first: str
    second: str
    p: float
    p_holm: float


def corrected(means: Sequence[MeanTest], agreement: Sequence[AgreementTest]) -> tuple[Corrected, ...]:
    """Correct all tests of Tables 2 and 4 together, as one family."""
    named = [(test.measure, test.first, test.second, test.p) for test in means]
    named += [("agreement", test.greater, test.less, test.p) for test in agreement]
    named = [each for each in named if isfinite(each[3])]
    return tuple(Corrected(*each, p) for each, p in zip(named, holm([each[3] for each in named]), strict=True))


def holm(p: Sequence[float]) -> list[float]:
    """Return p-values corrected by Holm's method, in the order given."""
    corrected_p, worst = [0.0] * len(p), 0.0
    for rank, place in enumerate(sorted(range(len(p)), key=lambda each: p[each])):
        worst = max(worst, min(1.0, (len(p) - rank) * p[place]))
        corrected_p[place] = worst
    return corrected_p


@dataclass(frozen=True)
class FurtherMeans:
    """A comparison of two means by tests that the paper does not have."""

    #: What is compared.
    measure: str
    first: str
    second: str
    #: second − first, with Welch's interval.
    difference: float
    difference_ci95: statistics.Interval
    #: Welch's t-test, two-sided: does not assume equal variances.
    welch_t: float
    welch_df: float
    welch_p: float
    #: Mann–Whitney's test, two-sided: does not assume a normal distribution; NaN where the answers are not known, or
    #: all equal.
    rank_p: float
    #: The difference in standard deviations.
    hedges_g: float
    hedges_g_ci95: statistics.Interval


@dataclass(frozen=True)
class McNemar:
    """McNemar's test on images that a reader read under both conditions; counts of agreement under only one of them."""

    pairs: int
    first_only: int
    second_only: int
    p: float


@dataclass(frozen=True)
class FurtherAgreement:
    """A comparison of two shares of agreement by tests that the paper does not have."""

    #: What is compared.
    first: str
    second: str
    #: p of Fisher's exact test: one-tailed (``first`` agrees more often), and two-sided.
    fisher_one_tailed: float
    fisher: float
    #: second − first in percentage points, with Newcombe's interval.
    difference: float
    difference_ci95: statistics.Interval
    #: Odds ratio of agreement, second over first.
    odds_ratio: float
    odds_ratio_ci95: statistics.Interval
    #: Exact two-sided test if a reader read the same images under both conditions; else None.
    mcnemar: McNemar | None


def further_means(samples: Sequence[statistics.StudySample]) -> tuple[FurtherMeans, ...]:
    """Compare each pair of means by Welch's test, by a rank test and by effect size."""
    from scipy.stats import t as student

    compared = []
    for first, second in same_measure(samples):
        t, df, p = map(float, statistics.welch(second, first))
        difference = second.mean - first.mean
        half = float(student.ppf(0.975, df)) * (first.sd**2 / first.n + second.sd**2 / second.n) ** 0.5
        g, g_ci95 = hedges_g(first, second)
        names, interval = (first.measure, first.condition, second.condition), (difference - half, difference + half)
        compared.append(FurtherMeans(*names, difference, interval, t, df, p, _rank_p(first, second), g, g_ci95))
    return tuple(compared)


def _rank_p(first: statistics.StudySample, second: statistics.StudySample) -> float:
    if len({*first.values, *second.values}) < 2:
        return nan
    from scipy.stats import mannwhitneyu

    # Exact if a sample has at most 8 values and no two values are equal; else asymptotic.
    return float(mannwhitneyu(first.values, second.values, alternative="two-sided", method="auto").pvalue)


def further_agreement(
    rows: Sequence[statistics.AgreementCounts], reading_pairs: Sequence[statistics.ReadingPair] = ()
) -> tuple[FurtherAgreement, ...]:
    """Compare shares of agreement by exact tests and intervals; without ``reading_pairs`` no test is paired."""
    from scipy.stats import fisher_exact

    compared = []
    for first, second in combinations(rows, 2):
        table = [[first.agreed, first.disagreed], [second.agreed, second.disagreed]]
        low, high = statistics.newcombe((second.agreed, second.n), (first.agreed, first.n))
        one_tailed, fisher = (float(fisher_exact(table, alternative=side).pvalue) for side in ("greater", "two-sided"))
        difference, interval = 100 * (second.share - first.share), (100 * low, 100 * high)
        names, odds = (first.condition, second.condition), odds_ratio(first, second)
        paired = _mcnemar(*names, reading_pairs)
        compared.append(FurtherAgreement(*names, one_tailed, fisher, difference, interval, *odds, paired))
    return tuple(compared)


def _mcnemar(first: str, second: str, reading_pairs: Sequence[statistics.ReadingPair]) -> McNemar | None:
    """Return the exact test on images that a reader read under both conditions; None: there is no such image."""
    from scipy.stats import binomtest

    agreed: dict[str, dict[tuple[str, str], bool]] = {first: {}, second: {}}
    for pair in reading_pairs:
        if pair.answer.condition in agreed:
            # Of several readings under one condition the first counts: one pair for each image and reader.
            agreed[pair.answer.condition].setdefault((pair.answer.reader, pair.answer.image), pair.agreed)
    both = sorted(agreed[first].keys() & agreed[second].keys())
    if not both:
        return None
    first_only = sum(agreed[first][key] and not agreed[second][key] for key in both)
    second_only = sum(agreed[second][key] and not agreed[first][key] for key in both)
    discordant = first_only + second_only
    p = float(binomtest(first_only, discordant).pvalue) if discordant else 1.0
    return McNemar(len(both), first_only, second_only, p)
