"""The picture viewer of `lutgen explore` and of `lutgen report`: its script and style, and the tables it draws with.

A table holds colours, and how far each is from the un-aged one, in numbers of 16 bits.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Where ``viewer.js``, a module that imports no other, and ``viewer.css`` lie.
FOLDER = Path(__file__).parent

#: ΔE2000 that the largest number stands for; the viewer has the same.
LARGEST = 100.0


def viewer_table(shown: Array, unaged: Array | None) -> NDArray[np.uint16]:
    """Return RGBA for the viewer, little-endian, in the order of the table.

    Parameters
    ----------
    shown
        Code values that a table holds, (..., 3) in 0..1.
    unaged
        What the un-aged display shows of the same colours, for A: their ΔE2000, as :func:`differences` takes it. None:
        A is not asked for.

    """
    values = np.ones((*shown.shape[:-1], 4))
    values[..., :3] = shown
    if unaged is not None:
        before, after = (linear_to_lab(code_to_linear(code.reshape(-1, 3))) for code in (unaged, shown))
        values[..., 3] = (delta_e_2000(before, after) / LARGEST).reshape(shown.shape[:-1])
    return np.rint(np.minimum(values, 1.0) * 65_535.0).astype("<u2")
