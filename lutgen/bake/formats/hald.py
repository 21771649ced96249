"""Hald image: the table as a picture, for ImageMagick, ffmpeg's ``haldclut``, GIMP, RawTherapee and darktable.

A Hald of level L is a square of L³ pixels a side that holds L² points along each edge of the table, red fastest. PNG of
16 bit, without a colour profile, and without compression: every compressor gives other bytes.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.lut import Lut, MatrixLut, Sampler, table_of
from lutgen.bindings import oiio
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay

LARGEST = 65_535

#: Levels that make sense: 8 is ImageMagick's, and 12 has 144 points along an edge.
LEVELS = range(2, 13)


def bake(sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
    """Give the table indexed in code values, clipped to sRGB; 16, 36 or 64 points, squares as Hald asks."""
    points = round(size**0.5) ** 2
    return sampler.candidates(aged, points, "code", clip=True, largest=LARGEST)


def write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    """Return the file's bytes."""
    side = round(lut.size**1.5)
    pixels = np.rint(table_of(lut).reshape(side, side * 3) * LARGEST).astype(">u2").view(np.uint8)
    # Each row begins with its filter: none.
    rows = np.hstack([np.zeros((side, 1), np.uint8), pixels]).tobytes()
    texts = (("Title", provenance.title), ("Description", "\n".join(provenance.lines)))
    chunks = [
        _chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 16, 2, 0, 0, 0)),
        *(_chunk(b"iTXt", key.encode() + bytes(5) + text.encode("utf-8", "replace")) for key, text in texts),
        _chunk(b"IDAT", _stored(rows)),
        _chunk(b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def _stored(data: bytes) -> bytes:
    """A zlib stream of stored blocks (RFC 1950, RFC 1951 3.2.4)."""
    parts = [data[start : start + 65_535] for start in range(0, len(data), 65_535)]
    last = len(parts) - 1
    blocks = (
        struct.pack("<BHH", place == last, len(part), len(part) ^ 65_535) + part for place, part in enumerate(parts)
    )
    return b"\x78\x01" + b"".join(blocks) + struct.pack(">I", zlib.adler32(data))


def read(path: Path) -> Lut:
    """Read a Hald image of any depth. Raises LutgenError when it is none."""
    lib = oiio()
    image = lib.ImageInput.open(str(path))
    if image is None:
        raise LutgenError(f"{path}: OpenImageIO cannot read it: {_one_line(lib.geterror())}")
    spec = image.spec()
    level = round(spec.width ** (1 / 3))
    if spec.width != spec.height or level**3 != spec.width or level not in LEVELS or spec.nchannels < 3:
        image.close()
        message = (
            f"{path}: is no Hald image: {spec.width} × {spec.height} pixels of {spec.nchannels} channels. One of level "
            f"8 has 512 × 512 of 3, and levels from {LEVELS[0]} to {LEVELS[-1]} are read."
        )
        raise LutgenError(message)
    pixels = image.read_image(lib.FLOAT)
    problem = image.geterror()
    image.close()
    if pixels is None or problem:
        raise LutgenError(f"{path}: OpenImageIO cannot read all of it: {_one_line(problem)}")
    points = level * level
    return Lut("code", np.asarray(pixels, np.float64)[..., :3].reshape(points, points, points, 3))


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _apply(path: Path, code: Array) -> Array:
    return read(path).apply(code)


def _table(path: Path) -> tuple[str, int]:
    lut = read(path)
    return lut.space, lut.size


FORMAT = Format(
    name="hald",
    suffix=".png",
    summary="the table as a 16-bit picture, for ImageMagick, ffmpeg, GIMP and RawTherapee; clipped to sRGB",
    unclipped=False,
    bake=bake,
    write=write,
    reader=Reader(_apply, _table),
    stem="aged-hald",
)
