"""Tables that users bring: a CSV with a header, cells that are checked one by one, and comments in lines with ``#``."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen import cells
from lutgen.errors import LutgenError
from lutgen.files import read_at_most

if TYPE_CHECKING:
    from collections.abc import Sequence

#: A row is some tens of bytes, and nobody reads a million images.
MAX_BYTES = 64_000_000

#: What a column of yes and no may hold.
_YES_NO = {"1": True, "0": False, "true": True, "false": False, "yes": True, "no": False}


@dataclass(frozen=True)
class Row:
    """A line of a table; errors name file, line and column."""

    file: str
    line: int
    cells: dict[str, str]

    def error(self, column: str, what: str) -> LutgenError:
        """Return the error of a cell, which it quotes."""
        return self.refused(column, f"{self.cells[column][:80]!r} {what}")

    def refused(self, column: str, why: object) -> LutgenError:
        """Return the error of a cell in words that name it already."""
        return LutgenError(f"{self.file}, line {self.line}, column {column}: {why}")

    def text(self, column: str) -> str:
        """Return a word. Raises LutgenError for an empty cell, or one that cannot be printed."""
        cell = self.cells[column]
        if not cell or not cell.isprintable():
            raise self.error(column, "is no name. Write letters or digits.")
        return cell

    def number(self, column: str, *, low: float, high: float = 1e9, above: bool = False) -> float:
        """Return a number from ``low`` (above it, with ``above``) to ``high``. Raises LutgenError for any other."""
        cell = self.cells[column]
        value = cells.number(cell)
        if value is None or not low <= value <= high or (above and value == low):
            least = f"above {low:g}" if above else f"of at least {low:g}"
            raise self.error(column, f"is no number {least} and at most {high:g}. Write it with a decimal point.")
        return value

    def whole(self, column: str, *, low: int, high: int = 1_000_000) -> int:
        """Return a whole number. Raises LutgenError for any other."""
        cell = self.cells[column]
        value = cells.whole(cell, least=low, most=high)
        if value is None:
            raise self.error(column, f"is no whole number in {low}..{high}.")
        return value

    def yes_no(self, column: str) -> bool:
        """Return whether a cell says yes. Raises LutgenError for what is neither."""
        answer = _YES_NO.get(self.cells[column].lower())
        if answer is None:
            raise self.error(column, f"is neither yes nor no. Pick one of: {', '.join(_YES_NO)}.")
        return answer


def read_rows(file: str | Path, columns: Sequence[str], *, optional: Sequence[str] = ()) -> tuple[str, tuple[Row, ...]]:
    """Read a table that has exactly these columns, and any of the optional ones, in any order.

    Returns
    -------
    remark
        The comment in the first line, without ``#``; empty where there is none.
    rows
        At least one.

    Raises
    ------
    LutgenError
        The file cannot be read, is too large or no UTF-8, has other columns, or no rows; a line has more or fewer
        cells.

    """
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
