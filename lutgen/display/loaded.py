"""Calibrations that the files of later sessions hold: a known change of the calibration is not aging.

A calibration acts before the panel. If the files of the first session and of a later session both hold the curves in
the graphics card, then a code value of the later session drives the panel like another code value of the first session.
lutgen applies the display's own model to this other code value. The remaining residual is the panel's.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects import Effect, Scene
from lutgen.readings import TIP_NAMES, Measurements

CHANNELS = TIP_NAMES[1:]

#: Code values at which a change of the calibration is stored; densest near black, where the curves are steepest.
CODES = np.linspace(0.0, 1.0, 65) ** 2

#: Last share of a curve's input whose slope extrapolates the curve beyond full drive.
LAST = 1.0 / 32.0

#: Smallest change of a code value that counts as a change.
NOTHING = 1e-6


@dataclass(frozen=True)
class LoadedCalibrations:
    """The change of code values by later calibrations, as a known effect on the drive."""

    #: Hours of the sessions with a known calibration; the first is 0.
    hours: tuple[float, ...]
    #: Outputs of the calibrations at full code of red, green and blue, for each hour.
    ends: tuple[tuple[float, ...], ...]
    #: Code values of the first session that drive the panel like ``CODES`` at each hour, by hour and channel.
    first_codes: tuple[tuple[tuple[float, ...], ...], ...]

    @classmethod
    def of(cls, readings: Measurements, *, measured_tips: bool) -> "tuple[LoadedCalibrations, ...]":
        """Return the change by the calibrations of the readings; () if fewer than two are known, or all are equal.

        ``measured_tips``: whether white and primaries are measured in every session. The calibration's change at full
        code is then already in these readings and is divided out.
        """
        known = readings.calibrations
        first = known.get(0.0)
        if first is None or len(known) < 2:
            return ()
        hours, first_codes = tuple(sorted(known)), []
        for hour in hours:
            codes = np.array([_first_codes(first, known[hour], 1 + channel) for channel in range(len(CHANNELS))])
            first_codes.append(codes / codes[:, -1:] if measured_tips else codes)
        if all(np.abs(each - CODES).max() < NOTHING for each in first_codes):
            return ()
        ends = tuple(tuple(known[hour][-1, 1:].tolist()) for hour in hours)
        return (cls(hours, ends, tuple(tuple(tuple(row) for row in each.tolist()) for each in first_codes)),)

    @property
    def values(self) -> Mapping[str, float]:
        """Empty: the effect has no parameters, because the curves are known."""
        return {}

    @cached_property
    def effect(self) -> Effect:
        """The change as an effect; its name sorts before all other effects of the stage."""
        return Effect("calibration-loaded", "drive", {}, {}, (), self._apply)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle only the curves."""
        return type(self), (self.hours, self.ends, self.first_codes)

    def _apply(self, code: Array, scene: Scene, /, **_none: float) -> Array:
        """Convert code values (n, 3) at the hours of the scene to code values of the first session."""
        last = np.searchsorted(self.hours, scene.hours[:, 0], side="right") - 1
        if not last.any():
            return code
        code, last = np.broadcast_arrays(code, last[:, np.newaxis])
        sent = code.copy()
        for session in np.unique(last[last > 0]):
            here = last[:, 0] == session
            for channel, codes in enumerate(self.first_codes[session]):
                sent[here, channel] = np.interp(code[here, channel], CODES, codes)
        return sent

    def sentences(self) -> tuple[str, ...]:
        """Return one sentence for each session with a new calibration."""
        sentences = []
        for place in range(1, len(self.hours)):
            now, before = self.ends[place], self.ends[place - 1]
            moves = [
                f"{name} {'raised' if end > was else 'lowered'} from {was:.3f} to {end:.3f}"
                for name, end, was in zip(CHANNELS, now, before, strict=True)
                if abs(end - was) >= 0.0005
            ]
            if self.first_codes[place] != self.first_codes[place - 1]:
                change = ", ".join(moves) or "the same outputs at full code"
                sentences.append(
                    f"By hour {self.hours[place]:g} another calibration was loaded: {change}. "
                    f"Its file holds the curves, so the model uses them."
                )
        return tuple(sentences)


def _first_codes(first: Array, later: Array, channel: int) -> Array:
    """Return the code values at which the first calibration has the outputs of the later calibration at ``CODES``."""
    sent = np.interp(CODES, later[:, 0], later[:, channel])
    codes, curve = first[:, 0], np.maximum.accumulate(first[:, channel])
    rises = np.concatenate([[True], np.diff(curve) > 0])
    codes, curve = codes[rises], curve[rises]
    slope = (curve[-1] - np.interp(1.0 - LAST, codes, curve)) / LAST
    beyond = np.maximum(sent - curve[-1], 0.0) / slope if slope > 0 else 0.0
    return np.asarray(np.interp(sent, curve, codes) + beyond)
