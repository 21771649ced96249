"""Tables of a study as CSV: answers, what others counted or averaged, and the tables of an analysis."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict, astuple, fields
from math import isfinite
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError, pick_one
from lutgen.study.analysis.agreement import AgreementCounts
from lutgen.study.analysis.statistics import MEASURES, StudySample, half_width
from lutgen.study.answers import MAX_SECONDS, Answer
from lutgen.study.csv_rows import Row, read_rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from lutgen.study.analysis import Analysis

COLUMNS = tuple(field.name for field in fields(Answer))


def read_answer_table(file: str | Path) -> tuple[str, tuple[Answer, ...]]:
    """Read a table of answers: the remark in its first line, and the answers in the order of the lines.

    Raises
    ------
    LutgenError
        As :func:`lutgen.study.csv_rows.read_rows`; a cell out of range; an image twice in a reader's session;
        a category that is positive in one line and negative in another.

    """
    remark, rows = read_rows(file, COLUMNS)
    answers = []
    lines: dict[tuple[str, int, str], int] = {}
    sides: dict[str, tuple[bool, int]] = {}
    for row in rows:
        answer = _answer(row)
        line = lines.setdefault((answer.reader, answer.session, answer.image), row.line)
        if line != row.line:
            raise row.error("image", f"was answered in line {line} already, by this reader in this session.")
        side, line = sides.setdefault(answer.category, (answer.positive, row.line))
        if side != answer.positive:
            raise row.error("positive", f"contradicts line {line}, where {answer.category!r} has the other side.")
        answers.append(answer)
    return remark, tuple(answers)


def _answer(row: Row) -> Answer:
    return Answer(
        reader=row.text("reader"),
        session=row.whole("session", low=1),
        position=row.whole("position", low=1),
        image=row.text("image"),
        condition=row.text("condition"),
        seconds=row.number("seconds", low=0.0, high=MAX_SECONDS, above=True),
        ease=row.whole("ease", low=0, high=1000),
        category=row.text("category"),
        positive=row.yes_no("positive"),
    )


def answer_table(answers: Iterable[Answer], *, remark: str) -> str:
    """Write answers as a table whose first line is a remark. Raises LutgenError for a remark of several lines."""
    if not remark or not remark.isprintable():
        raise LutgenError("the remark of a table of answers must be one line of text.")
    text = io.StringIO()
    text.write(f"# {remark}\n")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for answer in answers:
        table.writerow([int(cell) if isinstance(cell, bool) else cell for cell in astuple(answer)])
    return text.getvalue()


COUNTS = ("condition", "agreed", "disagreed")
SUMMARY = ("condition", "measure", "n", "mean", "ci95")

#: Most that is counted of a kind: with ten times as many the exact tests take minutes.
MOST = 10_000


def read_counts(file: str | Path) -> tuple[str, tuple[AgreementCounts, ...]]:
    """Read ``condition,agreed,disagreed``: the remark in the first line, and the rows.

    Raises
    ------
    LutgenError
        As :func:`lutgen.study.csv_rows.read_rows`; a cell that is no count, a condition twice or without
        any pair.

    """
    remark, rows = read_rows(file, COUNTS)
    counts = []
    for row in rows:
        agreed, disagreed = (row.whole(column, low=0, high=MOST) for column in COUNTS[1:])
        count = AgreementCounts(row.text("condition"), agreed, disagreed)
        if not count.n:
            raise row.error("agreed", "and no disagreed either: nothing was compared. Leave the condition out.")
        counts.append(count)
    _check_once(rows, [(row.condition,) for row in counts])
    return remark, tuple(counts)


def read_summary(file: str | Path, *, ci: str = "normal") -> tuple[str, tuple[StudySample, ...]]:
    """Read ``condition,measure,n,mean,ci95``: the remark in the first line, and the samples.

    ``ci95`` is the half width: mean ± ci95. The standard deviation is taken back from it as ``ci`` says, a key of
    ``INTERVALS``: ``normal``, ci95 = 1.96 SD/√n, or ``t``.

    Raises
    ------
    LutgenError
        As :func:`read_counts`; a measure that is none of ``MEASURES``, or an interval below 0.

    """
    remark, rows = read_rows(file, SUMMARY)
    samples = []
    for row in rows:
        measure = row.text("measure")
        if measure not in MEASURES:
            raise row.refused("measure", pick_one("measure", measure, MEASURES))
        n = row.whole("n", low=2)
        mean = row.number("mean", low=0.0)
        sd = row.number("ci95", low=0.0) / half_width(n, ci)
        samples.append(StudySample(measure, row.text("condition"), n, mean, sd))
    _check_once(rows, [(one.measure, one.condition) for one in samples])
    samples.sort(key=lambda one: list(MEASURES).index(one.measure))
    return remark, tuple(samples)


def _check_once(rows: Sequence[Row], keys: Sequence[tuple[str, ...]]) -> None:
    for place, key in enumerate(keys):
        if key in keys[:place]:
            row = rows[place]
            raise row.error("condition", f"appears twice{f' for {key[0]}' if len(key) > 1 else ''}. Keep one line.")


#: Files that ``--csv`` may write; a table without rows is left out.
TABLE_FILES = (
    "table2.csv",
    "table2-tests.csv",
    "table3.csv",
    "table4.csv",
    "beyond-means.csv",
    "beyond-agreement.csv",
    "beyond-kappa.csv",
    "beyond-mixed.csv",
    "beyond-holm.csv",
)


def tables_csv(analysis: Analysis) -> dict[str, str]:
    """Return name → text of every table that has rows; the first line says where the figures come from."""
    rows: tuple[Iterable[Mapping[str, Any]], ...] = (
        map(asdict, analysis.table2.means),
        map(asdict, analysis.table2.tests),
        map(asdict, analysis.table3),
        map(asdict, analysis.table4),
        map(asdict, analysis.means),
        map(asdict, analysis.agreement),
        map(asdict, analysis.kappas),
        [
            {"measure": model.measure, "effect": model.effect, "against": model.against, "n": model.n, **asdict(each)}
            for model in analysis.mixed
            for each in model.effects
        ],
        map(asdict, analysis.holm),
    )
    flat = {name: [dict(_flat(row)) for row in table] for name, table in zip(TABLE_FILES, rows, strict=True)}
    return {name: _text(table, analysis.sources) for name, table in flat.items() if table}


def _flat(row: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Lay out a row: intervals as ``…_low`` and ``…_high``, McNemar's test in columns of its own."""
    for name, value in row.items():
        if name == "mcnemar":
            for part in ("pairs", "first_only", "second_only", "p"):
                yield f"mcnemar_{part}", "" if value is None else value[part]
        elif isinstance(value, tuple):
            yield f"{name}_low", value[0]
            yield f"{name}_high", value[1]
        else:
            yield name, value


def _text(rows: list[dict[str, Any]], sources: Iterable[str]) -> str:
    text = io.StringIO()
    text.write(f"# {' '.join(sources)}\n")
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    """Write twelve figures, which no last bit of another processor reaches; nothing for what is not finite."""
    if not isinstance(value, float):
        return value
    return f"{value:.12g}" if isfinite(value) else ""
