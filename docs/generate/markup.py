"""Convert docstrings (reStructuredText with numpydoc sections) to Markdown, and write Markdown tables."""

from __future__ import annotations

import re
from textwrap import dedent
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

#: Last line of every generated page, an invisible comment. It is not the first line, because a site takes the title
#: from there.
MADE = "<!-- Made by `make reference` from the code; do not edit. -->"

_ROLE = re.compile(r":\w+:`~?(?:[\w.]+\.)?(\w+)`")
_SECTION = re.compile(r"^(Parameters|Attributes|Returns|Raises|Examples|Notes)\n-+\n", re.MULTILINE)
_DOI = re.compile(r"(?<![\w/\[])doi:(10\.\d{4,}/[\w./()-]*[\w])")


def page(title: str, *parts: str) -> str:
    """Join the parts of a generated page."""
    body = "\n\n".join(part.strip("\n") for part in (f"# {title}", *parts) if part.strip())
    return f"{body}\n\n{MADE}\n"


def inline(text: str) -> str:
    """Convert the inline markup of reStructuredText, and link DOIs."""
    text = _ROLE.sub(r"`\1`", text).replace("``", "`")
    return _DOI.sub(r"[doi:\1](https://doi.org/\1)", text)


def docstring(text: str | None) -> str:
    """Convert a docstring: paragraphs stay, sections of numpydoc become lists."""
    head, *rest = _SECTION.split(dedent(text or "").strip())
    parts = [_paragraphs(head)]
    for name, body in zip(rest[::2], rest[1::2], strict=True):
        parts.append(f"**{name}**\n\n{_items(body) if name not in {'Examples', 'Notes'} else _paragraphs(body)}")
    return "\n\n".join(part.strip("\n") for part in parts if part.strip())


def _paragraphs(text: str) -> str:
    """Convert paragraphs; indented text after ``::`` becomes a code block."""
    parts = []
    for block in re.split(r"\n{2,}", text.strip()):
        if block.startswith("    "):
            parts.append(f"```text\n{dedent(block)}\n```")
        elif block.strip() != "::":
            parts.append(inline(re.sub(r"::$", ":", block)))
    return "\n\n".join(parts)


def _items(body: str) -> str:
    """Convert definitions: each line that is not indented is a term, followed by its indented description."""
    items: list[str] = []
    for line in body.rstrip().splitlines():
        if line.startswith(" "):
            items[-1] += (" " if items[-1].endswith((".", ";", ",", ":")) else "") + " " + line.strip()
        elif line.strip():
            items.append(f"- `{line.strip()}`:")
    return "\n".join(re.sub(r" +", " ", inline(item)) for item in items)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in row) + " |" for row in lines
    )


def anchor(title: str) -> str:
    """Return the anchor that site builders and repository viewers give a heading."""
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
