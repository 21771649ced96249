"""ICC profile of the aged display, for whole-slide viewers, browsers and office programs that read only profiles.

Assign the profile to a *picture* (or embed it), not to the screen. A colour-managed viewer then shows the picture as on
the aged display. Viewers convert relative to the profile's white. If the profile's white were the aged white, the
yellowing would disappear. The profile's white is therefore the white of the un-aged display (D50 in ICC's terms), and
the table holds aged colours relative to it. The absolute intent gives the same result. Black point compensation, if a
viewer uses it, hides a leaking black.

The table holds L*a*b*, since Chromium shows tables of XYZ half as bright. Aged colours outside sRGB are kept for wider
screens. The profile has version 4. Chromium and Firefox decode the table of version 2 (the format ``icc-v2``) with
version 4's encoding, and show it wrong by a code or more.

The matrix and the curves beside the table are for programs that read no tables. They are the nearest matrix with the
same white as the table. Without them LittleCMS assumes a black of 0.35 % of white for a profile of version 4. It then
shows dark colours up to 11 codes darker by the perceptual intent. Chromium uses the matrix instead of the table when
the two hardly differ.
"""

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.littlecms import table_of_profile, through_profile
from lutgen.bake.lut import Lut, MatrixLut, table_of
from lutgen.bake.spaces import lab_held_to_xyz_d50, lattice, linear_to_xyz_d50, xyz_d50_to_linear
from lutgen.colorimetry import Array, code_to_linear

#: Exponent of the curve that weights the errors of the matrix, and the linear light that limits its slope near black.
GAMMA, DARK = 2.4, 0.01


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    table = table_of(lut)
    colorants = nearest_colorants(lab_held_to_xyz_d50(table))
    tags = icc.display_tags(provenance.title, provenance.lines, colorants, version=4)
    return icc.profile(device_class=b"mntr", pcs=b"Lab ", tags=(*tags, (b"A2B0", icc.table_to_lab(table))), version=4)


def nearest_colorants(xyz: Array) -> Array:
    """Return the nearest matrix with the white of a table: XYZ of red, green and blue, one per row, (3, 3).

    ``xyz``: a table as in :class:`Lut`, shape (n, n, n, 3). The fit is by least squares in linear sRGB. The slope of
    the eye's curve weights the channels. Red and green are free parameters, and blue is white minus red and green.
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
    unclipped=True,
    write=_write,
    spaces=("lab",),
    largest=icc.LARGEST,
    reader=Reader(through_profile, table_of_profile),
    corrects=False,
    takes_source=True,
)
