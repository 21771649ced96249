"""The paper's Table 2: mean time to score and ease of reading with 95 % intervals, and the t-tests on them.

The tests are two-sample, unpaired, of equal variances and two-sided: of the readings of section 3.2 only this one gives
its four p-values from its means and intervals, these read as ± 1.96 SD/√n with n = 39 un-aged images.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.study.analysis.agreement import mixed_sessions
from lutgen.study.analysis.intervals import Interval, mean_interval
from lutgen.study.analysis.sample import MEASURES, Sample, pairs_of, sample_of
from lutgen.study.analysis.t_test import pooled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.answer import Answer


@dataclass(frozen=True)
class Mean:
    """A cell of Table 2."""

    measure: str
    condition: str
    n: int
    mean: float
    sd: float
    ci95: Interval


@dataclass(frozen=True)
class MeanTest:
    """Whether two means differ: ``difference`` is ``second`` − ``first``, p that of a pooled two-sided t-test."""

    measure: str
    first: str
    second: str
    difference: float
    t: float
    df: float
    p: float


@dataclass(frozen=True)
class Table2:
    """The table, and the tests of the text below it."""

    means: tuple[Mean, ...]
    tests: tuple[MeanTest, ...]


def samples(conditions: Sequence[str], answers: Sequence[Answer]) -> tuple[Sample, ...]:
    """Collect time and ease by condition, from the sessions that showed anything aged; from all where none did."""
    mixed = mixed_sessions(answers)
    taken = [answer for answer in answers if (answer.reader, answer.session) in mixed] or list(answers)
    made = []
    for measure in MEASURES:
        for condition in conditions:
            there = [answer for answer in taken if answer.condition == condition]
            values = [answer.seconds if measure == "time" else float(answer.ease) for answer in there]
            if values:
                made.append(sample_of(measure, condition, values))
    return tuple(made)


def table_2(found: Sequence[Sample], *, ci: str = "normal") -> Table2:
    """Make the table and its tests from samples in their order; ``ci`` is a key of ``INTERVALS``."""
    means = tuple(Mean(one.measure, one.condition, one.n, one.mean, one.sd, mean_interval(one, ci)) for one in found)
    return Table2(means, tuple(_test(first, second) for first, second in same_measure(found)))


def same_measure(found: Sequence[Sample]) -> list[tuple[Sample, Sample]]:
    """Return each pair of conditions, measure by measure, where both have a variance."""
    return [
        pair for measure in MEASURES for pair in pairs_of(one for one in found if one.measure == measure and one.n > 1)
    ]


def _test(first: Sample, second: Sample) -> MeanTest:
    t, df, p = map(float, pooled(second, first))
    return MeanTest(first.measure, first.condition, second.condition, second.mean - first.mean, t, df, p)
