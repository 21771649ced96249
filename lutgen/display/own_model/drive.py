"""The drive of a panel: the code value as sent, or as the graphics card or the display's input changes it.

ArgyllCMS keeps the curves that were loaded beside the readings (table CAL, 256 rows). Whether they were sent on in 8
bits depends on the card and its cable, so the ladder tries both on the readings. A display that expects another signal
range, or whose contrast is set too high, clips: from some code value on its light no longer rises.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: The ways from code values to the panel.
WAYS = (
    "as asked",
    "through the calibration",
    "through the calibration in 8-bit steps",
    "up to the code from which light no longer rises",
)

#: Steps of 8 bits.
STEPS = 255.0


@dataclass(frozen=True)
class Drive:
    """Code values (m, 3) → what reaches the panel (m, 3), 0..1."""

    #: One of ``WAYS``.
    way: str = WAYS[0]
    #: The curves, of the calibration or of the clipped input, (k, 4); None where ``way`` is "as asked".
    calibration: Array | None = None

    def __call__(self, code: Array) -> Array:
        """Return the drives of code values, which are clipped to 0..1."""
        code = np.clip(code, 0.0, 1.0)
        if self.calibration is None or self.way == WAYS[0]:
            return code
        curves = self.calibration
        sent = [np.interp(code[..., c], curves[:, 0], curves[:, 1 + c]) for c in range(3)]
        driven = np.stack(sent, axis=-1)
        driven = np.round(driven * STEPS) / STEPS if self.way == WAYS[2] else driven
        return np.asarray(np.clip(driven, 0.0, 1.0))
