"""``Sample``: one session's readings as shares of white, with their patches, folds, and weights by CIELAB."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from lutgen.readings.rest import TIP_DRIVES, is_tip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Parts that the patches are dealt into; each part is predicted from the others.
FOLDS = 5

SEED = 20150319

#: A reading of black or a colour point has the weight of so many others: a display's model must be right there.
CERTAIN = 5.0

#: A ramp's light that differs from full light by less than this share, ΔL* ⅓, is the same light.
ALIKE = 0.005

#: Below this share of white CIELAB is straight (CIE 15:2018, 8.2.1: (6/29)³).
STRAIGHT = (6.0 / 29.0) ** 3


def lab_slope(share: Array) -> Array:
    """Slope of CIELAB's 116 f over a share of white's X, Y or Z: any shape (CIE 15:2018, 8.2.1)."""
    return np.asarray(116.0 / 3.0 * np.maximum(share, STRAIGHT) ** (-2.0 / 3.0))


@dataclass(frozen=True)
class Sample:
    """Readings of one session that a display's own model is made of.

    Raises LutgenError: black, white or a primary at full drive was not read: names it.
    """

    #: Code values 0..1, (n, 3).
    drive: Array
    #: X, Y and Z as shares of white's, (n, 3).
    share: Array
    #: X, Y and Z of white, (3,), in any unit.
    white: Array
    #: The line of the file that each reading came from, (n,).
    lines: NDArray[np.int64]
    #: Their file, for messages.
    file: str = "<memory>"
    #: The curves that were loaded in the graphics card, (k, 4): input, red, green, blue, 0..1; None: not known.
    calibration: Array | None = None

    @classmethod
    def of(
        cls,
        drive: Array,
        xyz: Array,
        *,
        lines: NDArray[np.int64] | None = None,
        file: str = "<memory>",
        calibration: Array | None = None,
    ) -> Sample:
        """Make a sample of code values (n, 3) and XYZ (n, 3) in any unit."""
        tips = is_tip(drive)
        names = ("white", "red", "green", "blue")
        lacks = [name for name, found in zip(names, tips.T, strict=True) if not found.any()]
        lacks += [] if (~drive.any(axis=1)).any() else ["black"]
        if lacks:
            message = f"{file}: a display's own model needs {' and '.join(lacks)}, which were not read. Measure them."
            raise LutgenError(message)
        white = xyz[(drive == 1.0).all(axis=1)].mean(axis=0)
        lines = np.arange(1, len(drive) + 1) if lines is None else lines
        return cls(drive, xyz / white, white, lines, file, calibration)

    @cached_property
    def patch(self) -> NDArray[np.intp]:
        """Number of each reading's patch, (n,): readings of one code value are one patch."""
        return np.asarray(np.unique(self.drive, axis=0, return_inverse=True)[1].reshape(-1))

    @cached_property
    def is_mixture(self) -> NDArray[np.bool_]:
        """Whether each reading is of two or three channels and no grey, (n,): models are judged on these."""
        lit = (self.drive > 0).sum(axis=1)
        return np.asarray((lit >= 2) & (np.ptp(self.drive, axis=1) > 0))

    @cached_property
    def mixtures(self) -> int:
        """Number of different mixtures."""
        return int(np.unique(self.patch[self.is_mixture]).size)

    @cached_property
    def fold(self) -> NDArray[np.intp]:
        """Fold of each reading, (n,), by patch; −1 for black, white and the primaries, which every model knows."""
        known = is_tip(self.drive).any(axis=1) | ~self.drive.any(axis=1)
        part = np.random.default_rng(SEED).permutation(int(self.patch.max()) + 1) % FOLDS
        return np.where(known, -1, part[self.patch])

    @cached_property
    def certainty(self) -> Array:
        """Weight of each reading, (n,); black and the colour points, the base of all later hours, have far more."""
        return np.where(self.fold < 0, CERTAIN, 1.0)

    @cached_property
    def slope(self) -> Array:
        """CIELAB's slope at each reading, (n, 3): residuals times the slope are in CIELAB's units."""
        return lab_slope(self.share)

    @cached_property
    def tips(self) -> Array:
        """Shares of white, red, green and blue at full drive, (4, 3)."""
        return np.array([self.share[(self.drive == tip).all(axis=1)].mean(axis=0) for tip in TIP_DRIVES])

    @cached_property
    def black(self) -> Array:
        """Share of black, (3,)."""
        return np.asarray(self.share[~self.drive.any(axis=1)].mean(axis=0))

    @cached_property
    def clipped(self) -> Array | None:
        """The drives behind a clipped input, (k, 4) as a calibration: each channel up to its first level of full light.

        None where light rises up to full drive in every channel, as its ramp shows.
        """
        ends = np.ones(3)
        for channel in range(3):
            ramp = ~np.delete(self.drive, channel, axis=1).any(axis=1) & (self.drive[:, channel] > 0)
            full = self.tips[1 + channel, 1] - self.black[1]
            still = np.abs(self.share[ramp, 1] - self.black[1] - full) <= ALIKE * full
            ends[channel] = self.drive[ramp, channel][still].min(initial=1.0)
        if (ends == 1.0).all():
            return None
        codes = np.unique([0.0, *ends, 1.0])
        return np.column_stack([codes, *(np.minimum(codes / end, 1.0) for end in ends)])

    def part(self, rows: NDArray[np.bool_]) -> Sample:
        """Some of the readings, of the same white."""
        return Sample(self.drive[rows], self.share[rows], self.white, self.lines[rows], self.file, self.calibration)
