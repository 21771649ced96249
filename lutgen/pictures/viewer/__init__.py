"""The picture viewer of `lutgen explore` and of `lutgen report`: its script, its style, and the tables that it applies.

``viewer.js`` and ``viewer.css`` serve both pages and import nothing. A further file here must serve both pages too.
A table holds colours, and each colour's ΔE2000 from the un-aged colour, in numbers of 16 bits.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, linear_to_lab

#: Folder of ``viewer.js``, which imports no other module, and ``viewer.css``.
FOLDER = Path(__file__).parent

#: ΔE2000 of the largest number, and the number of code value 1. Numbers above ``WHITE`` are for code values slightly
#: above 1, which a .cube holds near clipped colours. ``viewer.js`` has the same constants.
LARGEST, WHITE = 100.0, 65_280.0


def viewer_table(shown: Array, pair: tuple[Array, Array] | None) -> NDArray[np.uint16]:
    """Return code values (..., 3) as RGBA in uint16; A is ΔE2000 between the two colours of ``pair``, if given."""
    table = np.full((*shown.shape[:-1], 4), 65_535.0)
    table[..., :3] = np.clip(shown * WHITE, 0.0, 65_535.0)
    if pair is not None:
        before, after = (linear_to_lab(code_to_linear(code.reshape(-1, 3))) for code in pair)
        share = np.minimum(delta_e_2000(before, after) / LARGEST, 1.0)
        table[..., 3] = 65_535.0 * share.reshape(shown.shape[:-1])
    return np.rint(table).astype("<u2")
