"""Hald image: the table as a picture, for ImageMagick, ffmpeg's ``haldclut``, GIMP, RawTherapee and darktable.

A Hald of level L is a square of L³ pixels a side that holds L² points along each edge of the table, red fastest. PNG of
16 bit, without a colour profile, and without compression: every compressor gives other bytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.lut import Lut, MatrixLut, Sampler, table_of
from lutgen.bake.table_picture import apply_picture, png, table_of_picture

if TYPE_CHECKING:
    from lutgen.display import AgedDisplay

LARGEST = 65_535


def bake(sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
    """Give the table indexed in code values, clipped to sRGB; 16, 36 or 64 points, squares as Hald asks."""
    points = round(size**0.5) ** 2
    return sampler.candidates(aged, points, "code", clip=True, largest=LARGEST)


def write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    """Return the file's bytes."""
    side = round(lut.size**1.5)
    texts = {"Title": provenance.title, "Description": "\n".join(provenance.lines)}
    return png(table_of(lut).reshape(side, side, 3), 16, texts)


FORMAT = Format(
    name="hald",
    suffix=".png",
    summary="the table as a 16-bit picture, for ImageMagick, ffmpeg, GIMP and RawTherapee; clipped to sRGB",
    unclipped=False,
    bake=bake,
    write=write,
    reader=Reader(apply_picture, table_of_picture),
    stem="aged-hald",
)
