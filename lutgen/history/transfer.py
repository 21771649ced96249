"""The transfer curve: luminance against drive, its γ, how far it is from sRGB, and where it clips.

A contrast that is set too high and a calibration that runs into its stop clip the bright end; a signal of limited range
(16..235 of 255) that the display takes for a full one, or the other way round, crushes or clips both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.colorimetry import code_to_linear

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.history.patches import Ramp

#: γ is fitted between these code values: below, black and noise rule; above, all curves meet.
FITTED = (0.1, 0.9)

#: A γ takes this many levels between them.
FEWEST = 3


@dataclass(frozen=True)
class Transfer:
    """A ramp as a curve.

    Attributes
    ----------
    drive, linear
        Code values, (n,), and luminance after black over that of full drive, (n,).
    gamma
        Slope of log ``linear`` against log ``drive`` by least squares through full drive, between 10 and 90 %; None:
        fewer than three levels there.
    residual
        Root mean square of what that power misses, as a share of the luminance at each level; None with ``gamma``.
    lightness
        L* of the curve less L* of sRGB at each drive, (n,): above 0 the display is lighter (CIE 15:2018, 8.2.1).

    """

    drive: Array
    linear: Array
    gamma: float | None
    residual: float | None
    lightness: Array

    @property
    def worst(self) -> int:
        """Place of the level that is farthest from sRGB."""
        return int(np.argmax(np.abs(self.lightness)))


def transfer(ramp: Ramp, black: Array | None) -> Transfer | None:
    """Return the curve of a ramp after black, if any; None where full drive was not read, or has no light."""
    if not ramp.drive.size or ramp.drive[-1] < 1.0 - 1e-4:
        return None
    light = ramp.xyz[:, 1] - (0.0 if black is None else black[1])
    if light[-1] <= 0:
        return None
    linear = light / light[-1]
    fitted = (ramp.drive >= FITTED[0]) & (ramp.drive <= FITTED[1]) & (linear > 0)
    gamma = residual = None
    if np.count_nonzero(fitted) >= FEWEST:
        across, up = np.log(ramp.drive[fitted]), np.log(linear[fitted])
        gamma = float(across @ up / (across @ across))
        residual = float(np.sqrt(np.mean((linear[fitted] / ramp.drive[fitted] ** gamma - 1.0) ** 2)))
    return Transfer(ramp.drive, linear, gamma, residual, lightness(linear) - lightness(code_to_linear(ramp.drive)))


def lightness(ratio: Array) -> Array:
    """L* of Y over white's (CIE 15:2018, 8.2.1); noise below 0 goes on in the straight piece. Any shape."""
    return np.where(ratio > (6 / 29) ** 3, 116.0 * np.cbrt(ratio) - 16.0, ratio * (29 / 3) ** 3)


#: Of L*: below this, black and noise rule a change of a curve.
DARKEST = 20.0

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
