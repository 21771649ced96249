"""Statistics of two samples, from answers or only from n, mean and SD: intervals, tests, effect sizes.

The tests accept arrays with one entry for each study, so that thousands of simulated studies take a moment. If both
samples have no variance, p is NaN.

Agreement within readers compares an answer under a condition with the reader's own un-aged answer.

The paper (section 2.3) reads every image twice, the second time un-aged, and asks whether both diagnoses are on the
same side, positive or negative. In general a reader may have read an image any number of times. The rule here:

- An image's *reference* is the reader's last un-aged answer to the image in a session without aged images. If there is
  no such answer, the reference is the reader's last un-aged answer to the image. In the paper this is session 2.
- Each answer under an aged condition is paired with the reference. An image read twice under the same condition gives
  two pairs. An image that was never read un-aged gives no pair.
- The first of the other un-aged answers is paired with the reference: each image gives ``none`` at most one pair.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import exp, lgamma, nan, sqrt
from statistics import NormalDist, fmean, stdev
from typing import Any, NamedTuple

import numpy as np

from lutgen.cells import number
from lutgen.colorimetry import Array
from lutgen.study.answers import Answer

#: Measure other than the diagnosis → its name and unit: the paper's TTS and EOR.
MEASURES = {"time": "time to score, s", "ease": "ease of reading"}


@dataclass(frozen=True)
class StudySample:
    """One measure under one condition."""

    #: A key of ``MEASURES``.
    measure: str
    #: Condition of the images.
    condition: str
    #: Number of answers, their mean, and their standard deviation with n − 1; NaN for n = 1.
    n: int
    mean: float
    sd: float
    #: The answers; empty if only n, mean and SD are known.
    values: tuple[float, ...] = ()


def sample_of(measure: str, condition: str, values: Sequence[float]) -> StudySample:
    """Return n, mean and SD of at least one answer, with the answers."""
    sd = stdev(values) if len(values) > 1 else nan
    return StudySample(measure, condition, len(values), fmean(values), sd, tuple(map(float, values)))


#: Low and high end of an interval.
Interval = tuple[float, float]

#: The two-sided 95 % quantile of the normal distribution, 1.96.
Z = NormalDist().inv_cdf(0.975)


def half_width(n: int, kind: str = "normal") -> float:
    """Return half the width of a mean's interval in standard deviations; NaN for fewer than two answers."""
    if n < 2:
        return nan
    if kind == "normal":
        return Z / sqrt(n)
    from scipy.stats import t

    return float(t.ppf(0.975, n - 1)) / sqrt(n)


def mean_interval(sample: StudySample, kind: str = "normal") -> Interval:
    """Return the interval of a sample's mean, of a kind of ``INTERVALS``."""
    half = half_width(sample.n, kind) * sample.sd
    return sample.mean - half, sample.mean + half


def wilson(count: int, n: int) -> Interval:
    """Return the score interval of the share ``count`` / ``n``: Wilson 1927, doi:10.1080/01621459.1927.10502953."""
    share, weight = count / n, Z**2 / n
    middle = (share + weight / 2) / (1 + weight)
    half = sqrt(weight * (share * (1 - share) + weight / 4)) / (1 + weight)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def newcombe(first: tuple[int, int], second: tuple[int, int]) -> Interval:
    """Return the interval of first − second, each (count, n): Newcombe 1998, method 10, of two Wilson intervals."""
    # doi:10.1002/(SICI)1097-0258(19980430)17:8<873::AID-SIM779>3.0.CO;2-I
    (share_1, low_1, high_1), (share_2, low_2, high_2) = ((k / n, *wilson(k, n)) for k, n in (first, second))
    difference = share_1 - share_2
    return (
        difference - sqrt((share_1 - low_1) ** 2 + (high_2 - share_2) ** 2),
        difference + sqrt((high_1 - share_1) ** 2 + (share_2 - low_2) ** 2),
    )


class SampleFigures(NamedTuple):
    """n, mean and SD of answers: numbers, or arrays with an entry for each study. A ``StudySample`` has them too."""

    n: Any
    mean: Any
    sd: Any


class Tested(NamedTuple):
    """Statistic, degrees of freedom and p."""

    t: Array
    df: Array
    p: Array


