"""Figures of a study that others analysed: how many agreed (Table 3), and means with intervals (Table 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.errors import pick_one
from lutgen.study.analysis.agreement import Counts
from lutgen.study.analysis.intervals import half_width
from lutgen.study.analysis.sample import MEASURES, Sample
from lutgen.study.csv_rows import Row, read_rows

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

COUNTS = ("condition", "agreed", "disagreed")
SUMMARY = ("condition", "measure", "n", "mean", "ci95")

#: Most that is counted of a kind: with ten times as many the exact tests take minutes.
MOST = 10_000


def read_counts(file: str | Path) -> tuple[str, tuple[Counts, ...]]:
    """Read ``condition,agreed,disagreed``: the remark in the first line, and the rows.

    Raises
    ------
    LutgenError
        As :func:`lutgen.study.csv_rows.read_rows`; a cell that is no count, a condition twice or without
        any pair.

    """
    remark, rows = read_rows(file, COUNTS)
    made = []
    for row in rows:
        agreed, disagreed = (row.whole(column, low=0, high=MOST) for column in COUNTS[1:])
        found = Counts(row.text("condition"), agreed, disagreed)
        if not found.n:
            raise row.error("agreed", "and no disagreed either: nothing was compared. Leave the condition out.")
        made.append(found)
    _check_once(rows, [(row.condition,) for row in made])
    return remark, tuple(made)


def read_summary(file: str | Path, *, ci: str = "normal") -> tuple[str, tuple[Sample, ...]]:
    """Read ``condition,measure,n,mean,ci95``: the remark in the first line, and the samples.

    ``ci95`` is the half width: mean ± ci95. The standard deviation is taken back from it as ``ci`` says, a key of
    ``INTERVALS``: ``normal``, ci95 = 1.96 SD/√n, or ``t``.

    Raises
    ------
    LutgenError
        As :func:`read_counts`; a measure that is none of ``MEASURES``, or an interval below 0.

    """
    remark, rows = read_rows(file, SUMMARY)
    made = []
    for row in rows:
        measure = row.text("measure")
        if measure not in MEASURES:
            raise row.refused("measure", pick_one("measure", measure, MEASURES))
        n = row.whole("n", low=2)
        mean = row.number("mean", low=0.0)
        sd = row.number("ci95", low=0.0) / half_width(n, ci)
        made.append(Sample(measure, row.text("condition"), n, mean, sd))
    _check_once(rows, [(one.measure, one.condition) for one in made])
    made.sort(key=lambda one: list(MEASURES).index(one.measure))
    return remark, tuple(made)


def _check_once(rows: Sequence[Row], keys: Sequence[tuple[str, ...]]) -> None:
    for place, key in enumerate(keys):
        if key in keys[:place]:
            row = rows[place]
            raise row.error("condition", f"appears twice{f' for {key[0]}' if len(key) > 1 else ''}. Keep one line.")
