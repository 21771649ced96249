"""The parts of a page: sentences, headlines, code and tables. The same parts are shown in the terminal and in HTML."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table as TerminalTable
    from rich.text import Text


@dataclass(frozen=True)
class Headline:
    """An emphasised sentence: the finding of a page, or the title of the following parts."""

    text: str


@dataclass(frozen=True)
class Code:
    """The text of a file, whose lines are shown as they are: no line is wrapped."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table of texts; the renderer sets its look. Raises ValueError for a row of another length."""

    #: One text for each column.
    headings: Sequence[str]
    #: Rows with one text for each heading; the first cell names the row.
    rows: Sequence[Sequence[str]]
    #: Indices of the columns with words, which are aligned left; other columns hold figures, aligned right.
    words: Collection[int] = (0,)
    #: Indices of emphasised rows, and of pale rows.
    strong: Collection[int] = ()
    faint: Collection[int] = ()
    #: Whether cells of the first column are never wrapped, even in a narrow terminal.
    unbroken: bool = False
    #: Caption of the table; "" if the page names the table.
    caption: str = ""
    #: Sentences below the table that explain it.
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Check that each row has as many cells as headings."""
        for row in self.rows:
            if len(row) != len(self.headings):
                raise ValueError(f"{len(row)} cells under {len(self.headings)} headings: {list(row)}")


#: A sentence, a headline, code or a table; "" is an empty line.
Part = str | Headline | Code | Table

#: The parts that a command prints, in order.
Page = Iterable[Part]


def headline_text(headline: Headline) -> Text:
    """Return a headline in bold for a terminal."""
    from rich.text import Text

    return Text(headline.text, style="bold")


def terminal_table(table: Table) -> TerminalTable:
    """Return a table of plain texts for a terminal, without frame and notes."""
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
