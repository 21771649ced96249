"""The paper's Table 4: whether agreement falls, by one-tailed t-tests on a 1 or a 0 a pair of readings.

The null hypothesis of a row is that ``greater`` agrees no more often than ``less``. Variances are pooled, and an F-test
stands beside that assumption, as section 3.2 of the paper does it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.study.analysis.sample import pairs_of
from lutgen.study.analysis.t_test import equal_variances, pooled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.analysis.agreement import Counts


@dataclass(frozen=True)
class AgreementTest:
    """A row of Table 4: p is one-tailed, ``variances_p`` the F-test's, two-sided."""

    greater: str
    less: str
    t: float
    df: float
    p: float
    variances_p: float


def table_4(rows: Sequence[Counts]) -> tuple[AgreementTest, ...]:
    """Test each condition against each later one; conditions of a single pair are left out."""
    made = []
    for greater, less in pairs_of(row for row in rows if row.n > 1):
        figures = greater.figures(), less.figures()
        t, df, p = map(float, pooled(*figures, one_tailed=True))
        made.append(AgreementTest(greater.condition, less.condition, t, df, p, float(equal_variances(*figures))))
    return tuple(made)
