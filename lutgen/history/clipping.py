"""Code values that a display does not tell apart: its curve stands still at the bright or the dark end.

A contrast that is set too high and a calibration that runs into its stop clip the bright end; a signal of limited range
(16..235 of 255) that the display takes for a full one, or the other way round, crushes or clips both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.history.transfer import Transfer

#: Shares of the ramp's light that are one for the eye: at the top a third of a step of ΔL* 1, at the bottom of black.
ALIKE, DARK = 0.005, 2e-4

#: Codes nearer to the ends than this are alike on any display, or nearly.
NEAR = 0.06


class Clipping(NamedTuple):
    """The code value from which a curve stands still (None: it does not), and up to which it gives no light."""

    bright: float | None
    dark: float | None


def clipping(curves: Mapping[str, Transfer]) -> dict[str, Clipping]:
    """Return which of the curves, by name, stand still at an end; those that do not are left out."""
    found = {}
    for name, curve in curves.items():
        still = curve.drive[np.abs(curve.linear - 1.0) <= ALIKE]
        none = curve.drive[curve.linear <= DARK]
        bright = float(still.min()) if still.size and still.min() <= 1.0 - NEAR else None
        dark = float(none.max()) if none.size and none.max() >= NEAR else None
        if bright is not None or dark is not None:
            found[name] = Clipping(bright, dark)
    return found
