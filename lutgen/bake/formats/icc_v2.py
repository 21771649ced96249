"""The ICC profile of the aged display in version 2, for programs that cannot read version 4, such as Argyll.

The colours are those of ``icc``, in the encoding of version 2.
"""

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.littlecms import table_of_profile, through_profile
from lutgen.bake.lut import Lut, MatrixLut, table_of
from lutgen.bake.spaces import lab_held_to_xyz_d50


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    table = table_of(lut)
    primaries = lab_held_to_xyz_d50(np.array([table[0, 0, -1], table[0, -1, 0], table[-1, 0, 0]]), version=2)
    tags = (*icc.display_tags(provenance.title, provenance.lines, primaries), (b"A2B0", icc.table(table)))
    return icc.profile(device_class=b"mntr", pcs=b"Lab ", tags=tags)


FORMAT = Format(
    name="icc-v2",
    suffix=".icc",
    unclipped=True,
    write=_write,
    spaces=("lab-v2",),
    largest=icc.LARGEST,
    reader=Reader(through_profile, table_of_profile),
    stem="aged-v2",
    corrects=False,
    takes_source=True,
)
