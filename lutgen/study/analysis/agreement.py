"""How often readers agree with themselves: an answer under a condition against the reader's own un-aged answer.

The paper (section 2.3) reads every image twice, the second time un-aged, and asks whether both diagnoses are on the
same side, positive or negative. In general a reader may have read an image any number of times. The rule here:

- An image's *reference* is the reader's un-aged answer to it in a session that showed nothing aged, the last such one;
  where there is none, the reader's last un-aged answer to it. In the paper that is session 2.
- Each answer under an aged condition is paired with the reference; one image read twice under the same condition gives
  two pairs. An image that was never read un-aged gives none.
- Of the other un-aged answers the first is paired with the reference: each image gives ``none`` one pair at most.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from lutgen.cells import number
from lutgen.study.analysis.statistics import Interval, SampleFigures, Sized, Z

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lutgen.colorimetry import Array
    from lutgen.study.answers import Answer

#: The name of the un-aged condition: see :class:`lutgen.study.protocol.StudyCondition`.
UNAGED = "none"


@dataclass(frozen=True)
class ReadingPair:
    """One answer and its reference: same reader, same image."""

    answer: Answer
    reference: Answer

    @property
    def agreed(self) -> bool:
        """Whether both are positive, or both negative: what the paper counts."""
        return self.answer.positive == self.reference.positive


@dataclass(frozen=True)
class AgreementCounts:
    """A row of the paper's Table 3 as it was counted."""

    condition: str
    agreed: int
    disagreed: int

    @property
    def n(self) -> int:
        """How many pairs there are."""
        return self.agreed + self.disagreed

    @property
    def share(self) -> float:
        """Share that agreed, 0..1."""
        return self.agreed / self.n

    def figures(self) -> SampleFigures:
        """Return n, mean and SD of a 1 a pair that agreed and a 0 a pair that did not."""
        variance = self.share * (1 - self.share) * self.n / (self.n - 1) if self.n > 1 else float("nan")
        return SampleFigures(self.n, self.share, variance**0.5)


def mixed_sessions(answers: Iterable[Answer]) -> set[tuple[str, int]]:
    """Return the (reader, session) that showed anything aged: where the paper measures time and ease."""
    return {(answer.reader, answer.session) for answer in answers if answer.condition != UNAGED}


def pairs(answers: Sequence[Answer]) -> tuple[ReadingPair, ...]:
    """Pair answers with their references, by the rule of this module, in the order of the answers."""
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
    """κ of the pairs of a condition: ``of`` is ``side`` (positive or negative) or ``category``.

    κ and its interval are NaN where all readings gave the same answer: chance alone would agree always.
    """

    condition: str
    of: str
    n: int
    percent: float
    kappa: float
    ci95: Interval


def kappas(conditions: Sequence[str], reading_pairs: Sequence[ReadingPair]) -> tuple[Kappa, ...]:
    """κ of every condition that has pairs, on sides and on categories."""
    rows = []
    for condition in conditions:
        there = [pair for pair in reading_pairs if pair.answer.condition == condition]
        if there:
            sides = [(str(pair.answer.positive), str(pair.reference.positive)) for pair in there]
            categories = [(pair.answer.category, pair.reference.category) for pair in there]
            rows += [_kappa(condition, "side", sides), _kappa(condition, "category", categories)]
    return tuple(rows)


def _kappa(condition: str, of: str, readings: Sequence[tuple[str, str]]) -> Kappa:
    names = sorted({name for pair in readings for name in pair})
    table = np.zeros((len(names), len(names)))
    for one, other in readings:
        table[names.index(one), names.index(other)] += 1
    value, error = cohen(table)
    n = len(readings)
    return Kappa(condition, of, n, 100 * float(np.trace(table)) / n, value, (value - Z * error, value + Z * error))


def cohen(table: Array) -> tuple[float, float]:
    """κ and its standard error from a square table of counts, (k, k); NaN where chance agrees always.

    Cohen 1960, doi:10.1177/001316446002000104; error by Fleiss, Cohen & Everitt 1969, doi:10.1037/h0028106.
    """
    n = table.sum()
    share = table / n
    rows, columns = share.sum(axis=1), share.sum(axis=0)
    seen, chance = float(np.trace(share)), float(rows @ columns)
    if chance >= 1:
        return float("nan"), float("nan")
    kappa = (seen - chance) / (1 - chance)
    both = rows[np.newaxis, :] + columns[:, np.newaxis]
    diagonal = np.diag(share) @ (1 - np.diag(both) * (1 - kappa)) ** 2
    other = (1 - kappa) ** 2 * ((share * both**2).sum() - np.diag(share) @ np.diag(both) ** 2)
    variance = (diagonal + other - (kappa - chance * (1 - kappa)) ** 2) / (n * (1 - chance) ** 2)
    return kappa, sqrt(max(float(variance), 0.0))


def odds_ratio(first: AgreementCounts, second: AgreementCounts) -> Sized:
    """Odds of agreeing, second over first, with the exact conditional interval (Cornfield 1956; as R's fisher.test).

    NaN or infinite where a count is 0.
    """
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
