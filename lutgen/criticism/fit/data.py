"""The data of a fit: readings, the model of the fresh display, the noise, and the measured tips (white and primaries).

Effects act on the latent display, whose tips a fit estimates. At an hour without readings of the tips, the tips are
interpolated in time between neighbouring hours, with the error of the interpolation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.noise.discrepancy import NONE, Discrepancy
from lutgen.criticism.noise.replicates import replicate_groups
from lutgen.display.loaded import LoadedCalibrations
from lutgen.effects import Scene
from lutgen.effects.spectra import SpectralDisplay, class_of
from lutgen.errors import LutgenError
from lutgen.names import FORETELLING_BASELINES
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.rest import TIP_DRIVES, is_tip
from lutgen.readings.table import is_capped, is_shrouded
from lutgen.time_law import between, error_between

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.noise.model import Noise
    from lutgen.display.native import NativeDisplay
    from lutgen.readings import Measurements


@dataclass(frozen=True)
class FitData:
    """Readings, the model of the fresh display, and the noise, with what follows from them without an effect.

    Attributes
    ----------
    readings
        The data.
    noise
        Noise of the readings.
    baseline, selection
        One of ``BASELINES``; the paper's choice of matrix.
    held
        Whether a sensor holds the luminance of white (used under ``first-hour`` only).
    rows
        Indices of the n readings that are fitted; outliers are left out.
    assumed
        Assumed values of conditions that were not logged, equal at all readings except shrouded or capped ones:
        (column, value).
    native
        The fresh display of native baselines; None: the paper's.
    drawn
        Native displays of simulated first sessions, which differ by noise; empty with an own model.
    discrepancy
        Model discrepancy: error of the display's own model at colours to which it was not fitted.
    offset_cd_m2, wander
        Standard deviation, between sessions, of the instrument's dark offset in X, Y and Z, and of the drift of its
        gain within a session, as a share; 0: none.
    weights
        Weight of every reading in the file, a factor of the inverse variance; None: 1.
    uses_first_readings
        Whether colours that the first session has read are predicted from that reading and not from the curves alone:
        yes in fits, no in baked displays.
    drive_errors
        Change of the readings by 1 σ errors of effects on code values, (e, n, 3), cd/m²
        (:mod:`lutgen.criticism.first_session.slope_errors`); None: none.

    """

    readings: Measurements
    noise: Noise
    baseline: str
    selection: str
    held: bool
    rows: NDArray[np.intp]
    assumed: tuple[tuple[str, float], ...] = ()
    native: NativeDisplay | None = None
    drawn: tuple[NativeDisplay, ...] = ()
    discrepancy: Discrepancy = NONE
    offset_cd_m2: float = 0.0
    wander: float = 0.0
    weights: Array | None = None
    uses_first_readings: bool = True
    drive_errors: Array | None = None

    @cached_property
    def xyz(self) -> Array:
        """Measured XYZ, (n, 3), cd/m²."""
        return self.readings.xyz_cd_m2[self.rows]

    @cached_property
    def drive(self) -> Array:
        """Code values, (n, 3)."""
        return self.readings.drive[self.rows]

    @cached_property
    def is_capped(self) -> NDArray[np.bool_]:
        """Whether the lens of the meter was capped at each reading, (n,)."""
        return is_capped(self.readings)[self.rows]

    @cached_property
    def is_at_rest(self) -> NDArray[np.bool_]:
        """Whether each reading has the conditions of the tips of its session, (n,)."""
        return self.readings.at_rest()[self.rows]

    @cached_property
    def hours(self) -> Array:
        """The distinct hours, increasing, (H,)."""
        return np.unique(self.readings.hours[self.rows])

    @cached_property
    def hour_of(self) -> NDArray[np.intp]:
        """Index of each reading's hour, (n,)."""
        return np.searchsorted(self.hours, self.readings.hours[self.rows])

    @property
    def from_first_hour(self) -> bool:
        """Whether every session is predicted from hour 0: tips of later hours are no unknowns."""
        return self.baseline in FORETELLING_BASELINES

    @property
    def holds_white(self) -> bool:
        """Whether a sensor's control of white is predicted; measured tips already include it."""
        return self.from_first_hour and self.held

    @property
    def predicts_from_first_readings(self) -> bool:
        """Whether the first session's readings of single colours are used: curves alone predict worse than they do."""
        return self.uses_first_readings and self.native is not None and not self.native.own and bool(self.discrepancy)

    @cached_property
    def is_tip_anchor(self) -> NDArray[np.bool_]:
        """Whether each reading is one of a tip at rest, from which the tips are solved, (n,)."""
        anchor = is_tip(self.drive).any(axis=1) & self.is_at_rest & ~self.is_capped
        return np.asarray(anchor & (self.hour_of == 0) if self.from_first_hour else anchor)

    @cached_property
    def groups(self) -> NDArray[np.intp]:
        """Number of each reading's group of replicates, (n,)."""
        return replicate_groups(self.readings)[self.rows]

    @cached_property
    def is_knot(self) -> NDArray[np.bool_]:
        """Whether the tips were read at each hour: the knots of the interpolation in time, (H,)."""
        return np.isin(self.hours, self.readings.tips()[0])

    @cached_property
    def measured_tips(self) -> Array:
        """Tips at every hour, as measured or interpolated, (H, 4, 3), cd/m²."""
        tips = np.empty((self.hours.size, 4, 3))
        for index in np.flatnonzero(self.is_knot):
            here = self.is_at_rest & ~self.is_capped & (self.hour_of == index)
            for tip in range(4):
                chosen = here & (self.drive == TIP_DRIVES[tip]).all(axis=1)
                if not chosen.any():
                    message = (
                        f"{self.readings.file}: hour {self.hours[index]:g}: all readings of white or of one primary "
                        f"contradict others, and are left out. Measure white, red, green and blue of that hour again."
                    )
                    raise LutgenError(message)
                tips[index, tip] = self.xyz[chosen].mean(axis=0)
        return self.interpolated(tips)

    def interpolated(self, tips: Array) -> Array:
        """Interpolate the hours without measured tips by the law of :mod:`lutgen.time_law`: (..., H, 4, 3)."""
        tips = tips.copy()
        by_hour = np.moveaxis(tips, -3, 0)
        times, values = self.hours[self.is_knot], by_hour[self.is_knot]
        for index in np.flatnonzero(~self.is_knot):
            by_hour[index] = between(times, values, self.hours[index])
        return tips

    @cached_property
    def interpolation_sigma(self) -> Array:
        """Error of the interpolated tips of each hour, 1 σ, (H, 4, 3), cd/m²; infinite at hours with measured tips."""
        error = np.full((self.hours.size, 4, 3), np.inf)
        times, values = self.hours[self.is_knot], self.measured_tips[self.is_knot]
        for index in np.flatnonzero(~self.is_knot):
            error[index] = error_between(times, values, self.hours[index])
        return error

    @cached_property
    def known(self) -> tuple[LoadedCalibrations, ...]:
        """Known changes that are not aging: calibrations that the files of later sessions hold."""
        return LoadedCalibrations.of(self.readings, measured_tips=not self.from_first_hour) if self.native else ()

    @cached_property
    def light(self) -> SpectralDisplay:
        """Spectral estimate of the display's class with the tips of hour 0."""
        return SpectralDisplay.of(class_of(self.readings.metadata.get("display", "")), self.measured_tips[0])

    @cached_property
    def _columns(self) -> dict[str, Array]:
        columns = {
            "hours": self.readings.hours[self.rows][:, np.newaxis],
            "code": self.drive,
        }
        for name, logged in self.readings.conditions.items():
            values = logged[self.rows]
            columns[name] = np.where(np.isnan(values), COLUMNS[name].usual, values)[:, np.newaxis]
        open_to_room = ~(self.is_capped | is_shrouded(self.readings)[self.rows])[:, np.newaxis]
        columns |= {name: np.where(open_to_room, value, COLUMNS[name].usual) for name, value in self.assumed}
        columns["capped"] = self.is_capped.astype(float)[:, np.newaxis]
        return columns

    def scene(self, tips: Array) -> Scene:
        """The scene of each reading: its conditions, and the whites of ``tips`` (..., H, 4, 3)."""
        return Scene(
            **self._columns,
            white=np.take(tips[..., 0, :], self.hour_of, axis=-2),
            fresh_white=tips[..., :1, 0, :],
            light=self.light,
        )


def readings_at(here: NDArray[np.intp]) -> NDArray[np.intp] | slice:
    """Return sorted indices of readings as a slice if they are consecutive: a slice costs no copy."""
    consecutive = here.size and here[-1] - here[0] == here.size - 1
    return slice(int(here[0]), int(here[-1]) + 1) if consecutive else here
