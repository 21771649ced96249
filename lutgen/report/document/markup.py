"""From the parts of a page to HTML: sentences become paragraphs, tables become tables."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from lutgen.report.parts import Page


def printed(page: Page) -> str:
    """Write what a command prints, sentences and tables; blank lines are left to the style."""
    parts = []
    for part in page:
        if isinstance(part, Table):
            parts.append(table_html(part))
            parts += [f"<p>{escape(note)}</p>" for note in part.notes]
        elif isinstance(part, Headline):
            parts.append(f'<p class="finding">{escape(part.text)}</p>')
        elif part.strip():
            parts.append(f"<p>{escape(part)}</p>")
    return "\n".join(parts)


def table_html(table: Table) -> str:
    """Write a table."""
    kinds = [' class="words"' if column in table.words else "" for column in range(len(table.headings))]
    head = "".join(
        f'<th scope="col"{kind}>{_text(text)}</th>' for text, kind in zip(table.headings, kinds, strict=True)
    )
    lines = []
    for number, row in enumerate(table.rows):
        first, *others = (_text(cell) for cell in row)
        cells = "".join(f"<td{kind}>{cell}</td>" for cell, kind in zip(others, kinds[1:], strict=True))
        bold = ' class="strong"' if number in table.strong else ""
        lines.append(f'<tr{bold}><th scope="row"{kinds[0]}>{first}</th>{cells}</tr>')
    above = f"<caption>{escape(table.caption)}</caption>" if table.caption else ""
    body = "\n".join(lines)
    return f'<div class="scroll"><table>{above}<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>'


def _text(cell: str) -> str:
    return escape(cell).replace("\n", "<br>")
