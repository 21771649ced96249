"""The paper's Table 3: percent agreement between sessions, with Wilson's interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.study.analysis.intervals import Interval, wilson

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.analysis.agreement import Counts


@dataclass(frozen=True)
class Agreement:
    """A row of Table 3; ``percent`` and ``ci95`` in per cent."""

    condition: str
    agreed: int
    disagreed: int
    percent: float
    ci95: Interval


def table_3(rows: Sequence[Counts]) -> tuple[Agreement, ...]:
    """Make the table from what was counted."""
    made = []
    for row in rows:
        low, high = wilson(row.agreed, row.n)
        made.append(Agreement(row.condition, row.agreed, row.disagreed, 100 * row.share, (100 * low, 100 * high)))
    return tuple(made)
