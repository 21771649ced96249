"""The signature of an effect: the colour differences of its typical size on the un-aged default display.

There are two differences. ``whole`` compares the display with the effect to the display without the effect. ``rest``
compares the display with the effect to the paper's model whose white and primaries are measured on that display at
every hour. A change of white and primaries alone therefore has no ``rest``, and readings cannot show the change under a
baseline that measures white and primaries again.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from lutgen.colorimetry import D65, Array, delta_e_2000, linear_to_lab, xyY_to_xyz, xyz_to_linear
from lutgen.display import AppliedEffect, Tips, default_display
from lutgen.display.trace import SELECTION_STAGE, panel, reported
from lutgen.effects import Effect, Scene
from lutgen.effects.scene import LIFE_H
from lutgen.effects.spectra import SpectralDisplay, class_of
from lutgen.numerals import percent, spaced
from lutgen.readings import read_measurements
from lutgen.readings.conditions import COLUMNS, of_one_picture
from lutgen.readings.rest import TIP_DRIVES

#: Code values for the size of an effect: greys, primaries, secondaries, pale and dark mixtures.
CODES = np.vstack([
    np.repeat(np.linspace(0.0, 1.0, 11)[:, np.newaxis], 3, axis=1),
    *(level * (1 - np.eye(3)) for level in (0.5, 1.0)),
    *(level * np.eye(3) for level in (0.25, 0.5, 0.75, 1.0)),
    *((0.9, 0.7, 0.8), (0.8, 0.55, 0.7), (0.6, 0.3, 0.5), (0.4, 0.35, 0.6), (0.95, 0.9, 0.93)),
])  # fmt: skip

#: Smallest ΔE2000 that counts as a change; and the remaining share of an effect below which the tips, measured again,
#: count as containing the whole effect.
LEAST, ABSORBED = 0.005, 0.02


@dataclass(frozen=True)
class EffectDifference:
    """Colours with and without an effect, in CIE L*a*b* under the un-aged white, (n, 3) each."""

    #: Lab with the effect; without the effect; and in the paper's model with the aged display's tips at that hour.
    aged: Array
    new: Array
    model: Array

    @property
    def whole(self) -> Array:
        """ΔE2000 of the effect, (n,)."""
        return delta_e_2000(self.aged, self.new)

    @property
    def rest(self) -> Array:
        """ΔE2000 that remains if the tips are measured again, (n,)."""
        return delta_e_2000(self.aged, self.model)


@dataclass(frozen=True)
class Signature:
    """An effect of its typical size, under conditions in which the effect is visible."""

    effect: Effect
    #: Column that the effect needs → a value at which the effect is visible.
    conditions: Mapping[str, float]

    @classmethod
    def of(cls, effect: Effect) -> "Signature":
        """Return the signature under conditions that show the effect: off the centre, in a lit room, cold, …."""
        shown = dict.fromkeys(each for name in effect.needs for each in of_one_picture(name))
        return cls(effect, {name: COLUMNS[name].shown for name in shown})

    def seen(
        self, code: Array, hours: Array | float, conditions: Mapping[str, Array] | None = None
    ) -> EffectDifference:
        """Return the colours of ``code``, (n or 1, 3), at ``hours``, (n or 1,), under ``conditions``, (n, 1)."""
        tips, light = _display()
        columns: dict[str, Any] = {name: np.full((1, 1), value) for name, value in self.conditions.items()}
        columns |= conditions or {}
        hours = np.reshape(hours, (-1, 1)).astype(np.float64)
        count = max(len(code), len(hours), *(len(column) for column in columns.values()), 1)
        rest = Scene(
            hours=np.broadcast_to(hours, (count, 1)),
            code=np.broadcast_to(code, (count, 3)),
            white=tips[np.newaxis, 0],
            fresh_white=tips[np.newaxis, 0],
            light=light,
        )
        without = panel([], rest, self._selection)
        measured = [self._report(replace(rest, code=np.broadcast_to(drive, (count, 3)))) for drive in TIP_DRIVES]
        aged = self._report(replace(rest, **columns))
        seen = aged, without.emit(tips), without.emit(np.stack(measured, axis=-2))
        return EffectDifference(*(linear_to_lab(xyz_to_linear(xyz / tips[0] * D65)) for xyz in seen))

    @property
    def _selection(self) -> str:
        """Selection of the paper's matrix: without jumps, except for the effect that describes the jumps."""
        return "nearest" if self.effect.stage == SELECTION_STAGE else "continuous"

    def _report(self, scene: Scene) -> Array:
        applied = [AppliedEffect.of(self.effect, self.effect.typical())]
        tips = _display()[0][np.newaxis]
        return np.broadcast_to(reported(applied, panel(applied, scene, self._selection), tips, scene), scene.code.shape)

    def sentence(self) -> str:
        """Return the size of the effect, its colour, and the share that remains if the tips are measured again."""
        sizes = {hours: self.seen(CODES, hours) for hours in (0.0, LIFE_H / 2, LIFE_H)}
        hour = max(sizes, key=lambda hours: float(sizes[hours].whole.max()))
        whole, rest = sizes[hour].whole, sizes[hour].rest
        if whole.max() < LEAST:
            return "At its typical size it changes none of the colours and conditions that are drawn."
        code = ", ".join(f"{value:g}" for value in CODES[int(np.argmax(whole))])
        remaining = float(np.sqrt((rest**2).sum() / (whole**2).sum()))
        size = f"Up to {whole.max():.2g} ΔE2000 (code {code} at {spaced(hour)} h), {whole.mean():.2g} in the mean. "
        again = f"{size}With white and primaries measured again, "
        if remaining < ABSORBED:
            return f"{again}nothing remains: use --baseline first-hour."
        return f"{again}{percent(remaining)} remains."


@cache
def _display() -> tuple[Array, SpectralDisplay]:
    """Return the tips of the default display at hour 0, (4, 3) in cd/m², and its spectra."""
    readings = read_measurements(default_display())
    tips = xyY_to_xyz(Tips.of(readings).xyY[0])
    return tips, SpectralDisplay.of(class_of(readings.metadata.get("display", "")), tips)
