"""Tips whose primaries fade unequally: what becomes of white."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.colorimetry import Array


def scaled(tips: Array, gain: Array) -> Array:
    """Multiply the primaries of tips (..., n or 1, 4, 3) by gains (n or 1, 3).

    White follows as the sum of its primaries; what it has beside them, W − R − G − B, takes their mean gain, so that
    equal gains scale the whole display.
    """
    white, primaries = tips[..., 0, :], tips[..., 1:, :]
    beside = white - primaries[..., 0, :] - primaries[..., 1, :] - primaries[..., 2, :]
    faded = primaries * gain[..., np.newaxis]
    whole = faded[..., 0, :] + faded[..., 1, :] + faded[..., 2, :] + beside * gain.mean(axis=-1, keepdims=True)
    return np.concatenate([whole[..., np.newaxis, :], faded], axis=-2)
