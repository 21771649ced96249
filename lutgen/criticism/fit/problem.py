"""The unknowns of a fit of tips (white and primaries) and effects to readings, and the weights of the readings.

Under the baseline ``colour-points`` the tips of every hour are unknown, and their own readings are among the data.
Effects act on the latent display, so a fit solves the tips again whenever an effect changes. At an hour without
readings of the tips, the interpolated tips and their error are the prior. Under ``first-hour`` only the tips of hour 0
are unknown, and each session has a gain. ``native`` is ``colour-points`` with another fresh display: transfer curves
and black are measured in the first session, and their errors by the noise of that session are unknowns that all
sessions share.

Tips and gains are *local* to a block of readings, and the prediction is (nearly) linear in them. So a fit eliminates
them block by block (:mod:`lutgen.criticism.fit.least_squares`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.first_session import curve_errors
from lutgen.criticism.first_session.model import COLOURS, FirstSessionModel, is_held
from lutgen.criticism.fit.data import FitData
from lutgen.criticism.fit.prediction import Prediction
from lutgen.criticism.noise.discrepancy import discrepancy_of_native
from lutgen.criticism.noise.model import estimate_noise
from lutgen.criticism.noise.replicates import group_means
from lutgen.criticism.noise.session_columns import Marginal, shared_columns
from lutgen.display.native import NativeDisplay
from lutgen.errors import pick_one
from lutgen.names import BASELINES, NATIVE_BASELINES
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.rest import is_tip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.first_session.model import FirstReadings
    from lutgen.display.trace import Applied, Panel
    from lutgen.readings import Measurements


#: Number of readings (three values each), other than anchors, that one free parameter needs.
READINGS_A_PARAMETER = 2


@dataclass(frozen=True)
class Problem(FitData):
    """The data with the unknowns of a fit, the weights of the readings, and the prediction."""

    @classmethod
    def of(
        cls,
        readings: Measurements,
        *,
        baseline: str = "colour-points",
        selection: str = "nearest",
        instrument: str | None = None,
    ) -> Problem:
        """Make the problem of ``readings``.

        Parameters
        ----------
        readings, baseline, selection
            The data, one of ``BASELINES``, one of ``SELECTIONS``.
        instrument
            Stated noise, ``relative,floor``; None: estimated from replicates.

        Raises
        ------
        LutgenError
            Unknown baseline, or readings from which no native display can be made.

        """
        if baseline not in BASELINES:
            raise pick_one("baseline", baseline, BASELINES)
        noise = estimate_noise(readings, instrument)
        outliers = list(noise.outliers)
        native = NativeDisplay.of(readings, outliers) if baseline in NATIVE_BASELINES else None
        drawn = curve_errors.drawn_displays(readings, noise, outliers, native)
        discrepancy = discrepancy_of_native(native, drawn, readings, noise, outliers)
        drawn = drawn if discrepancy else curve_errors.bent_between_levels(drawn, native)
        return cls(
            readings,
            noise,
            baseline,
            selection,
            held=is_held(readings),
            rows=np.setdiff1d(np.arange(readings.hours.size), outliers),
            native=native,
            drawn=drawn,
            discrepancy=discrepancy,
        )

    def unlogged(self, columns: Sequence[str]) -> Problem | None:
        """Return the problem with assumed values of unlogged conditions ``columns``; None if any of them was logged."""
        is_logged = any(name in self.readings.conditions for name in columns)
        assumed = tuple((name, COLUMNS[name].unlogged) for name in columns)
        return replace(self, assumed=assumed) if assumed and not is_logged else None

    def without(self, rows: Sequence[int]) -> Problem:
        """Return the problem without some readings, by their indices in the file."""
        return replace(self, rows=np.setdiff1d(self.rows, rows))

    def with_light(self, xyz_cd_m2: Array) -> Problem:
        """Return the problem with other XYZ of its readings, (n, 3), cd/m²."""
        light = self.readings.xyz_cd_m2.copy()
        light[self.rows] = xyz_cd_m2
        return replace(self, readings=self.readings.with_light(light))

    def with_outliers(self) -> Problem:
        """Return the problem with the readings that replicates show to be outliers."""
        rows = np.union1d(self.rows, np.array(self.noise.outliers, dtype=np.intp))
        return replace(self, rows=rows, noise=replace(self.noise, outliers=()))

    @property
    def as_baked(self) -> Problem:
        """The problem without the first session's readings of single colours, which no baked display has."""
        return replace(self, uses_first_readings=False) if self.first_readings else self

    @cached_property
    def curve_points(self) -> NDArray[np.bool_]:
        """Whether a native display is made from each reading, so that it predicts the reading exactly, (n,)."""
        points = self.native.made_from(self.readings)[self.rows] if self.native else np.zeros(self.rows.size, bool)
        return points | self.first_readings.exact if self.first_readings else points

    @cached_property
    def counts(self) -> Array:
        """Effective number of readings that each reading counts as, (n,)."""
        return self.first_readings.counts if self.first_readings else np.ones(self.rows.size)

    @cached_property
    def correlated(self) -> float:
        """Number of readings that count as one, because the discrepancies of neighbouring colours are correlated."""
        sessions = self.hours.size if self.native and self.native.own else 1
        are_correlated = self.discrepancy and not self.first_readings
        return max(1.0, self.rows.size / sessions / COLOURS) if are_correlated else 1.0

    @cached_property
    def is_anchor(self) -> NDArray[np.bool_]:
        """Whether each reading is an anchor, (n,): one of a tip at rest, or one that makes the native display."""
        return self.is_tip_anchor | self.curve_points

    @cached_property
    def max_parameters(self) -> int:
        """Largest number of free parameters, by the number of distinct readings other than anchors."""
        return int(np.unique(self.groups[~self.is_anchor]).size) // READINGS_A_PARAMETER

    @cached_property
    def gains(self) -> NDArray[np.intp]:
        """Number of each reading's session gain, (n,); −1: the fitted tips absorb this gain, so it is no unknown."""
        return self._gains[0]

    @property
    def gain_keys(self) -> list[tuple[float, str]]:
        """Hour and name of the session of each gain, in the order of their numbers."""
        return self._gains[1]

    @property
    def gain_count(self) -> int:
        """Number of session gains, at least one, since a state holds an array of them."""
        return max(len(self.gain_keys), 1)

    @cached_property
    def _gains(self) -> tuple[NDArray[np.intp], list[tuple[float, str]]]:
        names = np.array(self.readings.session or [""] * self.readings.hours.size)[self.rows]
        keys = list(zip(self.hours[self.hour_of].tolist(), names.tolist(), strict=True))
        of_hour: dict[float, set[str]] = {}
        for hour, name in keys:
            of_hour.setdefault(hour, set()).add(name)
        # If tips are read at an hour with one session, they include the gain of that session.
        includes_gain = {
            float(hour)
            for hour, knot in zip(self.hours, self.is_knot, strict=True)
            if not self.from_first_hour and knot and len(of_hour[float(hour)]) == 1
        }
        known = sorted({key for key in keys if key[0] not in includes_gain})
        number = {key: place for place, key in enumerate(known)}
        return np.array([number.get(key, -1) for key in keys], dtype=np.intp), known

    @cached_property
    def blocks(self) -> list[NDArray[np.intp]]:
        """Readings that share local unknowns: of one hour, or of one session under ``from_first_hour``."""
        number = self.gains if self.from_first_hour else self.hour_of
        return [np.flatnonzero(number == each) for each in np.unique(number)]

    @cached_property
    def gains_of(self) -> dict[int, tuple[int, ...]]:
        """Numbers of the gains of each block, by its first reading."""
        return {
            int(here[0]): tuple(np.unique(self.gains[here][self.gains[here] >= 0]).tolist()) for here in self.blocks
        }

    @cached_property
    def shared(self) -> dict[int, Array]:
        """Errors shared by the readings of a session, 1 σ, whitened, (k, m, 3), by the first reading of each block."""
        return {int(here[0]): shared_columns(self, here, self.whitener)[1] for here in self.blocks}

    @cached_property
    def marginal(self) -> dict[int, Marginal]:
        """Covariance of each block with the shared errors marginalised, by its first reading."""
        return {first: Marginal.of(columns) for first, columns in self.shared.items()}

    @cached_property
    def whitener(self) -> Array:
        """Matrices (n, 3, 3) that whiten residuals, with the noise at the mean of replicates; 0 if ``counts`` is 0."""
        mean = group_means(self.xyz, self.groups)
        whitener = np.linalg.inv(np.linalg.cholesky(self._own_covariance(mean)))
        if self.first_readings:
            whitener *= (self.counts > 0)[:, np.newaxis, np.newaxis]
        if self.weights is None:
            return whitener
        return np.asarray(whitener * np.sqrt(self.weights[self.rows])[:, np.newaxis, np.newaxis])

    @cached_property
    def whitener_parts(self) -> tuple[Array, Array, Array, Array]:
        """Diagonals of the whiteners, (n, 3), and the elements below: Y by X, Z by X, Z by Y, (n,) each."""
        white = self.whitener
        below = [np.ascontiguousarray(white[:, row, column]) for row, column in ((1, 0), (2, 0), (2, 1))]
        return np.ascontiguousarray(np.diagonal(white, axis1=1, axis2=2)), below[0], below[1], below[2]

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance (n, 3, 3) of readings of light (n, 3) about the model, with the errors of the first session."""
        covariance = self._own_covariance(xyz_cd_m2)
        if self.native:
            covariance = covariance + np.einsum(
                "eni,enj->nij", self.first_session_model.errors, self.first_session_model.errors
            )
        return covariance

    def _own_covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance without the errors of the first session."""
        meter = self.noise.covariance(xyz_cd_m2)
        if not self.discrepancy:
            return meter
        # The model predicts black and the tips exactly: they have no discrepancy.
        drive, first = self.drive, self.first_readings
        if first:
            return np.asarray(meter + first.covariance_once(self.discrepancy, xyz_cd_m2))
        factor = np.asarray(drive.any(axis=1) & ~is_tip(drive).any(axis=1))
        return np.asarray(meter + self.discrepancy.covariance(xyz_cd_m2) * factor[:, np.newaxis, np.newaxis])

    @cached_property
    def curve_deviations(self) -> Array:
        """Change of the prediction by each of ``drawn``, (draws, n, 3), cd/m²; no draws without a native display."""
        return curve_errors.curve_deviations(self)

    @cached_property
    def curve_modes(self) -> Array:
        """Principal modes of the errors of the curves by noise of the first session, (q, n, 3), cd/m²."""
        if self.first_readings:
            return np.zeros((0, self.rows.size, 3))
        weights = curve_errors.mode_weights(self.curve_deviations, self.whitener)
        return np.tensordot(weights, self.curve_deviations, axes=1) if weights.size else self.curve_deviations[:0]

    @cached_property
    def first_session_model(self) -> FirstSessionModel:
        """The first session of a native display, evaluated at the readings."""
        return FirstSessionModel(self)

    @property
    def first_readings(self) -> FirstReadings | None:
        """The first session's readings of single colours; None if curves, or an own model, predict them well."""
        return self.first_session_model.first_readings

    @cached_property
    def prediction(self) -> Prediction:
        """The predicted readings."""
        return Prediction(self, self.first_session_model)

    def panel(self, applied: Sequence[Applied]) -> Panel:
        """Send the readings' code values through drive, transfer and mixing."""
        return self.prediction.panel(applied)

    def predict(self, applied: Sequence[Applied], before: Panel, tips: Array) -> Array:
        """XYZ that the meter should report, (..., n, 3), cd/m², for latent tips (..., H, 4, 3)."""
        return self.prediction.predict(applied, before, tips)
