"""A table as a PNG: written without compression, read in any depth, in two common layouts of its pixels.

A Hald image has the table's points row by row, red fastest. OBS Studio's square of 512 pixels has a tile of 64 × 64 for
each step of blue, eight tiles per row, with red to the right and green downwards (its filter color-grade-filter.c). A
Hald image of level 8 has the same numbers of pixels and points. The pixels decide between the two layouts: neighbouring
points of a table differ less than other points.
"""

import struct
import zlib
from pathlib import Path

import numpy as np

from lutgen.bake.formats import Provenance
from lutgen.bake.lut import Lut
from lutgen.bindings import oiio
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError, in_one_line

#: Supported levels of Hald images. ImageMagick's default is 8. Level 12 has 144 points along an edge.
LEVELS = range(2, 13)

#: Points along an edge of OBS Studio's table, and its tiles per row.
POINTS, TILES = 64, 8


def png(pixels: Array, depth: int, provenance: Provenance) -> bytes:
    """Return a PNG of values 0..1, shape (height, width, 3), with 8 or 16 bits, texts and no colour profile.

    The PNG is not compressed, since different compressors give different bytes.
    """
    height, width, _ = pixels.shape
    values = np.rint(pixels * (2**depth - 1)).astype(">u2" if depth == 16 else np.uint8)
    # Each row begins with the number of its filter: 0 is no filter.
    rows = np.hstack([np.zeros((height, 1), np.uint8), values.reshape(height, -1).view(np.uint8)]).tobytes()
    texts = {"Title": provenance.title, "Description": "\n".join(provenance.lines)}
    chunks = [
        _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, 2, 0, 0, 0)),
        *(_chunk(b"iTXt", key.encode() + bytes(5) + text.encode("utf-8", "replace")) for key, text in texts.items()),
        _chunk(b"IDAT", _stored(rows)),
        _chunk(b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def _stored(data: bytes) -> bytes:
    """Return a zlib stream of stored blocks (RFC 1950, RFC 1951 3.2.4)."""
    parts = [data[start : start + 65_535] for start in range(0, len(data), 65_535)]
    last = len(parts) - 1
    blocks = (
        struct.pack("<BHH", place == last, len(part), len(part) ^ 65_535) + part for place, part in enumerate(parts)
    )
    return b"\x78\x01" + b"".join(blocks) + struct.pack(">I", zlib.adler32(data))


def tiles_of(table: Array) -> Array:
    """Arrange a table of 64³ points, axes blue, green, red, in OBS Studio's layout: shape (512, 512, 3)."""
    side = TILES * POINTS
    return table.reshape(TILES, TILES, POINTS, POINTS, 3).transpose(0, 2, 1, 3, 4).reshape(side, side, 3)


def read_table(path: Path) -> tuple[Lut, bool]:
    """Read a table from a PNG of any depth. Return the table and whether its layout is that of OBS Studio.

    Raises LutgenError: the file cannot be read, or its number of pixels fits no table.
    """
    lib = oiio()
    image = lib.ImageInput.open(str(path))
    if image is None:
        raise LutgenError(f"{path}: OpenImageIO cannot read it: {in_one_line(lib.geterror())}")
    spec = image.spec()
    level = round(spec.width ** (1 / 3))
    if spec.width != spec.height or level**3 != spec.width or level not in LEVELS or spec.nchannels < 3:
        image.close()
        raise LutgenError(
            f"{path}: is no Hald image: {spec.width} × {spec.height} pixels of {spec.nchannels} channels. One of level "
            f"8 has 512 × 512 of 3, and levels from {LEVELS[0]} to {LEVELS[-1]} are read."
        )
    content = image.read_image(lib.FLOAT)
    problem = image.geterror()
    image.close()
    if content is None or problem:
        raise LutgenError(f"{path}: OpenImageIO cannot read all of it: {in_one_line(problem)}")
    pixels, points = np.asarray(content, np.float64)[..., :3], level * level
    table = pixels.reshape(points, points, points, 3)
    if points == POINTS:
        squares = pixels.reshape(TILES, POINTS, TILES, POINTS, 3).transpose(0, 2, 1, 3, 4)
        tiles = squares.reshape(POINTS, POINTS, POINTS, 3)
        if _roughness(tiles) < _roughness(table):
            return Lut("code", tiles), True
    return Lut("code", table), False


def _roughness(table: Array) -> float:
    """Return the sum of absolute differences between neighbours along the three axes."""
    return float(sum(np.abs(np.diff(table, axis=axis)).sum() for axis in range(3)))


def apply_picture(path: Path, code: Array) -> Array:
    """Apply a picture's table to code values (n, 3). Raises LutgenError as :func:`read_table` does."""
    return read_table(path)[0].apply(code)


def table_of_picture(path: Path) -> tuple[str, int]:
    """Return the space and the size of a picture's table. Raises LutgenError as :func:`read_table` does."""
    lut, _ = read_table(path)
    return lut.space, lut.size
