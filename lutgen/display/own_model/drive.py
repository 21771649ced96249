"""The drive of a panel: the code value itself, or the code value after the graphics card or the display's input.

ArgyllCMS stores the loaded curves with the readings (table CAL, 256 rows). It depends on the card and its cable whether
the output of the curves has 8 bits, so the ladder tries both on the readings. A display that expects another signal
range, or whose contrast is set too high, clips: above some code value its light is constant.
"""

from dataclasses import dataclass

import numpy as np

from lutgen.colorimetry import Array

#: Names of the conversions from code values to the drive of the panel.
WAYS = (
    "code value unchanged",
    "through the calibration",
    "through the calibration in 8-bit steps",
    "up to the code from which light no longer rises",
)

#: Number of steps of 8 bits.
STEPS = 255.0


@dataclass(frozen=True)
class Drive:
    """Code values (m, 3) → drive of the panel (m, 3), 0..1."""

    #: One of ``WAYS``.
    way: str = WAYS[0]
    #: Curves of the calibration or of the clipped input, (k, 4); None if ``way`` is "code value unchanged".
    calibration: Array | None = None

    def __call__(self, code: Array) -> Array:
        """Return the drives of code values; clip code values to 0..1."""
        code = np.clip(code, 0.0, 1.0)
        if self.calibration is None or self.way == WAYS[0]:
            return code
        curves = self.calibration
        sent = [np.interp(code[..., c], curves[:, 0], curves[:, 1 + c]) for c in range(3)]
        driven = np.stack(sent, axis=-1)
        driven = np.round(driven * STEPS) / STEPS if self.way == WAYS[2] else driven
        return np.asarray(np.clip(driven, 0.0, 1.0))
