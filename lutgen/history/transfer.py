"""Tone curves: luminance against drive, its γ and its clipping, the colour of the greys, and DICOM's display function.

A contrast that is set too high, or a calibration that reaches full drive, clips the bright end. A display that takes a
signal of limited range (16..235 of 255) for a full one, or the other way round, crushes the dark end or clips both.

DICOM PS3.14, 7.1 (Grayscale Standard Display Function) gives luminance by index of just-noticeable difference (JND);
colour-science has the function. Contrast response is TG18's (Samei et al. 2005, doi:10.1118/1.1861159, 4.3): the change
of luminance between neighbouring greys over their mean luminance, by JND, against what the standard has there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, xyz_to_lab, xyz_to_uv
from lutgen.history.patches import Ramp, mean_xyz, ramp

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.readings.session import Session

#: γ is fitted between these code values: below, black and noise are too large a part of the light; above, all curves
#: meet.
FITTED = (0.1, 0.9)

#: Fewest levels between them for a γ.
FEWEST_LEVELS = 3


@dataclass(frozen=True)
class Transfer:
    """A ramp as a curve."""

    #: Code values, (n,), and luminance after black over that of full drive, (n,).
    drive: Array
    linear: Array
    #: Slope of log ``linear`` against log ``drive`` by least squares through full drive, between 10 and 90 %; None:
    #: fewer than three levels there.
    gamma: float | None
    #: Root mean square of the relative difference between the luminance and that power; None with ``gamma``.
    residual: float | None
    #: L* of the curve less L* of sRGB at each drive, (n,): above 0 the display is lighter (CIE 15:2018, 8.2.1).
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
    if np.count_nonzero(fitted) >= FEWEST_LEVELS:
        across, up = np.log(ramp.drive[fitted]), np.log(linear[fitted])
        gamma = float(across @ up / (across @ across))
        residual = float(np.sqrt(np.mean((linear[fitted] / ramp.drive[fitted] ** gamma - 1.0) ** 2)))
    return Transfer(ramp.drive, linear, gamma, residual, lightness(linear) - lightness(code_to_linear(ramp.drive)))


def lightness(ratio: Array) -> Array:
    """L* of Y over white's (CIE 15:2018, 8.2.1); noise below 0 goes on in the straight piece. Any shape."""
    return np.where(ratio > (6 / 29) ** 3, 116.0 * np.cbrt(ratio) - 16.0, ratio * (29 / 3) ** 3)


#: Changes of a curve are ignored below this L*: black and noise are too large a part of the light there.
DARKEST = 20.0

#: Differences from full light, and from no light, that the eye does not see, as shares of full light: ΔL* ⅓.
ALIKE, DARK = 0.005, 2e-4

#: Code values nearer to 0 or 1 than this look alike on any display.
NEAR = 0.06


class Clipping(NamedTuple):
    """The code value from which light no longer rises, and up to which there is no light; None: no such code value."""

    bright: float | None
    dark: float | None


def clipping(curves: Mapping[str, Transfer]) -> dict[str, Clipping]:
    """Return name → clipping of those curves that clip at an end."""
    clipped = {}
    for name, curve in curves.items():
        still = curve.drive[np.abs(curve.linear - 1.0) <= ALIKE]
        none = curve.drive[curve.linear <= DARK]
        bright = float(still.min()) if still.size and still.min() <= 1.0 - NEAR else None
        dark = float(none.max()) if none.size and none.max() >= NEAR else None
        if bright is not None or dark is not None:
            clipped[name] = Clipping(bright, dark)
    return clipped


#: Below this code value the colour of black is too large a part of the colour of a grey.
LOWEST = 0.1


@dataclass(frozen=True)
class GreyTracking:
    """Colour of the greys, as seen, black included."""

    #: Code values from 0.1 up to white's, (n,).
    drive: Array
    #: u', v' of each less white's, (n, 2).
    shift: Array
    #: ΔE2000 to a grey of the same luminance in white's colour, under white, (n,).
    delta_e: Array


def grey_tracking(ramp: Ramp, white: Array | None) -> GreyTracking | None:
    """Return the colour of a grey ramp against white, (3,); None where there are no greys, or no white."""
    if white is None or white[1] <= 0:
        return None
    kept = (ramp.drive >= LOWEST) & (ramp.drive < 1.0 - 1e-4) & (ramp.xyz[:, 1] > 0)
    if not kept.any():
        return None
    xyz = ramp.xyz[kept]
    uv = xyz_to_uv(np.vstack([white, xyz]))
    neutral = xyz[:, 1:2] / white[1] * white
    return GreyTracking(
        ramp.drive[kept], uv[1:] - uv[0], delta_e_2000(xyz_to_lab(xyz, white), xyz_to_lab(neutral, white))
    )


#: Largest index of just-noticeable difference.
_LAST = 1023.0

#: Luminances that the function covers, cd/m².
GSDF_RANGE = (0.05, 3993.404)

#: Greys, black and white among them, that a contrast response takes at least, and of more those nearest to even steps:
#: TG18 reads 18.
FEWEST_GREYS, LEVELS = 8, 18


def luminance_of(index: Array) -> Array:
    """Luminance in cd/m² of indices of just-noticeable difference, 1 to 1023. Any shape."""
    from colour.models import eotf_DICOMGSDF

    return np.asarray(eotf_DICOMGSDF(index / _LAST))


def index_of(luminance: Array) -> Array:
    """Index of just-noticeable difference of luminances within ``GSDF_RANGE``, cd/m². Any shape."""
    from colour.models import eotf_inverse_DICOMGSDF

    return np.asarray(eotf_inverse_DICOMGSDF(luminance) * _LAST)


@dataclass(frozen=True)
class ContrastResponse:
    """Contrast between neighbouring greys."""

    #: Middle of each two code values, (n,).
    drive: Array
    #: ΔL over mean L by JND, as read and as the standard has it between the same ends, (n,).
    contrast: Array
    standard: Array

    @property
    def deviation(self) -> Array:
        """Share by which the contrast differs from the standard's, (n,)."""
        return np.asarray(self.contrast / self.standard - 1.0)

    @property
    def worst(self) -> float:
        """The largest of them."""
        return float(np.abs(self.deviation).max())


def contrast_response(session: Session, ambient_cd_m2: float = 0.0) -> ContrastResponse | None:
    """Return the response of a session's greys in the room's light; None: too few, relative, or out of range."""
    greys, black = ramp(session, "grey"), mean_xyz(session, "black")
    if not session.absolute or black is None or greys.drive.size < FEWEST_GREYS - 1 or greys.drive[-1] < 1.0 - 1e-4:
        return None
    drive = np.concatenate([[0.0], greys.drive])
    light = np.concatenate([[black[1]], greys.xyz[:, 1]]) + ambient_cd_m2
    # Between greys that are nearer to each other, noise and steps of 8 bits are larger than the contrast.
    read = np.unique(np.abs(drive - np.linspace(0.0, 1.0, LEVELS)[:, np.newaxis]).argmin(axis=1))
    drive, light = drive[read], light[read]
    if not (GSDF_RANGE[0] <= light.min() and light.max() <= GSDF_RANGE[1]):
        return None
    ends = index_of(light[[0, -1]])
    index = ends[0] + drive * (ends[1] - ends[0])
    middle = 0.5 * (drive[1:] + drive[:-1])
    return ContrastResponse(middle, _by_jnd(light, index), _by_jnd(luminance_of(index), index))


def _by_jnd(light: Array, index: Array) -> Array:
    return np.asarray(2.0 * np.diff(light) / (light[1:] + light[:-1]) / np.diff(index))
