"""A native display's first session, evaluated at the readings of a problem: residual light of curves, errors, effects.

The errors of curves exceed the noise at most colours, by the same share at every hour. So if the first session has read
a colour, a fit predicts the colour from that reading: the residual of the curves is expressed as light of the three
channels, which ages as the channels do. An error of that reading propagates to all later readings of the colour
(:mod:`lutgen.criticism.first_session.errors`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.first_session.residual_light import ResidualLight
from lutgen.display.own_model.sample import first_session_rows
from lutgen.display.trace import panel, since_first_session
from lutgen.effects import Scene
from lutgen.errors import LutgenError
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.rest import TIP_DRIVES, is_tip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.data import FitData
    from lutgen.criticism.noise.discrepancy import Discrepancy
    from lutgen.display.trace import Applied, Panel
    from lutgen.readings import Measurements


#: A sensor holds the luminance of white within this share. If white has changed by more, the display has no sensor, or
#: the sensor has no reserve.
HELD_WITHIN = 0.03


#: Number of colours of a session whose errors of curves are independent: errors are correlated within a quarter of the
#: range of code values.
COLOURS = 4.0**3

#: Factor of the variance of errors that nobody measured (2 σ): an effect is named only if errors of 2 σ cannot explain
#: the readings.
ALLOWANCE = 4.0

#: Further 1 σ of the error of curves at a colour that the first session has not read, as a share of each of X, Y and Z.
#: The discrepancy is that of other colours: between two dark levels of one channel the error may be far larger.
UNREAD = 0.1


@dataclass(frozen=True)
class FirstReadings:
    """Readings of the first session and their errors, evaluated at the n readings of a problem.

    ``residual_light``: light that the curves do not predict. ``read`` (n,): whether the first session has read the
    colour of the reading. ``exact`` (n,): whether the residual light was made from the reading, so that it is predicted
    exactly. ``colour`` (n,): number of the colour, if later readings of the colour share an error, otherwise −1.
    ``error`` (n, 3, 3): changes of these readings by 1 σ of that error, cd/m²: noise of the first session, or the
    discrepancy of curves at a colour that the first session has not read.
    ``inflation``: factor of the discrepancy's variance at colours that the first session has not read. ``once`` (n,):
    whether the colour of the reading was read only once, in a later session. ``counts`` (n,): effective number of
    readings; 0 for ``exact``, whose information is in ``light``; below 1 if the errors are correlated, or an unknown of
    the colour absorbs part of the reading.
    """

    residual_light: ResidualLight
    read: NDArray[np.bool_]
    exact: NDArray[np.bool_]
    colour: NDArray[np.intp]
    error: Array
    inflation: float
    once: NDArray[np.bool_]
    counts: Array

    @property
    def light(self) -> Array:
        """Residual light of the curves, (n, 3), in units of full red, green and blue."""
        return self.residual_light.light

    def covariance_once(self, discrepancy: Discrepancy, xyz_cd_m2: Array) -> Array:
        """Covariance (n, 3, 3) of the errors of curves at light (n, 3), for colours that were read ``once``; else 0."""
        return _of_unread(discrepancy, xyz_cd_m2, self.inflation) * self.once[:, np.newaxis, np.newaxis]


def _of_unread(discrepancy: Discrepancy, xyz_cd_m2: Array, inflation: float) -> Array:
    """Covariance (n, 3, 3) of the errors of curves at light (n, 3) that no reading of the first session shows.

    X, Y and Z are independent: their correlation is that of the colours from which the discrepancy was estimated.
    """
    variance = np.diagonal(discrepancy.covariance(xyz_cd_m2), axis1=1, axis2=2) * inflation
    return np.asarray((variance + (UNREAD * xyz_cd_m2) ** 2)[:, :, np.newaxis] * np.eye(3))


@dataclass(frozen=True)
class FirstSessionModel:
    """The first session of a native display, evaluated at each reading of a problem."""

    problem: FitData

    @cached_property
    def held_out_gain(self) -> Array | None:
        """Ratio (n, 3) of the own model's held-out prediction to its prediction, at first readings; None if unknown."""
        native, drive = self.problem.native, self.problem.drive
        gain = native.own_gain(drive) if native else None
        if native is None or native.ladder is None or gain is None:
            return None
        share = native.ladder.held_out_of(drive)
        seen = (self.problem.hour_of == 0) & np.isfinite(share).all(axis=1)
        factor = np.ones_like(gain)
        factor[seen] = native.own_gain(drive[seen], share[seen]) / gain[seen]
        return factor

    @cached_property
    def first_readings(self) -> FirstReadings | None:
        """The first session's readings of colours other than the tips; None if curves or an own model predict them."""
        if not self.problem.predicts_from_first_readings:
            return None
        problem, readings, (codes, place) = self.problem, self.problem.readings, self.codes
        first = self._first
        other = np.asarray(~is_tip(codes).any(axis=1))
        same = (readings.drive[first][:, np.newaxis] == codes).all(axis=2) & other
        times, exact = same.sum(axis=0), np.isin(problem.rows, first) & other[place]
        mean = same.T.astype(np.float64) @ readings.xyz_cd_m2[first] / np.maximum(times, 1)[:, np.newaxis]
        plain = self._plain.emit(problem.measured_tips[:1])
        residual = np.where((times > 0)[:, np.newaxis], mean - plain, 0.0)
        # At colours that the first session has not read, the errors of curves are correlated with their neighbours'.
        is_unread, later = other & codes.any(axis=1) & (times == 0), np.bincount(place[~exact], minlength=len(codes))
        inflation = ALLOWANCE * max(1.0, is_unread.sum() / COLOURS)
        weight = np.ones(len(first)) if problem.weights is None else problem.weights[first]
        known = np.where(times > 0, same.T.astype(np.float64) @ weight, 1.0)
        noise = problem.noise.covariance(mean) / known[:, np.newaxis, np.newaxis]
        of_unread = _of_unread(problem.discrepancy, plain, inflation)
        spread = np.linalg.cholesky(np.where(is_unread[:, np.newaxis, np.newaxis], of_unread, noise))
        once = is_unread & (later == 1)
        light = np.linalg.solve(self._channels[0], residual.T).T
        colour = np.where(exact | ((times == 0) & ~is_unread | once)[place], -1, place)
        absorbed = np.where(is_unread, (1.0 - 1.0 / inflation) / np.maximum(later, 1), 0.0)[place]
        return FirstReadings(
            residual_light=ResidualLight.of(self._plain.linear, light, times > 0, place),
            read=(times > 0)[place],
            exact=exact,
            colour=colour,
            error=self._aged @ spread[place] * (colour >= 0)[:, np.newaxis, np.newaxis],
            inflation=inflation,
            once=once[place],
            counts=np.where(exact, 0.0, 1.0 - absorbed),
        )

    @cached_property
    def errors(self) -> Array:
        """Changes of later readings by 1 σ of each error of the first session, (e, n, 3), cd/m².

        An error of the reading of a colour propagates to all later readings of the colour. Errors of white and
        primaries propagate to the residual light of all colours. The dark offset of the first session is an error of
        later predictions where they contain it, and of the readings of the first session elsewhere. The model of a
        display predicts nothing for a capped lens, so the offset is an error of such readings.
        """
        problem, first_readings = self.problem, self.first_readings
        columns = [np.zeros((0, problem.rows.size, 3))]
        if first_readings:
            columns += [
                np.moveaxis(first_readings.error * (first_readings.colour == colour)[:, np.newaxis, np.newaxis], 2, 0)
                for colour in np.unique(first_readings.colour[first_readings.colour >= 0])
            ]
            shares = self._plain.shares[self.codes[1]] + np.pad(first_readings.light, ((0, 0), (1, 0)))
            shares = shares * (first_readings.colour >= 0)[:, np.newaxis]
            drive, tips = problem.drive, problem.measured_tips[0]
            of_tips = np.linalg.cholesky(problem.noise.covariance(tips))
            for tip, spread in enumerate(of_tips):
                times = (problem.is_tip_anchor & (problem.hour_of == 0) & (drive == TIP_DRIVES[tip]).all(axis=1)).sum()
                change = self._aged @ spread * shares[:, tip, np.newaxis, np.newaxis] / np.sqrt(max(int(times), 1))
                columns.append(np.moveaxis(change, 2, 0))
        if problem.offset_cd_m2 > 0:
            lit = self._plain.shares.sum(axis=1)[self.codes[1]] + (
                first_readings.light.sum(axis=1) if first_readings else 0.0
            )
            white = (problem.measured_tips[:, 0] / problem.measured_tips[0, 0])[problem.hour_of]
            capped, at_start = problem.is_capped, problem.hour_of == 0
            contained = self._contains_offset & ~capped[:, np.newaxis]
            dark = ~at_start * (1.0 - lit)
            change = (at_start[:, np.newaxis] & ~contained) - dark[:, np.newaxis] * white * contained
            offsets = problem.offset_cd_m2 * problem.noise.dark_offset.T
            columns.append(offsets[:, np.newaxis] * change)
        if problem.drive_errors is not None:
            columns.append(problem.drive_errors)
        return np.concatenate(columns)

    @property
    def _contains_offset(self) -> NDArray[np.bool_]:
        """Whether the prediction of X, Y and Z contains the dark offset of the first session, (n, 3).

        Black contains the offset, unless it was read below 0 and is taken as 0. A colour that is predicted from a
        reading of this colour contains the offset of that reading.
        """
        in_black = np.array(self._plain.black or (0.0, 0.0, 0.0)) > 0
        first_readings, is_black = self.first_readings, (self.problem.drive == 0.0).all(axis=1)
        if first_readings:
            return first_readings.read[:, np.newaxis] | in_black
        own = self.problem.native is not None and self.problem.native.own is not None
        return np.asarray((~is_black & own)[:, np.newaxis] | in_black)

    def errors_of_exact(self, sizes: Array) -> Array:
        """Errors of single colours, from ``sizes`` (e,) in σ, at the readings in ``exact``, (n, 3); 0 at others."""
        first_readings, (codes, place) = self.first_readings, self.codes
        errors = np.zeros((self.problem.rows.size, 3))
        if first_readings:
            of_code = np.zeros((len(codes), 3))
            shared = np.unique(first_readings.colour[first_readings.colour >= 0])
            of_code[shared] = sizes[: 3 * len(shared)].reshape(-1, 3)
            errors[first_readings.exact] = of_code[place[first_readings.exact]]
        return errors

    @cached_property
    def _channels(self) -> Array:
        """Light of the single channels without black at each hour, (H, 3, 3), cd/m²: columns are red, green, blue."""
        tips, black = self.problem.measured_tips, np.array(self._plain.black or (0.0, 0.0, 0.0))
        return np.swapaxes(tips[:, 1:] - (black * tips[:, 0])[:, np.newaxis], 1, 2)

    @cached_property
    def _aged(self) -> Array:
        """Matrix at each reading that ages XYZ of the first session as the channels age, (n, 3, 3)."""
        return (self._channels @ np.linalg.inv(self._channels[0]))[self.problem.hour_of]

    def relative_to_first_session(self, applied: Sequence[Applied], before: Panel) -> Panel:
        """Return the panel with effects relative to hour 0, because a native display contains the effects at hour 0."""
        if not (self.problem.native and applied):
            return before
        # The factors are cached: the same effects are needed many times.
        key = tuple((each.effect.name, *each.values.values()) for each in applied)
        if key not in self._factors:
            self._factors.clear()
            first, tips = self._first_scene, self.problem.measured_tips[:1]
            changed = panel(applied, first, self.problem.selection, native=self.problem.native)
            factor, offset = since_first_session(applied, changed, self._plain, tips, first)
            self._factors[key] = factor[self.codes[1]], offset[self.codes[1]]
        return before.relative_to_first_session(*self._factors[key])

    @cached_property
    def _plain(self) -> Panel:
        """The panel of the distinct code values in the first session, without effects."""
        return panel((), self._first_scene, self.problem.selection, native=self.problem.native)

    @cached_property
    def _factors(self) -> dict[Any, tuple[Array, Array]]:
        return {}

    @cached_property
    def codes(self) -> tuple[Array, NDArray[np.intp]]:
        """The distinct code values (m, 3), and the index of each reading's code value, (n,).

        The code values of the first session are always among them: a problem of only some readings, such as those of
        white and primaries, predicts these readings as the whole problem does.
        """
        drive, first = self.problem.drive, self.problem.readings.drive[self._first]
        codes, place = np.unique(np.concatenate([drive, first]), axis=0, return_inverse=True)
        return codes, place.reshape(-1)[: len(drive)]

    @cached_property
    def _first(self) -> NDArray[np.intp]:
        """Indices in the file of the first session's readings at rest, if later readings are predicted from them."""
        if not self.problem.predicts_from_first_readings:
            return np.zeros(0, dtype=np.intp)
        return first_session_rows(self.problem.readings, self.problem.noise.outliers)

    @cached_property
    def _first_scene(self) -> Scene:
        """The scene of the distinct code values at hour 0, at the rest conditions of the campaign."""
        defaults = {name: column.usual for name, column in COLUMNS.items()}
        # A column with the same value in all rows is no condition of the readings: effects see its default there too.
        readings = self.problem.readings
        usual = {name: value for name, value in readings.usual().items() if name in readings.conditions}
        rest = defaults | usual | dict(self.problem.assumed)
        white = self.problem.measured_tips[:1, 0]
        columns = {name: np.full((1, 1), value) for name, value in rest.items()}
        return Scene(np.zeros((1, 1)), self.codes[0], white, white, light=self.problem.light, **columns)


def is_held(readings: Measurements) -> bool:
    """Whether a sensor holds the luminance of white: no if the file says so, or if white has changed by 3 % or more."""
    stated = readings.metadata.get("luminance", "held")
    if stated not in {"held", "free"}:
        message = f"{readings.file}: luminance is {stated!r}. Pick one of: held, free."
        raise LutgenError(message)
    return stated == "held" and abs(white_moved(readings)) < HELD_WITHIN


def white_moved(readings: Measurements) -> float:
    """Relative change of the luminance of white from the first session to the last."""
    white = readings.tips()[1][:, 0, 2]
    return float(white[-1] / white[0] - 1.0)
