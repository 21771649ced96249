"""Scan of a ``.cube`` in one pass: header lines as written, rows as numbers, and irregularities of both.

A scan accepts every text file. It allocates no memory for the sizes that the header states.
"""

import re
from dataclasses import dataclass, field, replace
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.cells import number
from lutgen.colorimetry import Array
from lutgen.lint.stream import BYTE_ORDER_MARK, LARGEST, LineBlock, TableStatistics, blocks, shown

#: Maximum number of stored header lines, so that a file of keywords alone does not fill the memory.
MAX_ENTRIES = 1000

#: Characters of plain rows of numbers. A block with other characters is read line by line.
_PLAIN = b"0123456789.+-eE \t\n"

#: A number with such an exponent may be smaller than any double. numpy reads it as 0.
_TINY = re.compile(rb"[eE]-\d{3}")
_NOT_ZERO, _SMALLEST = re.compile(rb"[-+]?[0.]*[1-9]"), 5e-324

#: Maximum distance between an identity 1D part and its input: the rounding to five decimals.
IDENTITY = 1e-5

#: Smallest number with the full precision of float32.
SMALLEST_NORMAL = float(np.finfo(np.float32).tiny)


class Entry(NamedTuple):
    """A line of the header: the keyword as written, the words after it, and the number of rows before the line."""

    line: int
    keyword: str
    words: tuple[str, ...]
    text: str
    rows_before: int

    def numbers(self, count: int) -> tuple[float, ...] | None:
        """Return the numbers after the keyword; None when the words are not exactly ``count`` numbers."""
        numbers = tuple(value for word in self.words if (value := number(word, non_finite=True)) is not None)
        return numbers if len(numbers) == len(self.words) == count else None

    @property
    def domain(self) -> tuple[float, ...] | None:
        """The three finite numbers of a DOMAIN line; None for other words."""
        numbers = self.numbers(3)
        return numbers if numbers and all(map(isfinite, numbers)) else None


@dataclass(frozen=True)
class Oddity:
    """An irregularity of the rows: its first line, a sample of this line, and the number of affected lines."""

    line: int
    sample: str
    count: int

    @property
    def rows(self) -> str:
        """The number of affected rows, as text."""
        return f"{self.count} row{'s' if self.count != 1 else ''}"


