"""Power: which differences a reader study of a given size can find, and the power for the paper's own differences.

The tests are the paper's tests (Avanaki et al., Proc. SPIE 9420, 2015, section 3.2). Student's two-sided two-sample t
with pooled variance is for time to score and ease of reading. The one-tailed t on 0/1 values is for agreement between
sessions; Fisher's exact test is added. Power of t on means is exact for normal values (noncentral t). Power of both
tests on agreement is exact, summed over both binomial distributions.

Standard deviations are from the paper: Table 2 prints means ± 95 % intervals. As ± 1.96 standard errors with 39, 40 and
40 answers, these intervals give the paper's p-values. Answers are assumed independent. With several readers this is not
exact: the figures then hold for these readers, not for all similar readers.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import combinations
from math import isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.errors import LutgenError
from lutgen.names import AGING_MODES

#: Significance level, and the required power.
ALPHA, TARGET = 0.05, 0.8

#: Largest and smallest number of answers per condition for which power is computed: one answer has no variance.
MOST, LEAST = 2000, 2

#: The conditions of the paper, with its numbers of answers: one un-aged image is missing in the paper.
ANSWERS = {"none": 39, "chroma": 40, "chroma-luma": 40}

#: Table 2: mean and half of the 95 % interval, time to score in s and ease of reading from 1 to 10.
TABLE_2 = {
    "time": {"none": (41.0, 5.4), "chroma": (50.1, 7.3), "chroma-luma": (51.2, 6.4)},
    "ease": {"none": (9.7, 0.2), "chroma": (8.7, 0.5), "chroma-luma": (8.4, 0.4)},
}

#: Table 3: number of images on which both sessions agreed.
AGREED = {"none": 27, "chroma": 21, "chroma-luma": 20}

#: Compared conditions, the less aged condition first.
PAIRS = tuple(combinations(("none", *AGING_MODES), 2))

#: The search for the smallest difference ends at this many standard deviations; two answers already find 8.
_BEYOND = 50.0

#: Sums leave out counts more than this many standard deviations from the mean: their probability is below 1e-14.
_REACH = 8.0


@dataclass(frozen=True)
class Detectable:
    """The smallest true difference that a test finds with ``TARGET`` power; None if no difference is large enough."""

    measure: str
    test: str
    sd: float | None
    base: float | None
    smallest: float | None


@dataclass(frozen=True)
class Seen:
    """A difference that the paper measured, and the power to find a difference of this size."""

    measure: str
    test: str
    between: tuple[str, str]
    values: tuple[float, float]
    sd: float | None
    paper: float
    yours: float
    needed: int | None

    @property
    def difference(self) -> float:
        """The second value minus the first value."""
        return self.values[1] - self.values[0]


@dataclass(frozen=True)
class Power:
    """Differences that a study can find with ``answers`` per condition: ``per_condition`` images × ``readers``."""

    per_condition: int
    readers: int
    detectable: tuple[Detectable, ...]
    seen: tuple[Seen, ...]

    @property
    def answers(self) -> int:
        """Number of answers per condition."""
        return self.per_condition * self.readers

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes."""
        return {
            "schema": 1,
            "alpha": ALPHA,
            "power": TARGET,
            "per_condition": self.per_condition,
            "readers": self.readers,
            "answers": self.answers,
            "detectable": [asdict(each) for each in self.detectable],
            "paper": [{**asdict(each), "difference": each.difference} for each in self.seen],
        }


def study_power(per_condition: int, readers: int = 1) -> Power:
    """Return the power for a number of images per condition and of readers. Raises LutgenError: none, or too many."""
    for option, count in (("--per-condition", per_condition), ("--readers", readers)):
        if count < 1:
            raise LutgenError(f"{option} {count}: give 1 or more.")
    answers = per_condition * readers
    if answers > MOST:
        message = f"{per_condition} images × {readers} readers are {answers} answers per condition; power is worked out"
        raise LutgenError(f"{message} for at most {MOST}. Ask for fewer.")
    return Power(per_condition, readers, tuple(_detectable(answers)), _seen(answers))


def standard_deviation(measure: str, conditions: Sequence[str]) -> float:
    """Return the standard deviation of the paper's answers, pooled over conditions."""
    freedom = [ANSWERS[name] - 1 for name in conditions]
    variance = [(TABLE_2[measure][name][1] / 1.96) ** 2 * ANSWERS[name] for name in conditions]
    return sqrt(np.average(variance, weights=freedom))


def t_power(difference: float, sd: float, answers: tuple[int, int], *, tails: int) -> float:
    """Return the power of Student's two-sample t at ``ALPHA``, exact for normal values by the noncentral t."""
    from scipy import stats

    if min(answers) < LEAST:
        return 0.0
    freedom = sum(answers) - 2
    shift = abs(difference) / (sd * sqrt(1 / answers[0] + 1 / answers[1]))
    limit = stats.t.isf(ALPHA / tails, freedom)
    power = float(stats.nct.sf(limit, freedom, shift))
    if tails == 2:
        other = float(stats.nct.cdf(-limit, freedom, shift))
        # scipy returns NaN far in the tail, where the probability is 0.
        power += other if isfinite(other) else 0.0
    return min(power, 1.0)


def agreement_power(shares: tuple[float, float], answers: tuple[int, int], *, test: str) -> float:
    """Return the exact power to find the first share larger, one-tailed at ``ALPHA``, over all outcomes."""
    from scipy import stats

    if min(answers) < LEAST:
        return 0.0
    counts = [_likely(share, of) for share, of in zip(shares, answers, strict=True)]
    chances = [stats.binom.pmf(count, of, share) for count, of, share in zip(counts, answers, shares, strict=True)]
    rejected = REJECTS[test](counts[0][:, np.newaxis], counts[1][np.newaxis, :], answers)
    return min(float(chances[0] @ rejected @ chances[1]), 1.0)


