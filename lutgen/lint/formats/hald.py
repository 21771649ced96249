"""Hald images as PNG: header, names and lengths of chunks, completeness of the pixels, and what ffmpeg does.

Pixels are decompressed and counted, but not stored. Only images of 512 × 512 pixels are read completely, to recognise
the layout of OBS Studio.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from lutgen.bake.table_picture import POINTS, TILES, read_table
from lutgen.errors import LutgenError
from lutgen.lint.finding import HALDCLUT, Linted, LintFinding, refused, wrong
from lutgen.lint.formats import FileKind, findings
from lutgen.lint.stream import BLOCK, readable

SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Width of the largest Hald image that ffmpeg accepts, level 16. Pixels of wider images are not decompressed.
WIDEST = 16**3


#: Colour type of a PNG → numbers per pixel: greys, RGB, a palette, greys with alpha, RGB with alpha.
_NUMBERS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}

#: Levels that ffmpeg accepts: tables of 4 to 256 points along an edge.
LEVELS = range(2, 17)

#: Number of bits from which a table has no visible steps.
FINE = 16

#: Colour types of PNG with red, green and blue channels → their names.
COLOURS = {2: "RGB", 6: "RGB and alpha"}

#: Chunks that state a colour space or gamma.
_OF_COLOUR = (b"gAMA", b"cHRM", b"iCCP", b"sRGB", b"cICP")


@dataclass
class HaldScan:
    """The result of a scan of a PNG, which is filled chunk by chunk."""

    bytes: int
    #: Values of its header, 0 without a header. ``colour`` is PNG's colour type.
    width: int = 0
    height: int = 0
    depth: int = 0
    colour: int = 0
    interlaced: int = 0
    #: Names of its chunks in ``_OF_COLOUR``.
    chunks: list[str] = field(default_factory=list)
    #: Whether it is a PNG and its last chunk is complete.
    whole: bool = False
    #: Number of missing bytes of pixels, compared with the header; 0 when pixels were not read.
    missing: int = 0
    #: Whether its pixels have the layout of OBS Studio, in tiles of 64 × 64.
    tiles: bool = False

    def __post_init__(self) -> None:
        self._unpacker = zlib.decompressobj()

    @property
    def level(self) -> int:
        """The Hald level, whose cube is the width; 0 when the width is no cube number."""
        level = round(self.width ** (1 / 3))
        return level if level**3 == self.width else 0

    def read(self, file: BinaryIO) -> bool:
        """Read all chunks after the signature, and return whether the file has its last chunk, IEND."""
        # Images of all levels have fewer chunks, since writers split pixels into chunks of 8 kB or more.
        for _ in range(100_000):
            head = file.read(8)
            if len(head) < 8:
                return False
            length, name = struct.unpack(">I4s", head)
            end = file.tell() + length + 4
            if name == b"IHDR" and length == 13:
                header = struct.unpack(">IIBBxxB", file.read(13).ljust(13, b"\0"))
                self.width, self.height, self.depth, self.colour, self.interlaced = header
                self.missing = self._expected_bytes()
            elif name == b"IDAT":
                self._unpack(file, length)
            elif name in _OF_COLOUR and name.decode() not in self.chunks:
                self.chunks.append(name.decode())
            file.seek(end)
            if name == b"IEND":
                return True
        return True

    def _expected_bytes(self) -> int:
        """Return the number of bytes of all rows with their filter bytes; 0 when they are not counted."""
        if self.interlaced or self.colour not in _NUMBERS or max(self.width, self.height) > WIDEST:
            return 0
        return self.height * (1 + (self.width * _NUMBERS[self.colour] * self.depth + 7) // 8)

    def _unpack(self, file: BinaryIO, length: int) -> None:
        while self.missing and length:
            packed = file.read(min(length, BLOCK))
            length = length - len(packed) if packed else 0
            try:
                while packed and self.missing:
                    self.missing = max(self.missing - len(self._unpacker.decompress(packed, BLOCK)), 0)
                    packed = self._unpacker.unconsumed_tail
            except zlib.error:
                return


def scan_hald(path: Path) -> HaldScan:
    """Read the chunks, and count the pixels if the image may be a table. Raises LutgenError: it cannot be read."""
    with readable(path, "a PNG"), path.open("rb") as file:
        scan = HaldScan(path.stat().st_size)
        scan.whole = file.read(8) == SIGNATURE and scan.read(file) and file.tell() <= scan.bytes
    # The pixels decide when the size fits both layouts.
    if scan.whole and not scan.missing and (scan.width, scan.height) == (TILES * POINTS,) * 2:
        with suppress(LutgenError):
            scan.tiles = read_table(path)[1]
    return scan


def hald_form(scan: HaldScan) -> Iterator[LintFinding]:
    """Find faults of form. A Hald image of level L has L³ pixels per side."""
    if not scan.width:
        fates = refused(HALDCLUT, how="cannot read it")
        yield LintFinding("is empty" if not scan.bytes else "is not a PNG", "Export it again.", 0, fates)
        return
    sides = f"has {scan.width} × {scan.height} pixels"
    if scan.level not in LEVELS or scan.height < scan.width:
        fates = refused(HALDCLUT, how="expects as many pixels per side as a cube number, such as 512")
        yield LintFinding(f"{sides}; no Hald image has so many", "A Hald image of level 8 has 512 × 512.", 0, fates)
    elif scan.height > scan.width:
        fates = wrong(HALDCLUT, how="reads the upper square only")
        yield LintFinding(f"{sides}, and a Hald image is square", "Cut it to the square.", 0, fates)
    if not scan.whole or scan.missing:
        fates = wrong(HALDCLUT, how="shows missing pixels as black, or refuses the file")
        lacks = f"lacks {scan.missing} bytes of pixels for {sides.removeprefix('has ')} of {scan.depth} bits"
        fact = lacks if scan.whole else "is cut off: its last chunk is missing"
        yield LintFinding(fact, "Copy or export it again.", 0, fates)
    if scan.tiles:
        fates = wrong(HALDCLUT, how="reads the rows of its tiles as rows of a Hald image")
        fact = "has the layout of OBS Studio, a tile of 64 × 64 pixels for each step of blue"
        yield LintFinding(fact, "Give it to OBS; for other programs take a Hald image (`--format hald`).", 0, fates)
    if scan.colour not in COLOURS:
        fates = wrong(HALDCLUT, how="shows only the colours that it has")
        yield LintFinding("is a picture of greys or of a palette", "Save it as RGB.", 0, fates, in_the_file=True)
    elif scan.depth < FINE and not scan.tiles:
        yield LintFinding(f"has {scan.depth} bits: dark greys move in steps of half a code", "Save it with 16 bits.")
    if scan.chunks:
        stated = f"states a colour space or gamma ({', '.join(scan.chunks)})"
        fact = f"{stated}: ffmpeg ignores it, an editor with colour management may convert the table"
        yield LintFinding(fact, "Save it without a colour profile and gamma.")


RULES = (hald_form,)


def lint_hald(path: Path, _ask_readers: bool) -> Linted:
    """Lint a PNG. Raises LutgenError when it cannot be read."""
    scan = scan_hald(path)
    level = f", level {scan.level}: {scan.level**2}³ points" if scan.level else ""
    level = ", of OBS Studio: 64³ points" if scan.tiles else level
    facts = (f"{scan.width} × {scan.height} pixels of {scan.depth} bits{level}, {scan.bytes} bytes",)
    return Linted(path, "obs" if scan.tiles else "hald", facts, tuple(findings(RULES, scan)))


FORMAT = FileKind((".png",), lint_hald, RULES)
