"""Tables of a study as CSV: answers, published counts and means, and the tables of an analysis.

A table from a user has a header, cells that are checked one by one, and comments in lines that begin with ``#``.
"""

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from math import isfinite
from pathlib import Path
from typing import Any

from lutgen import cells
from lutgen.errors import LutgenError, pick_one
from lutgen.files import read_at_most
from lutgen.study.analysis import Analysis
from lutgen.study.answers import MAX_SECONDS, Answer
from lutgen.study.statistics import MEASURES, AgreementCounts, StudySample, half_width

#: Most bytes of a table: a row has some tens of bytes, and nobody reads a million images.
MAX_BYTES = 64_000_000

#: Cell of a yes-or-no column → whether it means yes.
_YES_NO = {"1": True, "0": False, "true": True, "false": False, "yes": True, "no": False}


@dataclass(frozen=True)
class Row:
    """A line of a table. Errors name file, line and column."""

    file: str
    line: int
    cells: dict[str, str]

    def error(self, column: str, what: str) -> LutgenError:
        """Return the error for a cell. The message quotes the cell."""
        return self.refused(column, f"{self.cells[column][:80]!r} {what}")

    def refused(self, column: str, why: object) -> LutgenError:
        """Return the error for a cell, with the message ``why``."""
        return LutgenError(f"{self.file}, line {self.line}, column {column}: {why}")

    def text(self, column: str) -> str:
        """Return the text of a cell. Raises LutgenError for an empty cell, or one that cannot be printed."""
        cell = self.cells[column]
        if not cell or not cell.isprintable():
            raise self.error(column, "is no name. Write letters or digits.")
        return cell

    def number(self, column: str, *, low: float, high: float = 1e9, above: bool = False) -> float:
        """Return a number from ``low`` (excluded with ``above``) to ``high``. Raises LutgenError for any other cell."""
        cell = self.cells[column]
        value = cells.number(cell)
        if value is None or not low <= value <= high or (above and value == low):
            least = f"above {low:g}" if above else f"of at least {low:g}"
            raise self.error(column, f"is no number {least} and at most {high:g}. Write it with a decimal point.")
        return value

    def whole(self, column: str, *, low: int, high: int = 1_000_000) -> int:
        """Return a whole number. Raises LutgenError for any other cell."""
        cell = self.cells[column]
        value = cells.whole(cell, least=low, most=high)
        if value is None:
            raise self.error(column, f"is no whole number in {low}..{high}.")
        return value

    def yes_no(self, column: str) -> bool:
        """Return whether a cell means yes. Raises LutgenError for a cell that means neither yes nor no."""
        answer = _YES_NO.get(self.cells[column].lower())
        if answer is None:
            raise self.error(column, f"is neither yes nor no. Pick one of: {', '.join(_YES_NO)}.")
        return answer


def read_rows(file: str | Path, columns: Sequence[str], *, optional: Sequence[str] = ()) -> tuple[str, tuple[Row, ...]]:
    """Return the remark in the first line, and the rows of these columns. Raises LutgenError: another table."""
    advice = f"Give a .csv with {','.join(columns)}."
    data = read_at_most(Path(file), MAX_BYTES, what="the table", none="such table", advice=advice)
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise LutgenError(f"{file}: is no text in UTF-8. Save the table as CSV in UTF-8.") from None
    remark = lines[0].removeprefix("#").strip() if lines and lines[0].startswith("#") else ""
    header: list[str] = []
    rows = []
    for number, line in enumerate(lines, start=1):
        if not line.strip() or cells.is_comment(line):
            continue
        row = _split(file, number, line)
        if not header:
            header = row
            _check_header(file, number, header, columns, optional)
        elif len(row) != len(header):
            message = f"{file}, line {number}: {len(row)} cells for {len(header)} columns. Write decimals as 41.0."
            raise LutgenError(message)
        else:
            rows.append(Row(str(file), number, dict(zip(header, row, strict=True))))
    if not rows:
        raise LutgenError(f"{file}: no rows. The table needs the header {','.join(columns)} and a line for each row.")
    return remark, tuple(rows)


def _split(file: str | Path, number: int, line: str) -> list[str]:
    try:
        return [cell.strip(cells.BLANKS) for cell in next(csv.reader([line], strict=True))]
    except csv.Error as error:
        raise LutgenError(f"{file}, line {number}: is no CSV: {error}. Check its quotes.") from None


def _check_header(
    file: str | Path, number: int, header: Sequence[str], columns: Sequence[str], optional: Sequence[str]
) -> None:
    needed = [column for column in header if column not in optional]
    if sorted(needed) != sorted(columns) or len(set(header)) < len(header):
        given = ",".join(header)[:200]
        may = f", and may have {','.join(optional)}" if optional else ""
        raise LutgenError(f"{file}, line {number}: the header is {given}; it must be {','.join(columns)}{may}.")


