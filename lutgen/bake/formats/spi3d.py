"""Sony Pictures Imageworks' ``.spi3d``: the table with indices in each row. Every version of OpenColorIO reads it.

The rows have blue fastest, as in Imageworks' own files, but readers use the indices. The header has no place for the
provenance. It follows the last row, where readers ignore it.
"""

import numpy as np

from lutgen.bake.digits import rows_of_text
from lutgen.bake.formats import Format, Provenance
from lutgen.bake.lut import Lut, MatrixLut, table_of


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    n = lut.size
    rows = np.frombuffer(rows_of_text(table_of(lut).transpose(2, 1, 0, 3).reshape(-1, 3)), np.uint8)
    numbers = np.frombuffer(b"".join(b"%2d " % number for number in range(n)), np.uint8).reshape(n, 3)
    indices = numbers[np.indices((n, n, n)).reshape(3, -1).T].reshape(n**3, 9)
    head = f"SPILUT 1.0\n3 3\n{n} {n} {n}\n".encode()
    body = np.hstack([indices, rows.reshape(n**3, -1)]).tobytes()
    return b"".join((head, body, provenance.comments()))


FORMAT = Format(name="spi3d", suffix=".spi3d", unclipped=True, write=_write)
