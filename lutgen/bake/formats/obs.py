"""The picture that OBS Studio's filter *Apply LUT* reads: 64 points an edge in 512 × 512 pixels of 8 bit.

OBS makes 8 bit of pictures that have more, so a node is up to half a code off; of a .cube it keeps half floats, which
are finer. The picture is for versions that read no .cube, and for programs that took over the filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.lut import Lut, MatrixLut, Sampler, table_of
from lutgen.bake.table_picture import POINTS, apply_picture, png, table_of_picture, tiles_of

if TYPE_CHECKING:
    from lutgen.display import AgedDisplay

LARGEST = 255


def bake(sampler: Sampler, aged: AgedDisplay, _size: int) -> list[Lut | MatrixLut]:
    """Give the table of 64 points an edge, which is all that OBS reads, clipped to sRGB."""
    return sampler.candidates(aged, POINTS, "code", clip=True, largest=LARGEST)


def write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    """Return the file's bytes."""
    texts = {"Title": provenance.title, "Description": "\n".join(provenance.lines)}
    return png(tiles_of(table_of(lut)), 8, texts)


FORMAT = Format(
    name="obs",
    suffix=".png",
    summary="the table as OBS Studio's picture of 512 × 512 pixels, 8 bit, where it reads no .cube; clipped to sRGB",
    unclipped=False,
    bake=bake,
    write=write,
    reader=Reader(apply_picture, table_of_picture),
    stem="aged-obs",
    follows=False,
)
