"""Hald image: the table as a picture, for ImageMagick, ffmpeg's ``haldclut``, GIMP, RawTherapee and darktable.

A Hald image of level L is a square of L³ pixels per side. It holds a table of L² points along each edge, red fastest.
The file is a 16-bit PNG without a colour profile. It is not compressed, since different compressors give different
bytes.
"""

from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.lut import Lut, MatrixLut, table_of
from lutgen.bake.table_picture import apply_picture, png, table_of_picture


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    side = round(lut.size**1.5)
    return png(table_of(lut).reshape(side, side, 3), 16, provenance)


FORMAT = Format(
    name="hald",
    suffix=".png",
    unclipped=False,
    write=_write,
    largest=65_535,
    # 16, 36 or 64: a Hald image requires a square number.
    points=lambda size: round(size**0.5) ** 2,
    reader=Reader(apply_picture, table_of_picture),
    stem="aged-hald",
)