def _likely(share: float, of: int) -> NDArray[np.int64]:
    reach = _REACH * sqrt(of * share * (1 - share)) + 1
    return np.arange(max(int(of * share - reach), 0), min(int(of * share + reach) + 1, of) + 1)


def t_rejects(first: NDArray[Any], second: NDArray[Any], answers: tuple[int, int]) -> NDArray[np.bool_]:
    """Return whether the paper's one-tailed t on 0/1 values finds the first count larger; counts broadcast."""
    from scipy import stats

    n, m = answers
    difference = first / n - second / m
    squares = first * (n - first) / n + second * (m - second) / m
    # Without variance any difference is significant. The inequality is multiplied out to avoid a division by 0.
    limit = stats.t.isf(ALPHA, n + m - 2) * np.sqrt(squares / (n + m - 2) * (1 / n + 1 / m))
    return np.asarray((difference > limit) & (difference > 0))


def fisher_rejects(first: NDArray[Any], second: NDArray[Any], answers: tuple[int, int]) -> NDArray[np.bool_]:
    """Return whether Fisher's exact test, hypergeometric, finds the first count larger; counts broadcast."""
    from scipy.special import gammaln

    n, m = answers
    total = first + second
    totals, counts = np.arange(total.min(), total.max() + 1)[:, np.newaxis], np.arange(n + 1)
    factorial = gammaln(np.arange(n + m + 1) + 1.0)

    def ways(of: int, chosen: NDArray[Any]) -> NDArray[np.float64]:
        return np.asarray(factorial[of] - factorial[chosen] - factorial[of - chosen])

    possible = (totals - counts >= 0) & (totals - counts <= m)
    others = np.clip(totals - counts, 0, m)
    chance = np.where(possible, np.exp(ways(n, counts) + ways(m, others) - ways(n + m, totals)), 0.0)
    tail = np.cumsum(chance[:, ::-1], axis=1)[:, ::-1]
    rejected = (tail <= ALPHA)[total - total.min(), np.broadcast_to(first, total.shape)]
    return np.asarray(rejected)


#: Tests of each measure, as JSON and tables name them; the paper's tests first.
TWO_SIDED, ONE_TAILED, FISHER = "t two-sided", "t one-tailed", "fisher one-tailed"
TESTS = {"time": (TWO_SIDED, ONE_TAILED), "ease": (TWO_SIDED, ONE_TAILED), "agreement": (ONE_TAILED, FISHER)}

#: Tests on agreement.
REJECTS = {ONE_TAILED: t_rejects, FISHER: fisher_rejects}


def power_of(test: str, values: tuple[float, float], sd: float | None, answers: tuple[int, int]) -> float:
    """Return the power of a test of ``TESTS`` for two true means or, without ``sd``, two true shares of agreement."""
    if sd is None:
        return agreement_power(values, answers, test=test)
    return t_power(values[1] - values[0], sd, answers, tails=2 if test == TWO_SIDED else 1)


def _detectable(answers: int) -> list[Detectable]:
    tests: list[tuple[str, str, float | None, float | None]] = []
    for measure in TABLE_2:
        sd = standard_deviation(measure, tuple(ANSWERS))
        tests += [(measure, test, sd, None) for test in TESTS[measure]]
    base = AGREED["none"] / ANSWERS["none"]
    tests += [("agreement", test, None, base) for test in TESTS["agreement"]]
    return [Detectable(*each, smallest_difference(*each[1:], answers)) for each in tests]


def smallest_difference(test: str, sd: float | None, base: float | None, answers: int) -> float | None:
    """Return the smallest difference, or fall from the share ``base``, found with ``TARGET`` power; None: none."""
    from scipy.optimize import brentq

    before = base or 0.0
    most = _BEYOND * sd if sd else before

    def missing(fall: float) -> float:
        return power_of(test, (before, before - fall), sd, (answers, answers)) - TARGET

    return float(brentq(missing, 0.0, most, xtol=1e-9)) if missing(most) >= 0 else None


def _seen(answers: int) -> tuple[Seen, ...]:
    seen = []
    for measure, tests in TESTS.items():
        for first, second in PAIRS:
            values, sd = paper_values(measure, first, second)
            # The paper's tests on means are two-sided.
            for test in tests if sd is None else tests[:1]:
                of_paper = power_of(test, values, sd, (ANSWERS[first], ANSWERS[second]))
                yours = power_of(test, values, sd, (answers, answers))
                needed = answers_needed(test, values, sd)
                seen.append(Seen(measure, test, (first, second), values, sd, of_paper, yours, needed))
    return tuple(seen)


def paper_values(measure: str, first: str, second: str) -> tuple[tuple[float, float], float | None]:
    """Return the paper's values under two conditions, and the SD pooled over both conditions (None for agreement)."""
    if measure == "agreement":
        return (AGREED[first] / ANSWERS[first], AGREED[second] / ANSWERS[second]), None
    means = TABLE_2[measure]
    return (means[first][0], means[second][0]), standard_deviation(measure, (first, second))


@cache
def answers_needed(test: str, values: tuple[float, float], sd: float | None) -> int | None:
    """Return the least answers per condition for ``TARGET`` power; None: more than ``MOST``."""

    def enough(answers: int) -> bool:
        return power_of(test, values, sd, (answers, answers)) >= TARGET

    if not enough(MOST):
        return None
    low, high = LEAST - 1, MOST
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
