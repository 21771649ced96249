"""The greys against DICOM's Grayscale Standard Display Function: how even the contrast is that an eye sees.

DICOM PS3.14, 7.1 gives luminance by index of just-noticeable difference, and colour-science the function. Contrast
response is TG18's (Samei et al. 2005, doi:10.1118/1.1861159, 4.3): between neighbouring greys the change of luminance
over their mean, by JND, against what the standard has there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.patches import mean_xyz, ramp

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: Largest index of just-noticeable difference.
_LAST = 1023.0

#: Luminances that the function covers, cd/m².
RANGE = (0.05, 3993.404)

#: Greys, black and white among them, that a contrast response takes at least, and of more those nearest to even steps:
#: TG18 reads 18.
FEWEST, LEVELS = 8, 18


def luminance_of(index: Array) -> Array:
    """Luminance in cd/m² of indices of just-noticeable difference, 1 to 1023. Any shape."""
    from colour.models import eotf_DICOMGSDF

    return np.asarray(eotf_DICOMGSDF(index / _LAST))


def index_of(luminance: Array) -> Array:
    """Index of just-noticeable difference of luminances within ``RANGE``, cd/m². Any shape."""
    from colour.models import eotf_inverse_DICOMGSDF

    return np.asarray(eotf_inverse_DICOMGSDF(luminance) * _LAST)


@dataclass(frozen=True)
class ContrastResponse:
    """Contrast between neighbouring greys.

    Attributes
    ----------
    drive
        Middle of each two code values, (n,).
    contrast, standard
        ΔL over mean L by JND, as read and as the standard has it between the same ends, (n,).

    """

    drive: Array
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
    """Return the contrast response of a session's greys with the room's light on them.

    None: relative light, fewer greys than ``FEWEST``, no black or white, or luminances beyond ``RANGE``.
    """
    greys, black = ramp(session, "grey"), mean_xyz(session, "black")
    if not session.absolute or black is None or greys.drive.size < FEWEST - 1 or greys.drive[-1] < 1.0 - 1e-4:
        return None
    drive = np.concatenate([[0.0], greys.drive])
    light = np.concatenate([[black[1]], greys.xyz[:, 1]]) + ambient_cd_m2
    # Between greys that are nearer to each other noise and 8-bit steps rule.
    read = np.unique(np.abs(drive - np.linspace(0.0, 1.0, LEVELS)[:, np.newaxis]).argmin(axis=1))
    drive, light = drive[read], light[read]
    if not (RANGE[0] <= light.min() and light.max() <= RANGE[1]):
        return None
    ends = index_of(light[[0, -1]])
    index = ends[0] + drive * (ends[1] - ends[0])
    middle = 0.5 * (drive[1:] + drive[:-1])
    return ContrastResponse(middle, _by_jnd(light, index), _by_jnd(luminance_of(index), index))


def _by_jnd(light: Array, index: Array) -> Array:
    return np.asarray(2.0 * np.diff(light) / (light[1:] + light[:-1]) / np.diff(index))
