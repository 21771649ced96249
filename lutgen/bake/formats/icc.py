"""ICC profile of the aged display, for viewers that read nothing else: whole-slide viewers, browsers, office programs.

Give it to a *picture* (assign, embed), not to the screen: a colour-managed viewer then shows what the picture looks
like on the aged display. Viewers convert relative to the profile's white, and a profile whose white were the aged one
would be shown without its yellowing. So the white here is the un-aged display's, D50 in ICC's terms, and the table
holds aged colours relative to it; in absolute terms the conversion is the same. Black point compensation, where a
viewer has it, hides a black that leaks.

The table holds L*a*b* (Chromium shows tables of XYZ half as bright), so aged colours outside sRGB are kept for wider
screens. Matrix and curves beside it are for programs that read no tables: they show the aged primaries, added up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.littlecms import table_of_profile, through_profile
from lutgen.bake.lut import Lut, MatrixLut, Sampler, table_of
from lutgen.bake.spaces import lab_held_to_xyz_d50

if TYPE_CHECKING:
    from lutgen.display import AgedDisplay


def bake(sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
    """Give the table of L*a*b* under D50, indexed in code values and not clipped."""
    return sampler.candidates(aged, size, "lab", clip=False, largest=icc.LARGEST)


def write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    """Return the file's bytes."""
    table = table_of(lut)
    primaries = lab_held_to_xyz_d50(np.array([table[0, 0, -1], table[0, -1, 0], table[-1, 0, 0]]))
    tags = (*icc.display_tags(provenance.title, provenance.lines, primaries), (b"A2B0", icc.table(table)))
    return icc.profile(device_class=b"mntr", pcs=b"Lab ", tags=tags)


FORMAT = Format(
    name="icc",
    suffix=".icc",
    summary="ICC profile to assign to a picture, for QuPath, browsers and system viewers; keeps colours outside sRGB",
    unclipped=True,
    bake=bake,
    write=write,
    reader=Reader(through_profile, table_of_profile),
    corrects=False,
)
