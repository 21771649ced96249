"""Reading text files of any size: blocks of whole lines, and statistics of a 3D table in one pass over its rows."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array
from lutgen.errors import LutgenError, reason_of

#: Number of bytes that are read at once.
BLOCK = 1 << 20

#: Maximum length of a line in bytes. Without it, a whole file without line ends would be read into memory.
LONGEST_LINE = 1 << 20

#: The largest number of float32.
LARGEST = float(np.finfo(np.float32).max)

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


class LineBlock(NamedTuple):
    """Whole lines with LF ends, the number of the first line, and whether one of the lines ended in a single CR."""

    first: int
    data: bytes
    single_cr: bool


@contextmanager
def readable(path: Path, what: str) -> Iterator[None]:
    """Turn an error of the system into a LutgenError, which asks for ``what``, such as "a PNG"."""
    try:
        yield
    except OSError as error:
        raise LutgenError(f"{path}: cannot be read: {reason_of(error)}. Give the name of {what}.") from None


def blocks(path: Path) -> Iterator[LineBlock]:
    """Yield a file's lines in blocks. Raises LutgenError: unreadable, or a line is longer than ``LONGEST_LINE``."""
    line, rest = 1, b""
    with readable(path, "a LUT or config"), path.open("rb") as file:
        while chunk := file.read(BLOCK):
            # A CR at the end of a chunk may be half of a CRLF. It is read together with the next chunk.
            data = rest + chunk
            cut = max(data.rfind(b"\n"), data.rfind(b"\r", 0, len(data) - 1)) + 1
            rest = data[cut:]
            if len(rest) > LONGEST_LINE:
                raise LutgenError(
                    f"{path}:{line}: a line of more than {LONGEST_LINE >> 20} MiB, so it is no text of a LUT or "
                    "config. Write the file again with the program that made it."
                )
            if cut:
                block = _block(line, data[:cut])
                line += block.data.count(b"\n")
                yield block
    if rest:
        yield _block(line, rest if rest.endswith((b"\n", b"\r")) else rest + b"\n")


def shown(data: bytes) -> str:
    """Return the printable start of a line, for messages."""
    text = data[:60].decode("utf-8", errors="replace").strip()
    return "".join(letter if letter.isprintable() else "\ufffd" for letter in text)


def _block(first: int, data: bytes) -> LineBlock:
    pairs, returns = data.count(b"\r\n"), data.count(b"\r")
    if returns:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return LineBlock(first, data, returns > pairs)


#: Maximum number of points along an axis of a table that is stored for a trial. OpenColorIO refuses larger tables.
MAX_KEPT = 129


@dataclass
class TableStatistics:
    """Statistics of a table of ``size``³, first index fastest, in one pass over its rows; size 0: without positions."""

    size: int
    #: Whether all rows are stored, if a trial can read so many.
    keep: bool = False
    #: Number of rows, and number of consecutive rows 0 0 0 at the end.
    rows: int = 0
    black_tail: int = 0
    #: Smallest and largest finite value of each channel, (3,); NaN for a table without finite rows.
    low: Array = field(default_factory=lambda: np.full(3, np.nan))
    high: Array = field(default_factory=lambda: np.full(3, np.nan))
    _moments: Array = field(default_factory=lambda: np.zeros((7, 7)))
    _greys: list[Array] = field(default_factory=list)
    _kept: list[Array] = field(default_factory=list)

    def add(self, rows: Array) -> None:
        """Add the next rows, (n, 3)."""
        finite = rows[np.isfinite(rows).all(axis=1)]
        if len(finite):
            self.low = np.fmin(self.low, finite.min(axis=0))
            self.high = np.fmax(self.high, finite.max(axis=0))
        lit = np.flatnonzero((rows != 0).any(axis=1))
        self.black_tail = len(rows) - 1 - int(lit[-1]) if len(lit) else self.black_tail + len(rows)
        if self.keep and self.size <= MAX_KEPT:
            self._kept.append(rows)
        if self.size > 1:
            self._place(rows, np.arange(self.rows, self.rows + len(rows)))
        self.rows += len(rows)

    def _place(self, rows: Array, index: NDArray[np.intp]) -> None:
        size = self.size
        inside = (index < size**3) & np.isfinite(rows).all(axis=1)
        rows, index = rows[inside], index[inside]
        if not len(rows):
            return
        step = size * size + size + 1
        self._greys.append(rows[index % step == 0])
        where = np.stack([index % size, index // size % size, index // (size * size)], axis=1) / (size - 1)
        # The squares of huge values would overflow, so the values are clipped here. `low` and `high` are not clipped.
        columns = np.column_stack([np.ones(len(rows)), np.clip(rows, -1e6, 1e6), where])
        self._moments += columns.T @ columns

    @property
    def greys(self) -> Array:
        """Channel values of the rows on the neutral axis, (n, 3)."""
        return np.concatenate(self._greys) if self._greys else np.empty((0, 3))

    @property
    def table(self) -> Array | None:
        """All rows, (rows, 3); None when they are not stored."""
        return np.concatenate(self._kept) if self._kept else None

    @property
    def correlation(self) -> Array:
        """Correlation of each channel (row) with the place along the fastest, middle and slowest index (column)."""
        count = self._moments[0, 0]
        if count < 2:
            return np.full((3, 3), np.nan)
        mean = self._moments[0, 1:] / count
        spread = self._moments[1:, 1:] / count - np.outer(mean, mean)
        deviation = np.sqrt(np.maximum(np.diag(spread), 0.0))
        scale = np.outer(deviation[:3], deviation[3:])
        return np.asarray(np.divide(spread[:3, 3:], scale, out=np.zeros((3, 3)), where=scale > 1e-9))
