"""What effects make of a problem's code values and tips: XYZ that the meter should report.

A fit asks thousands of times. So effects on code values are worked out once for each code value and hour, and effects
of the emission once for each hour, unless they ask for the conditions of a reading; and what lies in front of an effect
that moves is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from lutgen.colorimetry import code_to_linear
from lutgen.criticism.fit.system import readings_at
from lutgen.display.paper import nearest_weights
from lutgen.display.trace import Panel, emitted, metered, panel, through
from lutgen.effects import Scene
from lutgen.effects.scene import CodeScene, HourScene
from lutgen.readings.conditions import COLUMNS
from lutgen.readings.table import is_capped, is_shrouded

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem
    from lutgen.display.trace import Applied

#: Stages that move a channel along its curve.
BEFORE_MIXING = ("drive", "transfer")

#: Stages that light passes before white and primaries come in.
BEFORE_EMISSION = ("drive", "transfer", "mixing", "selection")

#: Stages that it passes before it leaves the display, where a sensor sees it.
BEFORE_ROOM = (*BEFORE_EMISSION, "emission", "optics")

T = TypeVar("T")


@dataclass(frozen=True)
class _Answer:
    """What effects make of tips, and of a panel."""

    applied: Sequence[Applied]
    tips: Array
    answer: Array
    before: Panel | None = None

    def by(self, others: Sequence[Applied]) -> bool:
        """Whether these effects are the same."""
        return len(self.applied) == len(others) and all(
            each.effect is other.effect and each.values == other.values
            for each, other in zip(self.applied, others, strict=True)
        )


@dataclass(frozen=True)
class Prediction:
    """The prediction of a problem's readings."""

    problem: Problem

    @cached_property
    def _columns(self) -> dict[str, Array]:
        columns = {
            "hours": self.problem.readings.hours[self.problem.rows][:, np.newaxis],
            "code": self.problem.readings.drive[self.problem.rows],
        }
        for name, logged in self.problem.readings.conditions.items():
            values = logged[self.problem.rows]
            columns[name] = np.where(np.isnan(values), COLUMNS[name].usual, values)[:, np.newaxis]
        capped, shrouded = is_capped(self.problem.readings), is_shrouded(self.problem.readings)
        open_to_room = ~(capped | shrouded)[self.problem.rows, np.newaxis]
        columns |= {name: np.where(open_to_room, value, COLUMNS[name].usual) for name, value in self.problem.assumed}
        columns["capped"] = capped[self.problem.rows].astype(float)[:, np.newaxis]
        return columns

    def scene(self, tips: Array) -> Scene:
        """What surrounds each reading; ``tips`` (..., H, 4, 3) give the whites."""
        return Scene(
            **self._columns,
            white=np.take(tips[..., 0, :], self.problem.hour_of, axis=-2),
            fresh_white=tips[..., :1, 0, :],
            light=self.problem.light,
        )

    def panel(self, applied: Sequence[Applied]) -> Panel:
        """Send the readings' code values through drive, transfer and mixing."""
        before = self._panel([*self.problem.known, *(each for each in applied if each.effect.stage in BEFORE_EMISSION)])
        if self.problem.first_readings:
            moved = [each for each in applied if each.effect.stage in BEFORE_MIXING]
            if not moved:
                return before.with_light(self.problem.first_readings.light)
            # What mixes the channels' light leaves the channels at their levels.
            mixed = any(each.effect.stage == "mixing" for each in applied)
            level = self._panel([*self.problem.known, *moved]) if mixed else before
            return before.with_light(self.problem.first_readings.beside.at(level.linear))
        return before.times(self.problem.first_session_model.held_out_gain)

    def _panel(self, applied: Sequence[Applied]) -> Panel:
        """The panel, of each code value once an hour as long as effects ask for no more."""
        # Products with an own model's tips are rounded otherwise for other colours beside them: a change of nothing
        # would be one.
        if not (self.problem.native and self.problem.native.own):
            first, place, scene = self._codes
            weights = self._weights[first]
            found = self._without_conditions(
                applied, lambda: panel(applied, scene, self.problem.selection, weights, native=self.problem.native)
            )
            if found:
                return replace(found, shares=np.take(found.shares, place, axis=0))
        return panel(applied, self._plain_scene, self.problem.selection, self._weights, native=self.problem.native)

    @cached_property
    def _codes(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Scene]:
        """A reading of each code value at each hour, the place of every reading among these, and their scene."""
        both = np.column_stack([self.problem.hour_of, self.problem.readings.drive[self.problem.rows]])
        _, first, place = np.unique(both, axis=0, return_index=True, return_inverse=True)
        white, hour = self.problem.measured_tips[:, 0], self.problem.hour_of[first]
        scene = CodeScene(
            self.problem.hours[hour][:, np.newaxis], white[hour], white[:1], self.problem.light, both[first, 1:]
        )
        return first, place.reshape(-1), cast("Scene", scene)

    @cached_property
    def _plain_scene(self) -> Scene:
        return self.scene(self.problem.measured_tips)

    @cached_property
    def _weights(self) -> Array:
        """Shares of the paper's matrices, which no effect changes."""
        return nearest_weights(code_to_linear(self.problem.readings.drive[self.problem.rows]))

    @cached_property
    def _white_weights(self) -> Array:
        """The same of white, (1, 4)."""
        return nearest_weights(np.ones((1, 3)))

    def predict(self, applied: Sequence[Applied], before: Panel, tips: Array) -> Array:
        """XYZ that the meter should report, (..., n, 3), of latent tips (..., H, 4, 3)."""
        before = self.problem.first_session_model.begun(applied, before)
        if self.problem.holds:
            tips = self._held(applied, tips)
        scene, emission = self.scene(tips), [each for each in applied if each.effect.stage == "emission"]
        return metered(applied, self._emitted(emission, before, tips, scene), scene)

    def _emitted(self, emission: Sequence[Applied], before: Panel, tips: Array, scene: Scene) -> Array:
        """XYZ behind the emission: what was asked for last is kept, as derivatives by effects behind it ask again."""
        last = self._last.get("emitted")
        if last and last.tips is tips and last.before is before and last.by(emission):
            return last.answer
        aged = self._aged(emission, tips)
        if aged is not None and aged.ndim > 3:
            xyz = before.emit_by(aged, self._readings_of_hours)
        elif aged is not None:
            # Summed as below: an effect that does nothing changes nothing, not even by rounding.
            xyz = before.emit(np.take(aged, self.problem.hour_of, axis=0))
        else:
            xyz = before.emit(through(emission, ("emission",), np.take(tips, self.problem.hour_of, axis=-3), scene))
        self._last["emitted"] = _Answer(emission, tips, xyz, before)
        return xyz

    @cached_property
    def _last(self) -> dict[str, _Answer]:
        return {}

    @cached_property
    def _readings_of_hours(self) -> list[NDArray[np.intp] | slice]:
        return [readings_at(np.flatnonzero(self.problem.hour_of == hour)) for hour in range(self.problem.hours.size)]

    def _aged(self, emission: Sequence[Applied], tips: Array) -> Array | None:
        """Send the tips of the hours (..., H, 4, 3) through the emission; None if it asks for more than the hour."""
        white = tips[..., 0, :]
        scene = cast(
            "Scene", HourScene(self.problem.hours[:, np.newaxis], white, white[..., :1, :], self.problem.light)
        )
        return self._without_conditions(emission, lambda: through(emission, ("emission",), tips, scene))

    def _without_conditions(self, applied: Sequence[Applied], answer: Callable[[], T]) -> T | None:
        """What effects make of a scene without conditions; None if they ask for more, which is tried once."""
        names = frozenset(each.effect.name for each in applied)
        if names not in self._asking_for_more:
            try:
                return answer()
            except AttributeError:
                self._asking_for_more.add(names)
        return None

    @cached_property
    def _asking_for_more(self) -> set[frozenset[str]]:
        return set()

    def _held(self, applied: Sequence[Applied], tips: Array) -> Array:
        """Tips whose white a sensor holds at that of hour 0 as long as it can; what was asked for last is kept."""
        acting = [each for each in applied if each.effect.compensated and each.effect.stage in BEFORE_ROOM]
        last = self._last.get("held")
        if last and last.tips is tips and last.by(acting):
            return last.answer
        held = tips * self._held_gain(acting, tips)[..., np.newaxis, np.newaxis]
        self._last["held"] = _Answer(acting, tips, held)
        return held

    def _held_gain(self, applied: Sequence[Applied], tips: Array) -> Array:
        """Gain by which a sensor holds the white of every hour, (..., H)."""
        scene = Scene(
            hours=self.problem.hours[:, np.newaxis],
            code=np.ones((self.problem.hours.size, 3)),
            white=tips[..., :, 0, :],
            fresh_white=tips[..., :1, 0, :],
            light=self.problem.light,
        )
        weights = np.broadcast_to(self._white_weights, (self.problem.hours.size, 4))
        before = panel(
            (*self.problem.known, *applied), scene, self.problem.selection, weights, native=self.problem.native
        )
        white = emitted(applied, before, tips, scene)[..., 1]
        return np.asarray(white[..., :1] / white)
