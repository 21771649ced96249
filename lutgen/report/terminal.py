"""The parts of a page for a terminal, as rich prints them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table as TerminalTable
from rich.text import Text

if TYPE_CHECKING:
    from lutgen.report.parts import Headline, Table


def headline_text(headline: Headline) -> Text:
    """Set a headline in bold."""
    return Text(headline.text, style="bold")


def terminal_table(table: Table) -> TerminalTable:
    """Lay a table out without frame; its notes are sentences, which the caller prints below it.

    Cells and headings are plain text: brackets and colons in them are no markup of rich's.
    """
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
