"""Cinespace ``.csp``, version 100: a curve for each channel (the prelut), then the table with red fastest.

The curve is the shaper of ``resolve`` if the table is more faithful with it. Comments are put between BEGIN METADATA
and END METADATA.
"""

import numpy as np

from lutgen.bake.digits import rows_of_text
from lutgen.bake.formats import Format, Provenance
from lutgen.bake.lut import Lut, MatrixLut, shaper, table_of

#: Points of the prelut. OpenColorIO interpolates them by a smooth curve.
CURVE_POINTS = 257


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    table = table_of(lut)
    code, place = shaper(lut, CURVE_POINTS)
    curve = rows_of_text(np.stack([code, place]))
    # A comment line "END METADATA" would end the metadata, so each line begins with #.
    head = b"CSPLUTV100\n3D\n\nBEGIN METADATA\n%sEND METADATA\n\n" % provenance.comments()
    prelut = b"%d\n%s" % (len(code), curve) * 3
    size = b"\n%d %d %d\n" % ((lut.size,) * 3)
    return rows_of_text(table.reshape(-1, 3), head=b"".join((head, prelut, size)))


FORMAT = Format(name="csp", suffix=".csp", unclipped=True, write=_write, spaces=("code", "shaped"))
