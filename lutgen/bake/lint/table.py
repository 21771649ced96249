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
from lutgen.bindings import unclosed_metadata

if TYPE_CHECKING:
    from pathlib import Path

_NAN = re.compile(rb"(?i)(?:^|\s)[-+]?(?:nan|inf(?:inity)?)(?=\s|$)")
_COMMA = re.compile(rb"\d,\d")

#: A row of each format, in which the table's size is not one: .spi3d rows begin with their three indices, and a .3dl
#: says no size at all.
_ROW = {
    ".spi3d": re.compile(rb"\s*\d+\s+\d+\s+\d+\s+\S+\s+\S+\s+\S+\s*$"),
    ".csp": re.compile(rb"\s*\S+\s+\S+\s+\S+\s*$"),
    ".3dl": re.compile(rb"\s*(\d+)\s+(\d+)\s+(\d+)\s*$"),
}
_SIZE = re.compile(rb"\s*(\d+)\s+(\d+)\s+(\d+)\s*$")

#: Letters of a first line that are kept.
MAX_HEAD = 1000


@dataclass(frozen=True)
class TableScan:
    """Such a file as it stands.

    Attributes
    ----------
    ends
        Its line ends, of "LF", "CRLF", "CR".
    size
        Points along each axis as its header says, () where it says nothing.
    rows
        Rows behind the header.
    head, largest
        Of a .3dl, its first line that is no comment, and the largest number of its rows.
    nan, comma, unclosed
        The first line with NaN or infinity, with a decimal comma, and with metadata that never end; 0 without one.
    refusal
        Why the installed OpenColorIO does not read it; empty where it does, None where it was not asked.

    """

    path: Path
    bytes: int
    ends: frozenset[str]
    size: tuple[int, ...]
    rows: int
    head: str
    largest: int
    nan: int
    comma: int
    unclosed: int
    refusal: str | None


def scan_table(path: Path) -> TableScan:
    """Read such a file in one pass, then ask the installed OpenColorIO, unless its header would take all memory.

    Raises
    ------
    LutgenError
        The file cannot be read, or is no text.

    """
    suffix = path.suffix.lower()
    row, sized = _ROW[suffix], suffix != ".3dl"
    # In a .spi3d, three numbers on a line are the size wherever they stand.
    behind_curves = _BehindCurves() if suffix == ".csp" else bool
    size: tuple[int, ...] = ()
    head, rows, largest, nan, comma = "", 0, 0, 0, 0
    ends: set[str] = set()
    for block in blocks(path):
        ends |= block.ends
        for number, line in enumerate(block.data.splitlines(), block.first):
            nan = nan or (number if _NAN.search(line) else 0)
            comma = comma or (number if _COMMA.search(line) else 0)
            if not head and line.strip() and not line.startswith(b"#"):
                head = line[:MAX_HEAD].decode("ascii", errors="replace").strip()
            header = _SIZE.match(line) if sized and not size and behind_curves(line) else None
            if header:
                size = tuple(int(word[:9]) for word in header.groups())
            elif (size or not sized) and (found := row.match(line)):
                rows += 1
                largest = max(largest, 0, *(int(word[:9]) for word in found.groups()))
    bytes_ = path.stat().st_size
    asked = max(size, default=0) <= MAX_KEPT and bytes_ <= MAX_BYTES
    unclosed = unclosed_metadata(path)
    said = refusal(path) if asked and not unclosed else None
    return TableScan(path, bytes_, frozenset(ends), size, rows, head, largest, nan, comma, unclosed, said)


class _BehindCurves:
    """Says of each line of a ``.csp`` whether it stands behind the three curves, where the table's size is.

    A curve is its number of points, and from two on a line of inputs and one of outputs. Three points look like a
    size, and so do the rows of a 1D file, which has none.
    """

    def __init__(self) -> None:
        self._table, self._metadata, self._curves, self._lines = False, False, 0, 0

    def __call__(self, line: bytes) -> bool:
        """Take the next line."""
        words = line.strip().upper()
        if words.startswith((b"BEGIN METADATA", b"END METADATA")):
            self._metadata = words.startswith(b"BEGIN")
        elif self._metadata or not words:
            return False
        elif not self._table:
            self._table = words == b"3D"
        elif self._lines:
            self._lines -= 1
        elif self._curves < 3:
            self._curves += 1
            self._lines = 0 if words in {b"0", b"1"} else 2
        else:
            return True
        return False


def refusal(path: Path) -> str:
    """Return why the installed OpenColorIO does not read a file; empty where it does."""
    try:
        apply(path, probe_colours())
    except Refusal as refused:
        said = " ".join(str(refused).split())
        return said.rpartition("failed with: ")[2].replace(str(path), path.name)[:300] or "it says nothing"
    return ""
