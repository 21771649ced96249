"""Iridas/Resolve ``.cube``, in the one form that every reader accepts.

LF, a quoted TITLE in ASCII, ``#`` comments before ``LUT_3D_SIZE``, seven decimals, red fastest, values in 0..1, no
DOMAIN, no INPUT_RANGE, no 1D part. Tables in the tests list the faults of readers with other forms.
"""

from functools import partial

from lutgen.bake.formats import Format, Provenance, rows_after
from lutgen.bake.lut import Lut, MatrixLut


def _head(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    title = provenance.title.replace('"', "'")
    first = f'TITLE "{title}"\n'.encode("ascii", errors="replace")
    return b"".join((first, provenance.comments(title=False), b"LUT_3D_SIZE %d\n" % lut.size))


FORMAT = Format(name="cube", suffix=".cube", unclipped=False, write=partial(rows_after, _head), head=_head)
