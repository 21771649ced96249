"""Reading a text file of any size in blocks of whole lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from lutgen.errors import LutgenError, reason_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

#: Bytes that are read at a time.
BLOCK = 1 << 20

#: Longest line that is read, in bytes: a file without line ends would otherwise be read into memory whole.
LONGEST_LINE = 1 << 20

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


class LineBlock(NamedTuple):
    """Whole lines with LF ends, the number of the first, and the line ends that they had: "LF", "CRLF" or "CR"."""

    first: int
    data: bytes
    ends: frozenset[str]


def blocks(path: Path) -> Iterator[LineBlock]:
    """Yield a file's lines in blocks. Raises LutgenError: unreadable, or a line longer than ``LONGEST_LINE``."""
    line, rest = 1, b""
    try:
        with path.open("rb") as file:
            while chunk := file.read(BLOCK):
                # A CR at the end of a chunk may be half of a CRLF: it is kept for the next chunk.
                data = rest + chunk
                cut = max(data.rfind(b"\n", 0, len(data)), data.rfind(b"\r", 0, len(data) - 1)) + 1
                rest = data[cut:]
                if len(rest) > LONGEST_LINE:
                    raise LutgenError(_no_lines(path, line))
                if cut:
                    block = _block(line, data[:cut])
                    line += block.data.count(b"\n")
                    yield block
    except OSError as error:
        raise LutgenError(f"{path}: cannot be read: {reason_of(error)}. Give the name of a LUT or config.") from None
    if rest:
        yield _block(line, rest if rest.endswith((b"\n", b"\r")) else rest + b"\n")


def shown(data: bytes) -> str:
    """Return the start of a line as it can be printed, for messages."""
    text = data[:60].decode("utf-8", errors="replace").strip()
    return "".join(letter if letter.isprintable() else "\ufffd" for letter in text)


def _block(first: int, data: bytes) -> LineBlock:
    pairs, returns = data.count(b"\r\n"), data.count(b"\r")
    ends = {
        name
        for name, count in (("CRLF", pairs), ("CR", returns - pairs), ("LF", data.count(b"\n") - pairs))
        if count > 0
    }
    if returns:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return LineBlock(first, data, frozenset(ends))


def _no_lines(path: Path, line: int) -> str:
    return (
        f"{path}:{line}: a line of more than {LONGEST_LINE >> 20} MiB, so it is no text of a LUT. "
        "Give a .cube, .clf, .ctf, .3dl, .spi3d, .csp or .ocio file."
    )
