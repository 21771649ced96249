"""ICC profile of the aged display, for viewers that read nothing else: whole-slide viewers, browsers, office programs.

Give it to a *picture* (assign, embed), not to the screen: a colour-managed viewer then shows what the picture looks
like on the aged display. Viewers convert relative to the profile's white, and a profile whose white were the aged one
would be shown without its yellowing. So the white here is the un-aged display's, D50 in ICC's terms, and the table
holds aged colours relative to it; in absolute terms the conversion is the same. Black point compensation, where a
viewer has it, hides a black that leaks.

The table holds L*a*b* (Chromium shows tables of XYZ half as bright), so aged colours outside sRGB are kept for wider
screens. The profile is of version 4: Chromium and Firefox read the table of version 2, which ``icc-v2`` has, in the
steps of version 4, and show it a code or more off.

Matrix and curves beside the table are for programs that read no tables: the nearest matrix that shows white as the
table does. Without them LittleCMS takes the black of a profile of version 4 for 0.35 % of white, and shows dark colours
up to 11 codes darker by the perceptual intent. Chromium takes the matrix for the table where the two hardly differ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.littlecms import table_of_profile, through_profile
from lutgen.bake.lut import Lut, MatrixLut, table_of
from lutgen.bake.spaces import lab_held_to_xyz_d50, lattice, linear_to_xyz_d50, xyz_d50_to_linear
from lutgen.colorimetry import code_to_linear

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: The curve by which the matrix's errors are weighed, and the linear light below which it is straight.
GAMMA, DARK = 2.4, 0.01


def write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    """Return the file's bytes."""
    table = table_of(lut)
    colorants = nearest_colorants(lab_held_to_xyz_d50(table))
    tags = icc.display_tags(provenance.title, provenance.lines, colorants, version=4)
    return icc.profile(device_class=b"mntr", pcs=b"Lab ", tags=(*tags, (b"A2B0", icc.table_to_lab(table))), version=4)


def nearest_colorants(xyz: Array) -> Array:
    """Return the matrix nearest to a table whose white is the table's: XYZ of red, green and blue, one a row, (3, 3).

    ``xyz``: a table as in :class:`Lut`, shape (n, n, n, 3). Least squares in linear sRGB, where the eye's curve weighs
    the channels; red and green are free, and blue is what they lack of white.
    """
    red, green, blue = code_to_linear(lattice(len(xyz), "code")).T
    aged = xyz_d50_to_linear(xyz).reshape(-1, 3)
    white, rest = aged[-1], aged - np.outer(blue, aged[-1])
    free = np.stack([red - blue, green - blue], axis=1)
    weights = (np.clip(aged, 0.0, 1.0) + DARK) ** (1 / GAMMA - 1)
    fitted = [
        np.linalg.lstsq(weight[:, np.newaxis] * free, weight * channel, rcond=None)[0]
        for weight, channel in zip(weights.T, rest.T, strict=True)
    ]
    two = np.stack(fitted, axis=1)
    return linear_to_xyz_d50(np.vstack([two, white - two.sum(axis=0)]))


FORMAT = Format(
    name="icc",
    suffix=".icc",
    summary="ICC profile to assign to a picture, for QuPath, browsers and system viewers; keeps colours outside sRGB",
    unclipped=True,
    write=write,
    spaces=("lab",),
    largest=icc.LARGEST,
    reader=Reader(through_profile, table_of_profile),
    corrects=False,
    takes_source=True,
)
