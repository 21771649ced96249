"""A native display's first session at the readings of a problem: its own model, and what effects had done by then.

Curves alone miss most colours by much more than the noise, and by the same share at every hour. So a fit foretells a
colour that the first session has read from that reading: what curves miss is so much light of the three channels,
which ages as they do. What is wrong with the one reading is in all later readings of the colour
(:mod:`lutgen.criticism.first_session.errors`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.first_session.colours import FirstColours
from lutgen.display.native import first_session_rows
from lutgen.display.trace import panel, since_first_session
from lutgen.effects import Scene
from lutgen.errors import LutgenError
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.rest import TIP_DRIVES, is_tip
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem
    from lutgen.display.trace import Applied, Panel
    from lutgen.readings import Measurements


#: A sensor holds white within so much, as a share; further away, it has no reserve, or there is none.
HELD_WITHIN = 0.03


#: Colours of a session that curves miss each in its own way: within a quarter of the range of code values they err
#: alike.
COLOURS = 4.0**3

#: Nothing is named that twice an error would explain that nobody measured: four times its variance.
ALLOWANCE = 4.0


@dataclass(frozen=True)
class FirstReadings:
    """What readings of the first session say of all readings of a problem, (n, …).

    ``beside`` has what curves miss, in full red, green and blue, and ``met`` are the readings that it is made of.
    ``colour`` (n,) numbers the colours whose later readings share an error, −1 at others; ``error`` (n, 3, 3) is what
    1 σ of it does to them, in cd/m²: noise of the first session, or what curves miss of a colour that it has not read.
    ``missed`` is how many readings err as one, of colours that were read once, in a later session; else 0. ``counts``
    says for how many each reading counts: none of ``met``, which say by ``light`` all that they know; less than 1 where
    an unknown of its own, or a likeness to others, takes it up.
    """

    beside: FirstColours
    met: NDArray[np.bool_]
    colour: NDArray[np.intp]
    error: Array
    discrepancy_factor: Array
    counts: Array

    @property
    def light(self) -> Array:
        """What curves miss, (n, 3)."""
        return self.beside.light


@dataclass(frozen=True)
class FirstSessionModel:
    """What the first session says at each reading of a problem."""

    problem: Problem

    @cached_property
    def held_out_gain(self) -> Array | None:
        """Factor (n, 3) that takes the own model from a reading of the first session; None without one."""
        native, drive = self.problem.native, self.problem.readings.drive[self.problem.rows]
        gain, first = native.own_gain(drive) if native else None, self.problem.hour_of == 0
        if native is None or native.ladder is None or gain is None:
            return None
        share = native.ladder.held_out_of(drive)
        seen = first & np.isfinite(share).all(axis=1)
        factor = np.ones_like(gain)
        factor[seen] = native.own_gain(drive[seen], share[seen]) / gain[seen]
        return factor

    @cached_property
    def first_readings(self) -> FirstReadings:
        """What the first session says of the colours that it has read, beside the colour points."""
        problem, readings, (codes, place) = self.problem, self.problem.readings, self.codes
        first = first_session_rows(readings, problem.noise.outliers)
        other = np.asarray(~is_tip(codes).any(axis=1))
        same = (readings.drive[first][:, np.newaxis] == codes).all(axis=2) & other
        times, met = same.sum(axis=0), np.isin(problem.rows, first) & other[place]
        mean = same.T.astype(np.float64) @ readings.xyz_cd_m2[first] / np.maximum(times, 1)[:, np.newaxis]
        plain = self._plain.emit(problem.measured_tips[:1])
        off = np.where((times > 0)[:, np.newaxis], mean - plain, 0.0)
        # Colours that the first session has not read are missed as their neighbours are.
        foreign, later = other & codes.any(axis=1) & (times == 0), np.bincount(place[~met], minlength=len(codes))
        alike = ALLOWANCE * max(1.0, foreign.sum() / COLOURS)
        weight = np.ones(len(first)) if problem.weights is None else problem.weights[first]
        known = np.where(times > 0, same.T.astype(np.float64) @ weight, 1.0)
        noise = problem.noise.covariance(mean) / known[:, np.newaxis, np.newaxis]
        missed = problem.discrepancy.covariance(plain) * alike
        spread = np.linalg.cholesky(np.where(foreign[:, np.newaxis, np.newaxis], missed, noise))
        once = foreign & (later == 1)
        light = np.linalg.solve(self._channels[0], off.T).T
        colour = np.where(met | ((times == 0) & ~foreign | once)[place], -1, place)
        taken = np.where(foreign, (1.0 - 1.0 / alike) / np.maximum(later, 1), 0.0)[place]
        return FirstReadings(
            beside=FirstColours.of(self._plain.linear, light, times > 0, place),
            met=met,
            colour=colour,
            error=self._aged @ spread[place] * (colour >= 0)[:, np.newaxis, np.newaxis],
            discrepancy_factor=once[place] * alike,
            counts=np.where(met, 0.0, 1.0 - taken),
        )

    @cached_property
    def errors(self) -> Array:
        """What 1 σ of each error of the first session does to later readings, (e, n, 3), cd/m².

        What is wrong with its reading of a colour is in all later ones of that colour; errors of its white and
        primaries are in what curves missed of all of them. Its dark offset is in the display's black, and not before a
        capped lens.
        """
        problem, memory, columns = self.problem, self.problem.first_readings, [np.zeros((0, self.problem.rows.size, 3))]
        if memory:
            columns += [
                np.moveaxis(memory.error * (memory.colour == colour)[:, np.newaxis, np.newaxis], 2, 0)
                for colour in np.unique(memory.colour[memory.colour >= 0])
            ]
            shares = self._plain.shares[self.codes[1]] + np.pad(memory.light, ((0, 0), (1, 0)))
            shares = shares * (memory.colour >= 0)[:, np.newaxis]
            drive, tips = problem.readings.drive[problem.rows], problem.measured_tips[0]
            of_tips = np.linalg.cholesky(problem.noise.covariance(tips))
            for tip, spread in enumerate(of_tips):
                times = (problem.is_tip_anchor & (problem.hour_of == 0) & (drive == TIP_DRIVES[tip]).all(axis=1)).sum()
                moved = self._aged @ spread * shares[:, tip, np.newaxis, np.newaxis] / np.sqrt(max(int(times), 1))
                columns.append(np.moveaxis(moved, 2, 0))
        if problem.offset_cd_m2 > 0:
            lit = self._plain.shares.sum(axis=1)[self.codes[1]] + (memory.light.sum(axis=1) if memory else 0.0)
            white = (problem.measured_tips[:, 0] / problem.measured_tips[0, 0])[problem.hour_of]
            capped, first = is_capped(problem.readings)[problem.rows], problem.hour_of == 0
            dark = (~capped & ~first) * (1.0 - lit)
            moved = (capped & first)[:, np.newaxis] - dark[:, np.newaxis] * white
            columns.append(np.eye(3)[:, np.newaxis] * problem.offset_cd_m2 * moved)
        if problem.drive_errors is not None:
            columns.append(problem.drive_errors)
        return np.concatenate(columns)

    def error_of_met(self, sizes: Array) -> Array:
        """Errors of single colours, (e,) in σ, at the readings of the first session that have them: (n, 3).

        0 at other readings.
        """
        memory, (codes, place) = self.problem.first_readings, self.codes
        found = np.zeros((self.problem.rows.size, 3))
        if memory:
            of_code = np.zeros((len(codes), 3))
            shared = np.unique(memory.colour[memory.colour >= 0])
            of_code[shared] = sizes[: 3 * len(shared)].reshape(-1, 3)
            found[memory.met] = of_code[place[memory.met]]
        return found

    @cached_property
    def _channels(self) -> Array:
        """Light of the channels alone at each hour, (H, 3, 3), cd/m²: columns are red, green and blue."""
        tips, black = self.problem.measured_tips, np.array(self._plain.black or (0.0, 0.0, 0.0))
        return np.swapaxes(tips[:, 1:] - (black * tips[:, 0])[:, np.newaxis], 1, 2)

    @cached_property
    def _aged(self) -> Array:
        """What becomes at each reading of X, Y and Z of the first session that age as the channels do, (n, 3, 3)."""
        return (self._channels @ np.linalg.inv(self._channels[0]))[self.problem.hour_of]

    def begun(self, applied: Sequence[Applied], before: Panel) -> Panel:
        """Let effects begin with the first session where the display is native: its readings had them in."""
        if not (self.problem.native and applied):
            return before
        # The same effects are asked for many times.
        key = tuple((each.effect.name, *each.values.values()) for each in applied)
        if key not in self._factors:
            self._factors.clear()
            first, tips = self._first_scene, self.problem.measured_tips[:1]
            changed = panel(applied, first, self.problem.selection, native=self.problem.native)
            factor, offset = since_first_session(applied, changed, self._plain, tips, first)
            self._factors[key] = factor[self.codes[1]], offset[self.codes[1]]
        return before.begun(*self._factors[key])

    @cached_property
    def _plain(self) -> Panel:
        return panel((), self._first_scene, self.problem.selection, native=self.problem.native)

    @cached_property
    def _factors(self) -> dict[Any, tuple[Array, Array]]:
        return {}

    @cached_property
    def codes(self) -> tuple[Array, NDArray[np.intp]]:
        """The different code values (m, 3), and each reading's place among them, (n,)."""
        codes, place = np.unique(self.problem.readings.drive[self.problem.rows], axis=0, return_inverse=True)
        return codes, place.reshape(-1)

    @cached_property
    def _first_scene(self) -> Scene:
        """The different code values at hour 0, at the campaign's rest."""
        usual = {name: column.usual for name, column in COLUMNS.items()}
        rest = usual | self.problem.readings.usual() | dict(self.problem.assumed)
        white = self.problem.measured_tips[:1, 0]
        columns = {name: np.full((1, 1), value) for name, value in rest.items()}
        return Scene(np.zeros((1, 1)), self.codes[0], white, white, light=self.problem.light, **columns)


def is_held(readings: Measurements) -> bool:
    """Whether a sensor holds white's luminance: unless the file says that it is free, or white has moved by 3 %."""
    stated = readings.metadata.get("luminance", "held")
    if stated not in {"held", "free"}:
        message = f"{readings.file}: luminance is {stated!r}. Pick one of: held, free."
        raise LutgenError(message)
    return stated == "held" and abs(white_moved(readings)) < HELD_WITHIN


def white_moved(readings: Measurements) -> float:
    """Change of white's luminance from the first session to the last, as a share."""
    white = readings.tips()[1][:, 0, 2]
    return float(white[-1] / white[0] - 1.0)
