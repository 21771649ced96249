"""From the pages that commands print to HTML: sentences become paragraphs, tables become tables."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rich.console import RenderableType


def printed(page: Iterable[RenderableType]) -> str:
    """Write what a command prints, sentences and tables; blank lines are left to the style."""
    parts = []
    for part in page:
        if isinstance(part, Table):
            parts.append(_rich_table(part))
        elif str(part).strip():
            kind = ' class="finding"' if getattr(part, "style", "") == "bold" else ""
            parts.append(f"<p{kind}>{escape(str(part))}</p>")
    return "\n".join(parts)


def _rich_table(made: Table) -> str:
    columns = [list(column.cells) for column in made.columns]
    left = [column.justify == "left" for column in made.columns]
    strong = [str(row.style or "") == "bold" for row in made.rows]
    return table([str(column.header) for column in made.columns], zip(*columns, strict=True), left, strong)


def table(
    heads: Sequence[str],
    rows: Iterable[Sequence[Any]],
    left: Sequence[bool] = (),
    strong: Sequence[bool] = (),
    caption: str = "",
) -> str:
    """Write a table.

    Parameters
    ----------
    heads
        A text a column.
    rows
        A text a cell; the first of each row names it.
    left
        Whether each column holds words; else figures. By default the first does.
    strong
        Whether each row stands out; by default none.
    caption
        What the table is.

    """
    words = list(left) or [place == 0 for place in range(len(heads))]
    kinds = [' class="words"' if word else "" for word in words]
    head = "".join(f'<th scope="col"{kind}>{_text(text)}</th>' for text, kind in zip(heads, kinds, strict=True))
    lines = []
    for number, row in enumerate(rows):
        first, *others = (_text(cell) for cell in row)
        cells = "".join(f"<td{kind}>{cell}</td>" for cell, kind in zip(others, kinds[1:], strict=True))
        bold = ' class="strong"' if number < len(strong) and strong[number] else ""
        lines.append(f'<tr{bold}><th scope="row"{kinds[0]}>{first}</th>{cells}</tr>')
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    body = "\n".join(lines)
    return f'<div class="scroll"><table>{above}<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>'


def _text(cell: object) -> str:
    return escape(str(cell)).replace("\n", "<br>")
