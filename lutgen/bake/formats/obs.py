"""The picture for OBS Studio's filter *Apply LUT*: 64 points along an edge in 512 × 512 pixels of 8 bit.

OBS converts all pictures to 8 bit, so a node is wrong by up to half a code. From a .cube it keeps half floats, which
are finer. The picture is for versions of OBS that cannot read .cube, and for programs that have copied the filter.
"""

from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.lut import Lut, MatrixLut, table_of
from lutgen.bake.table_picture import POINTS, apply_picture, png, table_of_picture, tiles_of


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    return png(tiles_of(table_of(lut)), 8, provenance)


FORMAT = Format(
    name="obs",
    suffix=".png",
    unclipped=False,
    write=_write,
    largest=255,
    # OBS reads only this size.
    points=lambda _size: POINTS,
    reader=Reader(apply_picture, table_of_picture),
    stem="aged-obs",
    follows=False,
)
