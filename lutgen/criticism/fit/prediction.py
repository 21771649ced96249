"""The prediction of a problem's readings, XYZ that the meter should report, from code values, tips and effects.

A fit needs thousands of predictions. So effects on code values are evaluated once for each code value and hour, and
effects of the emission once for each hour, unless they use the conditions of a reading. If an effect changes, the
result of the stages before it comes from a cache.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from lutgen.colorimetry import code_to_linear
from lutgen.criticism.fit.data import readings_at
from lutgen.display.paper import nearest_weights
from lutgen.display.trace import Panel, emitted, lit_by, metered, panel, through
from lutgen.effects import Scene
from lutgen.effects.scene import CodeScene, HourScene

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.first_session.model import FirstSessionModel
    from lutgen.criticism.fit.data import FitData
    from lutgen.display.trace import Applied

#: Stages that change the linear light of single channels.
BEFORE_MIXING = ("drive", "transfer")

#: Stages before the emission, where the tips enter.
BEFORE_EMISSION = ("drive", "transfer", "mixing", "selection")

#: Stages up to the light that leaves the display; a sensor of the display measures this light.
BEFORE_ROOM = (*BEFORE_EMISSION, "emission", "optics")

T = TypeVar("T")


@dataclass(frozen=True)
class _Cached:
    """A cached result, with its arguments: effects, tips and panel."""

    applied: Sequence[Applied]
    tips: Array
    result: Array
    before: Panel | None = None
    scene: Scene | None = None

    def is_of(self, others: Sequence[Applied]) -> bool:
        """Whether the cached result is of these effects."""
        return len(self.applied) == len(others) and all(
            each.effect is other.effect and each.values == other.values
            for each, other in zip(self.applied, others, strict=True)
        )


@dataclass(frozen=True)
class Prediction:
    """The predicted readings of a problem."""

    problem: FitData
    first_session: FirstSessionModel

    def panel(self, applied: Sequence[Applied]) -> Panel:
        """Send the readings' code values through drive, transfer and mixing."""
        before = self._panel([*self.problem.known, *(each for each in applied if each.effect.stage in BEFORE_EMISSION)])
        if self.first_session.first_readings:
            moved = [each for each in applied if each.effect.stage in BEFORE_MIXING]
            if not moved:
                return before.with_light(self.first_session.first_readings.light)
            # Effects of mixing do not change the linear light of the channels.
            mixed = any(each.effect.stage == "mixing" for each in applied)
            level = self._panel([*self.problem.known, *moved]) if mixed else before
            return before.with_light(self.first_session.first_readings.residual_light.at(level.linear))
        return before.times(self.first_session.held_out_gain)

    def _panel(self, applied: Sequence[Applied]) -> Panel:
        """Return the panel; evaluate it once for each code value and hour, unless effects need other conditions."""
        # With an own model each reading is evaluated: the rounding of its matrix products depends on which other
        # colours are evaluated, so an effect that does nothing would change the result.
        if not (self.problem.native and self.problem.native.own):
            first, inverse, scene = self._codes
            weights = self._weights[first]
            reduced = self._without_conditions(
                applied, lambda: panel(applied, scene, self.problem.selection, weights, native=self.problem.native)
            )
            if reduced:
                return replace(reduced, shares=np.take(reduced.shares, inverse, axis=0))
        return panel(applied, self._plain_scene, self.problem.selection, self._weights, native=self.problem.native)

    @cached_property
    def _codes(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Scene]:
        """Index of one reading of each code value and hour, the inverse index of every reading, and their scene."""
        hours_and_codes = np.column_stack([self.problem.hour_of, self.problem.drive])
        _, first, inverse = np.unique(hours_and_codes, axis=0, return_index=True, return_inverse=True)
        white, hour = self.problem.measured_tips[:, 0], self.problem.hour_of[first]
        scene = CodeScene(
            self.problem.hours[hour][:, np.newaxis],
            white[hour],
            white[:1],
            self.problem.light,
            hours_and_codes[first, 1:],
        )
        return first, inverse.reshape(-1), cast("Scene", scene)

    @cached_property
    def _plain_scene(self) -> Scene:
        return self.problem.scene(self.problem.measured_tips)

    @cached_property
    def _weights(self) -> Array:
        """Shares of the paper's matrices at each reading, which no effect changes, (n, 4)."""
        return nearest_weights(code_to_linear(self.problem.drive))

    @cached_property
    def _white_weights(self) -> Array:
        """Shares of the paper's matrices at white, (1, 4)."""
        return nearest_weights(np.ones((1, 3)))

    def predict(self, applied: Sequence[Applied], before: Panel, tips: Array) -> Array:
        """XYZ that the meter should report, (..., n, 3), cd/m², for latent tips (..., H, 4, 3)."""
        before = self.first_session.relative_to_first_session(applied, before)
        if self.problem.holds_white:
            tips = self._held(applied, tips)
        xyz, scene = self._emitted([each for each in applied if each.effect.stage == "emission"], before, tips)
        return metered(applied, xyz, scene)

    def _emitted(self, emission: Sequence[Applied], before: Panel, tips: Array) -> tuple[Array, Scene]:
        """XYZ and scene after the emission; the last result is cached: derivatives by later effects need it again."""
        last = self._last.get("emitted")
        if last and last.scene and last.tips is tips and last.before is before and last.is_of(emission):
            return last.result, last.scene
        scene, aged = self.problem.scene(tips), self._aged(emission, tips)
        if aged is None:
            lit = through(emission, ("emission",), np.take(tips, self.problem.hour_of, axis=-3), scene)
            xyz, scene = before.emit(lit), lit_by(lit, scene)
        else:
            if emission:
                scene = replace(scene, white=np.take(aged[..., 0, :], self.problem.hour_of, axis=-2))
            # The order of sums is the same as above: an effect that does nothing must not change the rounding.
            each = aged.ndim <= 3
            xyz = before.emit(aged[self.problem.hour_of]) if each else before.emit_by(aged, self._readings_of_hours)
        self._last["emitted"] = _Cached(emission, tips, xyz, before, scene)
        return xyz, scene

    @cached_property
    def _last(self) -> dict[str, _Cached]:
        return {}

    @cached_property
    def _readings_of_hours(self) -> list[NDArray[np.intp] | slice]:
        return [readings_at(np.flatnonzero(self.problem.hour_of == hour)) for hour in range(self.problem.hours.size)]

    def _aged(self, emission: Sequence[Applied], tips: Array) -> Array | None:
        """Apply the emission to the tips of the hours (..., H, 4, 3); None if an effect needs more than the hour."""
        white = tips[..., 0, :]
        scene = cast(
            "Scene", HourScene(self.problem.hours[:, np.newaxis], white, white[..., :1, :], self.problem.light)
        )
        return self._without_conditions(emission, lambda: through(emission, ("emission",), tips, scene))

    def _without_conditions(self, applied: Sequence[Applied], result: Callable[[], T]) -> T | None:
        """Return the result for a scene without conditions; None if effects need conditions; tested only once."""
        names = frozenset(each.effect.name for each in applied)
        if names not in self._needing_conditions:
            try:
                return result()
            except AttributeError:
                self._needing_conditions.add(names)
        return None

    @cached_property
    def _needing_conditions(self) -> set[frozenset[str]]:
        return set()

    def _held(self, applied: Sequence[Applied], tips: Array) -> Array:
        """Tips after a sensor has held the luminance of white at that of hour 0; the last result is cached."""
        acting = [each for each in applied if each.effect.compensated and each.effect.stage in BEFORE_ROOM]
        last = self._last.get("held")
        if last and last.tips is tips and last.is_of(acting):
            return last.result
        held = tips * self._held_gain(acting, tips)[..., np.newaxis, np.newaxis]
        self._last["held"] = _Cached(acting, tips, held)
        return held

    def _held_gain(self, applied: Sequence[Applied], tips: Array) -> Array:
        """Gain by which a sensor corrects the white of every hour, (..., H)."""
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
