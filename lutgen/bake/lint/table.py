"""Reading anybody's ``.spi3d``, ``.csp`` and ``.3dl``: the header, the rows, and what OpenColorIO says of them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.bake.lint.programs import Refusal
from lutgen.bake.lint.programs.opencolorio import apply
from lutgen.bake.lint.statistics import MAX_KEPT
from lutgen.bake.lint.stream import blocks
from lutgen.bake.lint.trial import MAX_BYTES, probe_colours

if TYPE_CHECKING:
    from pathlib import Path

_NAN = re.compile(rb"(?i)(?:^|\s)[-+]?(?:nan|inf(?:inity)?)(?=\s|$)")
_COMMA = re.compile(rb"\d,\d")

#: A row of each format, in which the table's size is not one: .spi3d rows begin with their three indices.
_ROW = {
    ".spi3d": re.compile(rb"\s*\d+\s+\d+\s+\d+\s+\S+\s+\S+\s+\S+\s*$"),
    ".csp": re.compile(rb"\s*\S+\s+\S+\s+\S+\s*$"),
}
_SIZE = re.compile(rb"\s*(\d+)\s+(\d+)\s+(\d+)\s*$")


@dataclass(frozen=True)
class TableScan:
    """Such a file as it stands.

    Attributes
    ----------
    size
        Points along each axis as its header says, () where it says nothing.
    rows
        Rows behind the header.
    nan, comma
        The first line with NaN or infinity, and with a decimal comma; 0 without one.
    refusal
        Why the installed OpenColorIO does not read it; empty where it does, None where it was not asked.

    """

    path: Path
    bytes: int
    size: tuple[int, ...]
    rows: int
    nan: int
    comma: int
    refusal: str | None


def scan_table(path: Path) -> TableScan:
    """Read such a file in one pass, then ask the installed OpenColorIO, unless its header would take all memory.

    Raises
    ------
    LutgenError
        The file cannot be read, or is no text.

    """
    row = _ROW.get(path.suffix.lower())
    size: tuple[int, ...] = ()
    rows = nan = comma = 0
    for block in blocks(path):
        for number, line in enumerate(block.data.splitlines(), block.first):
            nan = nan or (number if _NAN.search(line) else 0)
            comma = comma or (number if _COMMA.search(line) else 0)
            header = _SIZE.match(line) if row and not size else None
            if header:
                size = tuple(int(word[:9]) for word in header.groups())
            elif row and size and row.match(line):
                rows += 1
    bytes_ = path.stat().st_size
    asked = max(size, default=0) <= MAX_KEPT and bytes_ <= MAX_BYTES
    return TableScan(path, bytes_, size, rows, nan, comma, refusal(path) if asked else None)


def refusal(path: Path) -> str:
    """Return why the installed OpenColorIO does not read a file; empty where it does."""
    try:
        apply(path, probe_colours())
    except Refusal as refused:
        said = " ".join(str(refused).split())
        return said.rpartition("failed with: ")[2].replace(str(path), path.name)[:300] or "it says nothing"
    return ""
