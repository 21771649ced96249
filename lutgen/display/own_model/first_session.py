"""The readings of a campaign's first session at rest, from which a native display and its own model are made."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lutgen.display.own_model.sample import Sample
from lutgen.readings import Measurements
from lutgen.readings.table import is_capped


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
