"""``Sample``: the readings of one session as shares of white, with patches, folds, and CIELAB slopes.

The first session of a campaign, at rest, is the sample of a native display and of its own model.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array
from lutgen.errors import LutgenError, listed
from lutgen.readings import TIP_NAMES, Measurements
from lutgen.readings.rest import TIP_DRIVES, is_tip
from lutgen.readings.table import is_capped

#: Number of folds of the cross-validation; each fold is predicted from the other folds.
FOLDS = 5

SEED = 20150319

#: Weight of a reading of black or a colour point, where the model must be accurate; other readings have weight 1.
CERTAIN = 5.0

#: Relative tolerance for light equal to full light, about ΔL* ⅓.
ALIKE = 0.005

#: Share of white below which CIELAB is linear (CIE 15:2018, 8.2.1: (6/29)³).
STRAIGHT = (6.0 / 29.0) ** 3


def lab_slope(share: Array) -> Array:
    """Return the derivative of CIELAB's 116 f by a share of white's X, Y or Z, any shape (CIE 15:2018, 8.2.1)."""
    return np.asarray(116.0 / 3.0 * np.maximum(share, STRAIGHT) ** (-2.0 / 3.0))


@dataclass(frozen=True, eq=False)
class Sample:
    """Readings of one session for a fit of the display's own model.

    Raises LutgenError: a reading of black, white or a primary at full drive is missing; the message names it.
    """

    #: Code values 0..1, (n, 3).
    drive: Array
    #: X, Y and Z as shares of white's X, Y and Z, (n, 3).
    share: Array
    #: X, Y and Z of white, (3,), in any unit.
    white: Array
    #: Line number of each reading in the file, (n,).
    lines: NDArray[np.int64]
    #: File of the readings, for messages.
    file: str = "<memory>"
    #: Curves in the graphics card, (k, 4): input, red, green, blue, 0..1; None: not known.
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
    ) -> "Sample":
        """Return a sample of code values (n, 3) and XYZ (n, 3) in any unit."""
        tips = is_tip(drive)
        lacks = [name for name, is_name in zip(TIP_NAMES, tips.T, strict=True) if not is_name.any()]
        if drive.any(axis=1).all():
            lacks.append("black")
        if lacks:
            raise LutgenError(
                f"{file}: a display's own model needs {listed(lacks)}, which were not read. Measure them."
            )
        white = xyz[(drive == 1.0).all(axis=1)].mean(axis=0)
        lines = np.arange(1, len(drive) + 1) if lines is None else lines
        return cls(drive, xyz / white, white, lines, file, calibration)

    @cached_property
    def patch(self) -> NDArray[np.intp]:
        """Patch number of each reading, (n,); a patch has one code value."""
        return np.asarray(np.unique(self.drive, axis=0, return_inverse=True)[1].reshape(-1))

    @cached_property
    def is_mixture(self) -> NDArray[np.bool_]:
        """Whether each reading has two or three channels and is no grey, (n,); mixtures validate the models."""
        lit = (self.drive > 0).sum(axis=1)
        return np.asarray((lit >= 2) & (np.ptp(self.drive, axis=1) > 0))

    @cached_property
    def mixtures(self) -> int:
        """Number of distinct mixtures."""
        return int(np.unique(self.patch[self.is_mixture]).size)

    @cached_property
    def fold(self) -> NDArray[np.intp]:
        """Fold of each reading, (n,), by patch; −1 for black, white and the primaries, which are in every fit."""
        known = is_tip(self.drive).any(axis=1) | ~self.drive.any(axis=1)
        part = np.random.default_rng(SEED).permutation(int(self.patch.max()) + 1) % FOLDS
        return np.where(known, -1, part[self.patch])

    @cached_property
    def certainty(self) -> Array:
        """Weight of each reading, (n,); larger for black and the colour points, the basis of all later hours."""
        return np.where(self.fold < 0, CERTAIN, 1.0)

    @cached_property
    def slope(self) -> Array:
        """CIELAB's slope at each reading, (n, 3); residuals times the slope are in CIELAB units."""
        return lab_slope(self.share)

    @cached_property
    def tips(self) -> Array:
        """Shares of white's X, Y and Z for white, red, green and blue at full drive, (4, 3)."""
        return np.array([self.share[(self.drive == tip).all(axis=1)].mean(axis=0) for tip in TIP_DRIVES])

    @cached_property
    def black(self) -> Array:
        """Shares of white's X, Y and Z for black, (3,)."""
        return np.asarray(self.share[~self.drive.any(axis=1)].mean(axis=0))

    @cached_property
    def clipped(self) -> Array | None:
        """Curves of a clipped input, (k, 4) as a calibration: a channel reaches 1 at its first level of full light.

        None if the ramp of every channel rises up to full drive.
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

    def part(self, rows: NDArray[np.bool_]) -> "Sample":
        """Return a sample of some of the readings, with the same white."""
        return Sample(self.drive[rows], self.share[rows], self.white, self.lines[rows], self.file, self.calibration)


def first_session_rows(readings: Measurements, leave_out: Sequence[int] = ()) -> NDArray[np.intp]:
    """Return the indices of the readings of hour 0 at rest, without ``leave_out``."""
    return np.setdiff1d(np.flatnonzero(in_first_session(readings)), list(leave_out))


def in_first_session(readings: Measurements) -> NDArray[np.bool_]:
    """Return whether each reading is of hour 0, at rest, and not of a capped lens, (n,)."""
    return np.asarray(readings.at_rest() & ~is_capped(readings) & (readings.hours == 0))


def sample_of(readings: Measurements, rows: NDArray[np.intp]) -> Sample:
    """Return a sample of some readings of one session. Raises LutgenError: black or a colour point is missing."""
    return Sample.of(
        readings.drive[rows],
        readings.xyz_cd_m2[rows],
        lines=readings.lines[rows].astype(np.int64),
        file=readings.file_of(int(rows[0])) if rows.size else readings.file,
        calibration=readings.calibration,
    )
