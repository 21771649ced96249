"""Inserting new parts into a config's own text, so that its comments, order and digits stay.

The text of the parts comes from OpenColorIO's own serialisation. Only YAML's block style is understood, which all tools
write. The result is proved like any other; where the proof fails, the config as OpenColorIO writes it is taken.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.merge.spaces import AgedNames

#: Sections that hold a list of named parts.
SECTIONS = ("looks", "colorspaces", "named_transforms")


def inserted(text: str, written: str, names: Sequence[str], views: Sequence[tuple[str, AgedNames]]) -> str | None:
    """Return ``text`` with the parts ``names`` of ``written`` and the views (display, names); None on failure."""
    lines = _lines(text)
    for section in SECTIONS:
        parts = [part for part in _parts(_lines(written), section) if _name(part) in names]
        if parts:
            lines = _with_parts(lines, section, parts)
    for display, aged in views:
        found = _with_view(lines, display, aged)
        if found is None:
            return None
        lines = found
    listed = _with_active(lines, list(dict.fromkeys(aged.view for _, aged in views)))
    return None if listed is None else "\n".join(listed) + "\n"


def with_search_path(text: str) -> str | None:
    """Return the text with the search path ``.`` where it has none; None where its line is not found."""
    lines = [line for line in _lines(text) if not re.fullmatch(r"search_path:\s*(\"\"|'')?", line)]
    place = next((place for place, line in enumerate(lines) if line.startswith("ocio_profile_version")), None)
    return None if place is None else "\n".join([*lines[: place + 1], "", "search_path: .", *lines[place + 1 :]]) + "\n"


def _lines(text: str) -> list[str]:
    """Split at line feeds only, as YAML does: Unicode's line separators within a sentence do not end a line."""
    return text.removesuffix("\n").split("\n")


def _section(lines: Sequence[str], key: str, indent: int = 0) -> tuple[int, int] | None:
    """Return the index of a key's line and of the first line after its block; None where its value is no block."""
    pattern = re.compile(rf" {{{indent}}}(['\"]?){re.escape(key)}\1:\s*(#.*)?$")
    start = next((place for place, line in enumerate(lines) if pattern.match(line)), None)
    if start is None:
        return None
    end = start + 1
    for place in range(start + 1, len(lines)):
        line = lines[place]
        if line.strip() and not line.lstrip().startswith("#"):
            deeper = len(line) - len(line.lstrip()) > indent
            if not deeper and not (line[indent:].startswith("- ") and line[:indent].isspace() == bool(indent)):
                break
            end = place + 1
    return start, end


def _parts(lines: Sequence[str], section: str) -> list[list[str]]:
    """Return the parts of a section as OpenColorIO writes it, each as its lines."""
    place = _section(lines, section)
    parts: list[list[str]] = []
    for line in lines[place[0] + 1 : place[1]] if place else ():
        if line.startswith("  - "):
            parts.append([])
        if parts and line.strip():
            parts[-1].append(line)
    return parts


def _name(part: Sequence[str]) -> str:
    match = re.search(r"name: (.*)", "\n".join(part))
    return match[1].strip("\"'") if match else ""


def _with_parts(lines: Sequence[str], section: str, parts: Sequence[Sequence[str]]) -> list[str]:
    place = _section(lines, section)
    block = [line for part in parts for line in ("", *part)]
    if place is None:
        return [*lines, "", f"{section}:", *block[1:]]
    start, end = place
    first = next((line for line in lines[start + 1 : end] if line.lstrip().startswith("- ")), "  - ")
    shift = len(first) - len(first.lstrip()) - 2
    moved = [(" " * shift + line if shift > 0 else line[-shift:] if shift else line) if line else "" for line in block]
    return [*lines[:end], *moved, *lines[end:]]


def _with_view(lines: Sequence[str], display: str, aged: AgedNames) -> list[str] | None:
    section = _section(lines, "displays")
    if section is None:
        return None
    first = next((line for line in lines[section[0] + 1 : section[1]] if line.strip() and line.lstrip()[0] != "#"), "")
    inside = _section(lines[section[0] + 1 : section[1]], display, len(first) - len(first.lstrip()))
    if inside is None:
        return None
    start, end = (section[0] + 1 + place for place in inside)
    item = next((line for line in lines[start + 1 : end] if line.lstrip().startswith("- ")), None)
    if item is None:
        return None
    view = f"{item[: len(item) - len(item.lstrip())]}- !<View> {{name: {aged.view}, colorspace: {aged.space}}}"
    return [*lines[:end], view, *lines[end:]]


def _with_active(lines: Sequence[str], views: Sequence[str]) -> list[str] | None:
    """Return the lines with views added to active_views; None where the config lists those on several lines."""
    changed = list(lines)
    for place, line in enumerate(lines):
        if line.startswith("active_views:"):
            head, bracket, rest = line.rpartition("]")
            if not bracket or head.count("[") != 1:
                return None
            inside = head.partition("[")[2].strip()
            if inside:
                changed[place] = f"{head.rstrip(', ')}, {', '.join(views)}]{rest}"
    return changed
