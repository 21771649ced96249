"""Reading anybody's Hald PNG: the chunks' names and lengths, the header, and whether all of it is there."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from pathlib import Path
    from typing import BinaryIO

SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Chunks that are looked at; PNG writers make pieces of 8 kB at least, so the rest is the same.
MOST_CHUNKS = 100_000

#: Colour types of PNG that have red, green and blue in full.
COLOURS = {2: "RGB", 6: "RGB and alpha"}


@dataclass(frozen=True)
class HaldScan:
    """A PNG as it stands.

    Attributes
    ----------
    width, height, depth, colour
        As its header has them, 0 without a header; ``colour`` is PNG's colour type.
    chunks
        Names of the chunks that say how its numbers are to be seen: gAMA, cHRM, iCCP, sRGB, cICP.
    whole
        Whether it is a PNG that ends in its last chunk.

    """

    path: Path
    bytes: int
    width: int
    height: int
    depth: int
    colour: int
    chunks: tuple[str, ...]
    whole: bool

    @property
    def level(self) -> int:
        """The Hald level: its cube is the width; 0 where there is none."""
        level = round(self.width ** (1 / 3))
        return level if level**3 == self.width else 0


_TELL = (b"gAMA", b"cHRM", b"iCCP", b"sRGB", b"cICP")


def scan_hald(path: Path) -> HaldScan:
    """Read the chunks' heads; pixels are not read. Raises LutgenError where the file cannot be read."""
    try:
        with path.open("rb") as file:
            header, chunks, whole = _chunks(file, path.stat().st_size)
            size = path.stat().st_size
    except OSError as error:
        message = f"{path}: cannot be read: {(error.strerror or str(error)).lower()}. Give the name of a PNG."
        raise LutgenError(message) from None
    return HaldScan(path, size, *header, chunks, whole)


def _chunks(file: BinaryIO, size: int) -> tuple[tuple[int, int, int, int], tuple[str, ...], bool]:
    header = (0, 0, 0, 0)
    told: list[str] = []
    if file.read(8) != SIGNATURE:
        return header, (), False
    for _ in range(MOST_CHUNKS):
        head = file.read(8)
        if len(head) < 8:
            return header, tuple(told), False
        length, name = struct.unpack(">I4s", head)
        if name == b"IHDR" and length == 13:
            header = struct.unpack(">IIBB", file.read(10).ljust(10, b"\0"))
            file.seek(-10, 1)
        elif name in _TELL and name.decode() not in told:
            told.append(name.decode())
        elif name == b"IEND":
            return header, tuple(told), file.tell() + 4 <= size
        file.seek(length + 4, 1)
    return header, tuple(told), True
