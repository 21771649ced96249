"""The parts of a page: sentences, headlines and tables. A page is made of them once, for the terminal and for HTML."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Headline:
    """A sentence that stands out: the finding of a page, or the title of what follows."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table of texts; where it is rendered decides its look.

    Attributes
    ----------
    headings
        One text a column.
    rows
        One text a cell, as many as there are headings; the first cell names the row.
    words
        Numbers of the columns that hold words, which are aligned left; the others hold figures, aligned right.
    strong, faint
        Numbers of the rows that stand out, and of those that step back.
    unbroken
        Whether the cells of the first column are never broken into lines, however narrow the terminal is.
    caption
        What the table is; "" where the page says so.
    notes
        Sentences below the table that explain it.

    Raises
    ------
    ValueError
        A row has more or fewer cells than there are headings.

    """

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Collection[int] = (0,)
    strong: Collection[int] = ()
    faint: Collection[int] = ()
    unbroken: bool = False
    caption: str = ""
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
