"""Holm's correction for several comparisons (1979, Scandinavian Journal of Statistics 6:65)."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.analysis.table_2 import MeanTest
    from lutgen.study.analysis.table_4 import AgreementTest


@dataclass(frozen=True)
class Corrected:
    """A test of Tables 2 and 4: its p, and the p that keeps the chance of any false alarm among all of them at 5 %."""

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
    """Corrected p-values, in the order given."""
    made, worst = [0.0] * len(p), 0.0
    for rank, place in enumerate(sorted(range(len(p)), key=lambda each: p[each])):
        worst = max(worst, min(1.0, (len(p) - rank) * p[place]))
        made[place] = worst
    return made
