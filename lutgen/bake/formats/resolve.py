"""DaVinci Resolve's ``.cube`` with a curve (the shaper) before the table. The curve gives dark colours more points.

Resolve's dialect: ``LUT_1D_SIZE`` and ``LUT_3D_SIZE`` with their input ranges, the curve's rows, then the table's rows
with red fastest. There is no TITLE: with a TITLE OpenColorIO expects Iridas' dialect, which has no curve. If the table
without a curve is more faithful, the file has no curve and no input range. darktable, three.js and OBS cannot read a
file with a curve, and they read the two numbers of an input range as a row.
"""

from functools import partial

import numpy as np

from lutgen.bake.digits import rows_of_text
from lutgen.bake.formats import Format, Provenance, rows_after
from lutgen.bake.lut import Lut, MatrixLut, shaper

#: Points of the shaper. Linear interpolation between them has an error of 5e-8.
CURVE_POINTS = 4096


def _head(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    if lut.space == "code":
        return provenance.comments() + b"LUT_3D_SIZE %d\n" % lut.size
    _, curve = shaper(lut, CURVE_POINTS)
    header = (
        f"LUT_1D_SIZE {len(curve)}\nLUT_1D_INPUT_RANGE 0.0 1.0\nLUT_3D_SIZE {lut.size}\nLUT_3D_INPUT_RANGE 0.0 1.0\n"
    )
    curve_rows = rows_of_text(np.repeat(curve[:, np.newaxis], 3, axis=1))
    return b"".join((provenance.comments(), header.encode(), curve_rows))


FORMAT = Format(
    name="resolve",
    suffix=".cube",
    unclipped=False,
    write=partial(rows_after, _head),
    spaces=("code", "shaped"),
    head=_head,
    stem="aged-resolve",
)