def pooled(first: Any, second: Any, *, one_tailed: bool = False) -> Tested:
    """Return Student's two-sample t with equal variances, of two samples with n, mean and sd."""
    df = np.asarray(first.n + second.n - 2, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = ((first.n - 1) * np.square(first.sd) + (second.n - 1) * np.square(second.sd)) / df
        error = np.sqrt(variance * (1 / first.n + 1 / second.n))
        return _tested(first.mean - second.mean, error, df, one_tailed=one_tailed)


def welch(first: Any, second: Any) -> Tested:
    """Return Welch's two-sided t, with Satterthwaite's degrees of freedom; parameters as ``pooled``."""
    of_first, of_second = np.square(first.sd) / first.n, np.square(second.sd) / second.n
    with np.errstate(divide="ignore", invalid="ignore"):
        df = (of_first + of_second) ** 2 / (of_first**2 / (first.n - 1) + of_second**2 / (second.n - 1))
        return _tested(first.mean - second.mean, np.sqrt(of_first + of_second), df, one_tailed=False)


def _tested(difference: Any, error: Any, df: Any, *, one_tailed: bool) -> Tested:
    from scipy.special import stdtr

    t = np.where(error > 0, difference / np.where(error > 0, error, 1.0), np.nan)
    return Tested(t, np.asarray(df), stdtr(df, -t) if one_tailed else 2 * stdtr(df, -np.abs(t)))


def equal_variances(first: Any, second: Any) -> Array:
    """Return the two-sided p of the F-test of equal variances; parameters as ``pooled``."""
    from scipy.special import fdtr, fdtrc

    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.square(first.sd) / np.square(second.sd)
    df = (first.n - 1, second.n - 1)
    return np.asarray(np.minimum(2 * np.minimum(fdtr(*df, ratio), fdtrc(*df, ratio)), 1.0))


#: An effect and its interval; NaN where it is undefined.
Sized = tuple[float, Interval]


def hedges_g(first: StudySample, second: StudySample) -> Sized:
    """Return second − first in pooled standard deviations, unbiased: Hedges 1981, doi:10.3102/10769986006002107."""
    t, df, _ = map(float, pooled(second, first))
    shares = 1 / first.n + 1 / second.n
    factor = _gamma_ratio(df) if df > 1 else nan
    g = factor * t * sqrt(shares)
    half = Z * sqrt(shares + g**2 / (2 * (first.n + second.n)))
    return g, (g - half, g + half)


def _gamma_ratio(df: float) -> float:
    """Return c(df) = Γ(df/2) / (√(df/2) Γ((df − 1)/2)), about 1 − 3/(4 df − 1)."""
    return exp(lgamma(df / 2) - lgamma((df - 1) / 2)) / sqrt(df / 2)


#: The name of the un-aged condition: see :class:`lutgen.study.protocol.StudyCondition`.
UNAGED = "none"


@dataclass(frozen=True)
class ReadingPair:
    """An answer and its reference: same reader, same image."""

    answer: Answer
    reference: Answer

    @property
    def agreed(self) -> bool:
        """Whether both are positive, or both negative, as the paper counts agreement."""
        return self.answer.positive == self.reference.positive


@dataclass(frozen=True)
class AgreementCounts:
    """The counts of a row of the paper's Table 3."""

    condition: str
    agreed: int
    disagreed: int

    @property
    def n(self) -> int:
        """Number of pairs."""
        return self.agreed + self.disagreed

    @property
    def share(self) -> float:
        """Share of pairs that agreed, 0..1."""
        return self.agreed / self.n

    def figures(self) -> SampleFigures:
        """Return n, mean and SD of values that are 1 for a pair that agreed and 0 for another pair."""
        variance = self.share * (1 - self.share) * self.n / (self.n - 1) if self.n > 1 else nan
        return SampleFigures(self.n, self.share, variance**0.5)


def mixed_sessions(answers: Iterable[Answer]) -> set[tuple[str, int]]:
    """Return each (reader, session) with aged images, where the paper measures time and ease."""
    return {(answer.reader, answer.session) for answer in answers if answer.condition != UNAGED}


def pairs(answers: Sequence[Answer]) -> tuple[ReadingPair, ...]:
    """Pair answers with their references, by the rule in the module's docstring, in the order of the answers."""
    mixed = mixed_sessions(answers)
    unaged: dict[tuple[str, str], list[Answer]] = defaultdict(list)
    for answer in answers:
        if answer.condition == UNAGED:
            unaged[answer.reader, answer.image].append(answer)
    reference, first = {}, {}
    for key, unaged_answers in unaged.items():
        unaged_answers.sort(
            key=lambda answer: ((answer.reader, answer.session) not in mixed, answer.session, answer.position)
        )
        reference[key] = unaged_answers[-1]
        if len(unaged_answers) > 1:
            first[key] = min(unaged_answers[:-1], key=lambda answer: (answer.session, answer.position))
    reading_pairs = []
    for answer in answers:
        key = (answer.reader, answer.image)
        if key in reference and (answer.condition != UNAGED or answer is first.get(key)):
            reading_pairs.append(ReadingPair(answer, reference[key]))
    return tuple(reading_pairs)


def counts(conditions: Sequence[str], reading_pairs: Sequence[ReadingPair]) -> tuple[AgreementCounts, ...]:
    """Count the pairs that agree, one row for each condition that has pairs."""
    rows = []
    for condition in conditions:
        agreed = [pair.agreed for pair in reading_pairs if pair.answer.condition == condition]
        if agreed:
            rows.append(AgreementCounts(condition, sum(agreed), len(agreed) - sum(agreed)))
    return tuple(rows)


@dataclass(frozen=True)
class Kappa:
    """κ of the pairs of a condition, by ``side`` or ``category``; NaN if all readings gave the same answer."""

    condition: str
    of: str
    n: int
    percent: float
    kappa: float
    ci95: Interval


def kappas(conditions: Sequence[str], reading_pairs: Sequence[ReadingPair]) -> tuple[Kappa, ...]:
    """Return κ of every condition that has pairs, for sides and for categories."""
    rows = []
    for condition in conditions:
        of_condition = [pair for pair in reading_pairs if pair.answer.condition == condition]
        if of_condition:
            sides = [(str(pair.answer.positive), str(pair.reference.positive)) for pair in of_condition]
            categories = [(pair.answer.category, pair.reference.category) for pair in of_condition]
            rows += [_kappa(condition, "side", sides), _kappa(condition, "category", categories)]
    return tuple(rows)


def _kappa(condition: str, of: str, readings: Sequence[tuple[str, str]]) -> Kappa:
    names = sorted({name for pair in readings for name in pair})
    table = np.zeros((len(names), len(names)))
    for answer, reference in readings:
        table[names.index(answer), names.index(reference)] += 1
    value, error = cohen(table)
    n = len(readings)
    return Kappa(condition, of, n, 100 * float(np.trace(table)) / n, value, (value - Z * error, value + Z * error))


def cohen(table: Array) -> tuple[float, float]:
    """κ of counts (k, k), Cohen 1960, and its error, Fleiss, Cohen & Everitt 1969, doi:10.1037/h0028106.

    Both are NaN for fewer than two pairs, and where chance alone agrees always.
    """
    n = table.sum()
    if n < 2:
        return nan, nan
    share = table / n
    rows, columns = share.sum(axis=1), share.sum(axis=0)
    seen, chance = float(np.trace(share)), float(rows @ columns)
    if chance >= 1:
        return nan, nan
    kappa = (seen - chance) / (1 - chance)
    both = rows[np.newaxis, :] + columns[:, np.newaxis]
    diagonal = np.diag(share) @ (1 - np.diag(both) * (1 - kappa)) ** 2
    other = (1 - kappa) ** 2 * ((share * both**2).sum() - np.diag(share) @ np.diag(both) ** 2)
    variance = (diagonal + other - (kappa - chance * (1 - kappa)) ** 2) / (n * (1 - chance) ** 2)
    return kappa, sqrt(max(float(variance), 0.0))


def odds_ratio(first: AgreementCounts, second: AgreementCounts) -> Sized:
    """Return the odds ratio of agreement, second over first, with the exact conditional interval (Cornfield 1956)."""
    from scipy.stats.contingency import odds_ratio as conditional

    ratio = conditional([[second.agreed, second.disagreed], [first.agreed, first.disagreed]])
    low, high = ratio.confidence_interval(0.95)
    return float(ratio.statistic), (float(low), float(high))


def condition_order(answers: Iterable[Answer]) -> tuple[str, ...]:
    """Return the conditions of answers: ``none`` first, then by mode and hour."""
    return tuple(sorted({answer.condition for answer in answers}, key=_mode_and_hours))


def _mode_and_hours(condition: str) -> tuple[bool, str, float, str]:
    mode, _, hours = condition.partition("@")
    when = number(hours or "0")
    return mode != UNAGED or when is None, mode, when or 0.0, condition
