"""The parts of a page: sentences, headlines and tables. A page is made of them once, for the terminal and for HTML."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table as TerminalTable
    from rich.text import Text


@dataclass(frozen=True)
class Headline:
    """A sentence that stands out: the finding of a page, or the title of what follows."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table of texts; where it is rendered decides its look. Raises ValueError for a row of another length."""

    #: One text a column.
    headings: Sequence[str]
    #: One text a cell, as many as there are headings; the first cell names the row.
    rows: Sequence[Sequence[str]]
    #: Numbers of the columns that hold words, which are aligned left; the others hold figures, aligned right.
    words: Collection[int] = (0,)
    #: Numbers of the rows that stand out, and of those that step back.
    strong: Collection[int] = ()
    faint: Collection[int] = ()
    #: Whether the cells of the first column are never broken into lines, however narrow the terminal is.
    unbroken: bool = False
    #: What the table is; "" where the page says so.
    caption: str = ""
    #: Sentences below the table that explain it.
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Hold each row to the headings."""
        for row in self.rows:
            if len(row) != len(self.headings):
                raise ValueError(f"{len(row)} cells under {len(self.headings)} headings: {list(row)}")


#: A sentence, a headline or a table; "" is an empty line.
Part = str | Headline | Table

#: What a command prints, in order.
Page = Iterable[Part]


def headline_text(headline: Headline) -> Text:
    """Set a headline in bold, for a terminal."""
    from rich.text import Text

    return Text(headline.text, style="bold")


def terminal_table(table: Table) -> TerminalTable:
    """Lay a table of plain texts out for a terminal, without frame and without its notes."""
    from rich.table import Table as TerminalTable
    from rich.text import Text

    laid_out = TerminalTable(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for column, heading in enumerate(table.headings):
        words = column in table.words
        laid_out.add_column(
            Text(heading), justify="left" if words else "right", no_wrap=not words, vertical="top", overflow="fold"
        )
    for number, row in enumerate(table.rows):
        first, *others = row
        cells = (Text(first, no_wrap=table.unbroken or None), *map(Text, others))
        style = "bold" if number in table.strong else "dim" if number in table.faint else ""
        laid_out.add_row(*cells, style=style)
    return laid_out
