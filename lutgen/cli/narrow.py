"""Tables on a narrow terminal: headings and long texts wrap at spaces, and no figure or name is cut off."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.text import Text

if TYPE_CHECKING:
    from rich.table import Column, Table

#: Letters of a cell that is never wrapped: a figure with its unit, a span, an hour, a short name.
WHOLE = 16
#: Letters of a word that may be folded: a path.
LONGEST_WORD = 40


def fitted(table: Table, console: Console) -> Console:
    """Narrow the columns until the table fits the console; return one that is wide enough when they cannot be.

    rich itself cuts what does not fit, so that 0.3127 becomes 0.312; a line that the terminal wraps says all.
    """
    natural = [max(map(cell_len, _texts(column))) for column in table.columns]
    unbounded = console.options.update(width=2 * sum(natural) + 100)
    between = Measurement.get(console, unbounded, table).maximum - sum(natural)
    if sum(natural) + between <= console.width:
        return console
    least = [_least(column) for column in table.columns]
    widths = list(natural)
    while sum(widths) + between > console.width and widths != least:
        place = max(range(len(widths)), key=lambda column: (widths[column] > least[column], widths[column]))
        widths[place] -= 1
    for column, width in zip(table.columns, widths, strict=True):
        column.width, column.no_wrap = width, False
    return Console(file=console.file, highlight=False, width=max(console.width, sum(widths) + between))


def _texts(column: Column) -> list[str]:
    return [line for cell in (column.header, *column.cells) for line in str(cell).split("\n")]


def _least(column: Column) -> int:
    return max(_longest_word(str(column.header)), *map(_least_of, column.cells), 1)


def _least_of(cell: object) -> int:
    text = str(cell)
    if cell_len(text) <= WHOLE or (isinstance(cell, Text) and cell.no_wrap):
        return cell_len(text)
    return max(WHOLE, min(LONGEST_WORD, _longest_word(text)))


def _longest_word(text: str) -> int:
    return max(map(cell_len, text.split()), default=0)