COLUMNS = tuple(field.name for field in fields(Answer))


def read_answer_table(file: str | Path) -> tuple[str, tuple[Answer, ...]]:
    """Return the remark in the first line, and the answers. Raises LutgenError: an invalid cell, or an image twice."""
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
    """Return answers as a table whose first line is a remark. Raises LutgenError for a remark of several lines."""
    if not remark or not remark.isprintable():
        raise LutgenError("the remark of a table of answers must be one line of text.")
    rows = ([int(cell) if isinstance(cell, bool) else cell for cell in astuple(answer)] for answer in answers)
    return cells.csv_text([COLUMNS, *rows], remark=remark)


COUNTS = ("condition", "agreed", "disagreed")
SUMMARY = ("condition", "measure", "n", "mean", "ci95")

#: Largest count in a table: for counts ten times as large the exact tests take minutes.
MOST = 10_000


def read_counts(file: str | Path) -> tuple[str, tuple[AgreementCounts, ...]]:
    """Read a table ``condition,agreed,disagreed``: the remark and the rows; errors as :func:`read_rows`."""
    remark, rows = read_rows(file, COUNTS)
    counts = []
    for row in rows:
        agreed, disagreed = (row.whole(column, low=0, high=MOST) for column in COUNTS[1:])
        count = AgreementCounts(row.text("condition"), agreed, disagreed)
        if not count.n:
            raise row.refused("agreed", "agreed and disagreed are both 0, so nothing was compared. Leave the line out.")
        counts.append(count)
    _check_once(rows, [(row.condition,) for row in counts])
    return remark, tuple(counts)


def read_summary(file: str | Path, *, ci: str = "normal") -> tuple[str, tuple[StudySample, ...]]:
    """Read a table ``condition,measure,n,mean,ci95`` (ci95: half the width); errors as :func:`read_rows`."""
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
    _check_once(rows, [(sample.measure, sample.condition) for sample in samples])
    samples.sort(key=lambda sample: list(MEASURES).index(sample.measure))
    return remark, tuple(samples)


def _check_once(rows: Sequence[Row], keys: Sequence[tuple[str, ...]]) -> None:
    for place, key in enumerate(keys):
        if key in keys[:place]:
            row = rows[place]
            raise row.error("condition", f"appears twice{f' for {key[0]}' if len(key) > 1 else ''}. Keep one line.")


def _effects_of_models(analysis: Analysis) -> list[dict[str, Any]]:
    return [
        {"measure": model.measure, "effect": model.effect, "against": model.against, "n": model.n, **asdict(each)}
        for model in analysis.mixed
        for each in model.effects
    ]


#: File that ``--csv`` may write → its rows; a table without rows is left out.
TABLE_FILES: dict[str, Callable[[Analysis], Iterable[Mapping[str, Any]]]] = {
    "table2.csv": lambda analysis: map(asdict, analysis.table2.means),
    "table2-tests.csv": lambda analysis: map(asdict, analysis.table2.tests),
    "table3.csv": lambda analysis: map(asdict, analysis.table3),
    "table4.csv": lambda analysis: map(asdict, analysis.table4),
    "beyond-means.csv": lambda analysis: map(asdict, analysis.means),
    "beyond-agreement.csv": lambda analysis: map(asdict, analysis.agreement),
    "beyond-kappa.csv": lambda analysis: map(asdict, analysis.kappas),
    "beyond-mixed.csv": _effects_of_models,
    "beyond-holm.csv": lambda analysis: map(asdict, analysis.holm),
}


def tables_csv(analysis: Analysis) -> dict[str, str]:
    """Return name → text of every table that has rows. The first line states the source of the figures."""
    tables = {name: [dict(_flat(row)) for row in rows(analysis)] for name, rows in TABLE_FILES.items()}
    remark = " ".join(analysis.sources)
    return {
        name: cells.csv_text([table[0], *(map(_cell, row.values()) for row in table)], remark=remark)
        for name, table in tables.items()
        if table
    }


def _flat(row: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the cells of a row: intervals as ``…_low`` and ``…_high``, McNemar's test in separate columns."""
    for name, value in row.items():
        if name == "mcnemar":
            for part in ("pairs", "first_only", "second_only", "p"):
                yield f"mcnemar_{part}", "" if value is None else value[part]
        elif isinstance(value, tuple):
            yield f"{name}_low", value[0]
            yield f"{name}_high", value[1]
        else:
            yield name, value


def _cell(value: Any) -> Any:
    """Format a cell: twelve digits, which do not depend on the processor's rounding; empty if not finite."""
    if not isinstance(value, float):
        return value
    return f"{value:.12g}" if isfinite(value) else ""