@dataclass
class CubeScan:
    """The result of a scan, which is filled block by block: blocks of plain rows at once, other blocks line by line."""

    path: Path
    #: Whether rows are stored.
    keep: bool
    #: Bytes of the file.
    length: int = 0
    #: The number of the first LUT_1D_SIZE; 0 when the line is missing or has no number.
    size_1d: int = 0
    #: Whether the file starts with a UTF-8 byte order mark.
    marked: bool = False
    #: Whether a line ends in a single CR.
    single_cr: bool = False
    #: The lines of the header, at most ``MAX_ENTRIES``.
    entries: list[Entry] = field(default_factory=list)
    #: Kind of irregularity → the affected lines: ``nan``, ``infinite``, ``overflow``, ``subnormal``, ``decimal comma``,
    #: ``comma``, ``comment``, ``columns``, ``text``, ``NUL``, ``tab``, ``not UTF-8``.
    oddities: dict[str, Oddity] = field(default_factory=dict)
    #: The number of rows of the 1D part, its stored rows, and their largest distance from the identity.
    shaper_rows: int = 0
    _shaper: list[Array] = field(default_factory=list)
    _bend: float = 0.0
    #: The rows of the 3D part.
    table: TableStatistics = field(init=False)

    def __post_init__(self) -> None:
        self.table = TableStatistics(0, keep=self.keep)

    @property
    def size(self) -> int:
        """The number of the first LUT_3D_SIZE; 0 when the line is missing or has no number."""
        return self.table.size

    @property
    def shaper(self) -> Array:
        """The stored rows of the 1D part, (n, 3)."""
        return np.concatenate(self._shaper) if self._shaper else np.empty((0, 3))

    @property
    def shaper_is_identity(self) -> bool:
        """Whether the 1D part is complete and is the identity."""
        return self.size_1d > 1 and self.shaper_rows == self.size_1d and self._bend < IDENTITY

    def named(self, *keywords: str) -> tuple[Entry, ...]:
        """Return the header lines with one of these keywords, in upper or lower case."""
        return tuple(entry for entry in self.entries if entry.keyword.upper() in keywords)

    @property
    def domain(self) -> tuple[Array, Array]:
        """The input values of the first and the last row, from DOMAIN_MIN and DOMAIN_MAX, each (3,)."""
        ends = []
        for keyword, assumed in (("DOMAIN_MIN", 0.0), ("DOMAIN_MAX", 1.0)):
            stated = [each.domain for each in self.named(keyword) if each.domain is not None]
            ends.append(np.array(stated[-1]) if stated else np.full(3, assumed))
        return ends[0], ends[1]

    @property
    def size_line(self) -> int:
        """The line number of the first LUT_3D_SIZE; 0 without a LUT_3D_SIZE."""
        return next((entry.line for entry in self.named("LUT_3D_SIZE")), 0)

    def take(self, block: LineBlock) -> None:
        """Scan the next lines."""
        data = block.data
        self.single_cr |= block.single_cr
        if block.first == 1 and data.startswith(BYTE_ORDER_MARK):
            self.marked, data = True, data[len(BYTE_ORDER_MARK) :]
        rows = None if data.translate(None, _PLAIN) else _plain_rows(data)
        if rows is not None:
            self._note_numbers(rows, np.arange(block.first, block.first + len(rows)))
            if b"\t" in data:
                place = data[: data.index(b"\t")].count(b"\n")
                self._note("tab", block.first + place, data.split(b"\n", place + 1)[place], len(rows))
            self._keep(rows)
            return
        pending: dict[int, list[float]] = {}
        for place, line in enumerate(data.split(b"\n"), block.first):
            row = self._line(place, line, len(pending))
            if isinstance(row, Entry):
                # A size line changes the positions of the rows after it.
                self._flush(pending)
                self._sizes(row)
            elif row is not None:
                pending[place] = row
        self._flush(pending)

    def _line(self, place: int, line: bytes, pending: int) -> list[float] | Entry | None:
        """Return the numbers of a row, an entry for a line of the header, or None for a comment."""
        words = line.split()
        if not words or words[0].startswith(b"#"):
            self._decodes(place, line)
            return None
        row = _numbers(words)
        if row is None and words[0][:1].isalpha():
            self._decodes(place, line)
            return self._enter(place, line, pending)
        if row is None and b"\0" in line:
            self._note("NUL", place, line)
            return None
        if row is None:
            row = self._repair(place, line)
        elif len(row) != 3:
            self._note("columns", place, line)
        if b"\t" in line.strip():
            self._note("tab", place, line)
        return [*row, 0.0, 0.0, 0.0][:3]

    def _decodes(self, place: int, line: bytes) -> None:
        try:
            line.decode("utf-8")
        except UnicodeDecodeError:
            self._note("not UTF-8", place, line)
        if b"\0" in line:
            self._note("NUL", place, line)

    def _enter(self, place: int, line: bytes, pending: int) -> Entry:
        text = line.decode("utf-8", errors="replace").strip()
        keyword, *words = text.split()
        before = self.table.rows + self.shaper_rows + pending
        # Messages quote at most 100 characters of a header line.
        entry = Entry(place, keyword, tuple(words), text[:100], before)
        if len(self.entries) < MAX_ENTRIES:
            self.entries.append(entry)
        return entry

    def _sizes(self, entry: Entry) -> None:
        stated = number(entry.words[0]) if entry.words else None
        size = int(stated) if stated is not None and 0 < stated < 1e9 else 0
        if entry.keyword.upper() == "LUT_3D_SIZE" and not self.table.size:
            self.table.size = size
        elif entry.keyword.upper() == "LUT_1D_SIZE" and not self.size_1d:
            self.size_1d = size

    def _repair(self, place: int, line: bytes) -> list[float]:
        """Note the fault of a line without three numbers. Return the numbers that its author probably meant."""
        plain, mark, _ = line.partition(b"#")
        row = _numbers(plain.split())
        if mark and row is not None:
            self._note("comment", place, line)
            return row
        if re.search(rb"\d,\d", line):
            self._note("decimal comma", place, line)
            return _numbers(line.replace(b",", b".").split()) or [0.0]
        if b"," in line:
            self._note("comma", place, line)
            return _numbers(line.replace(b",", b" ").split()) or [0.0]
        self._note("text", place, line)
        return [0.0]

    def _flush(self, pending: dict[int, list[float]]) -> None:
        """Take the rows, by line, that were read one by one."""
        if pending:
            rows = np.array([*pending.values()])
            self._note_numbers(rows, np.array([*pending]))
            self._keep(rows)
            pending.clear()

    def _keep(self, rows: Array) -> None:
        part = min(max(self.size_1d - self.shaper_rows, 0), len(rows))
        if part:
            self._measure_bend(rows[:part])
        self.shaper_rows += part
        if part and self.keep:
            self._shaper.append(rows[:part])
        if part < len(rows):
            self.table.add(rows[part:])

    def _measure_bend(self, rows: Array) -> None:
        low, high = 0.0, 1.0
        for entry in self.named("LUT_1D_INPUT_RANGE"):
            low, high = entry.numbers(2) or (low, high)
        place = np.arange(self.shaper_rows, self.shaper_rows + len(rows)) / max(self.size_1d - 1, 1)
        distance = np.abs(rows - (low + (high - low) * place)[:, np.newaxis]).max()
        # A NaN in the 1D part must count as an infinite distance.
        self._bend = max(self._bend, float(np.nan_to_num(distance, nan=np.inf)))

    def _note_numbers(self, rows: Array, lines: NDArray[np.intp]) -> None:
        size = np.abs(rows)
        for kind, odd in (
            ("nan", np.isnan(rows)),
            ("infinite", np.isinf(rows)),
            ("overflow", (size > LARGEST) & np.isfinite(rows)),
            ("subnormal", (size < SMALLEST_NORMAL) & (size > 0)),
        ):
            on = odd.any(axis=1)
            if on.any():
                first = int(np.argmax(on))
                self._note(kind, int(lines[first]), " ".join(f"{x:g}" for x in rows[first]).encode(), int(on.sum()))

    def _note(self, kind: str, line: int, sample: bytes, count: int = 1) -> None:
        seen = self.oddities.get(kind)
        if seen:
            self.oddities[kind] = replace(seen, count=seen.count + count)
        else:
            self.oddities[kind] = Oddity(line, shown(sample), count)


def scan_cube(path: Path, *, keep: bool = False) -> CubeScan:
    """Scan a ``.cube``; ``keep`` stores its rows. Raises LutgenError: it cannot be read, or is no text."""
    scan = CubeScan(path, keep)
    for block in blocks(path):
        scan.take(block)
    scan.length = path.stat().st_size
    return scan


def _plain_rows(data: bytes) -> Array | None:
    """Return all rows of a block, (n, 3), or None when a line does not have three numbers."""
    if not data.strip() or _TINY.search(data):
        return None
    try:
        rows = np.loadtxt(BytesIO(data), ndmin=2)
    except ValueError:
        return None
    return rows if rows.shape == (data.count(b"\n"), 3) else None


def _numbers(words: list[bytes]) -> list[float] | None:
    numbers = [number(word.decode("ascii", errors="replace"), non_finite=True) for word in words]
    read = [
        # A number that is smaller than any double but not 0 must not be read as 0.
        _SMALLEST if each == 0 and _NOT_ZERO.match(word) else each
        for each, word in zip(numbers, words, strict=True)
        if each is not None
    ]
    return read if len(read) == len(words) else None
