"""The calibrations that were loaded at later sessions, where the files hold them: a known change is no aging.

A calibration lies before the panel. Where the first session's file and a later one both hold the curves that the
graphics card was loaded with, a code value of the later session drives the panel as another code value did on the first
day. That code value is what the display's own model is asked for; what the model misses then is the panel's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.effects import Effect

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.effects import Scene
    from lutgen.readings import Measurements

CHANNELS = ("red", "green", "blue")

#: Code values at which a change of the calibration is kept, closest in the dark, where curves are steepest.
CODES = np.linspace(0.0, 1.0, 65) ** 2

#: Beyond the first day's full drive a curve goes on as it rises over this last share of its input.
LAST = 1.0 / 32.0

#: A change of a code value by less is none.
NOTHING = 1e-6


@dataclass(frozen=True)
class LoadedCalibrations:
    """What later calibrations make of code values, as an effect on the drive that nobody has to find."""

    #: Hours of the sessions whose calibration is known, from 0 on.
    hours: tuple[float, ...]
    #: Outputs of the calibrations at full code of red, green and blue, by hour.
    ends: tuple[tuple[float, ...], ...]
    #: Code values of the first session that drive the panel as ``CODES`` do later, by hour and channel.
    asked: tuple[tuple[tuple[float, ...], ...], ...]

    @classmethod
    def of(cls, readings: Measurements, *, told: bool) -> tuple[LoadedCalibrations, ...]:
        """Return what the calibrations of the readings do; none where fewer than two are known, or all are the same.

        ``told``: white and primaries are measured at every session, so that full code stays at full code.
        """
        known = readings.calibrations
        first = known.get(0.0)
        if first is None or len(known) < 2:
            return ()
        hours, asked = tuple(sorted(known)), []
        for hour in hours:
            codes = np.array([_asked(first, known[hour], 1 + channel) for channel in range(len(CHANNELS))])
            asked.append(codes / codes[:, -1:] if told else codes)
        if all(np.abs(each - CODES).max() < NOTHING for each in asked):
            return ()
        ends = tuple(tuple(known[hour][-1, 1:].tolist()) for hour in hours)
        return (cls(hours, ends, tuple(tuple(tuple(row) for row in each.tolist()) for each in asked)),)

    @property
    def values(self) -> Mapping[str, float]:
        """No parameter: the curves are known."""
        return {}

    @cached_property
    def effect(self) -> Effect:
        """The change as an effect; its name puts it before all others of its stage."""
        return Effect("calibration-loaded", "drive", {}, {}, (), self._sent_on)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the curves alone."""
        return type(self), (self.hours, self.ends, self.asked)

    def _sent_on(self, code: Array, scene: Scene, /, **_none: float) -> Array:
        """Code values (n, 3) → what the first session would have been asked for, at the hours of the scene."""
        last = np.searchsorted(self.hours, scene.hours[:, 0], side="right") - 1
        if not last.any():
            return code
        code, last = np.broadcast_arrays(code, last[:, np.newaxis])
        sent = code.copy()
        for session in np.unique(last[last > 0]):
            here = last[:, 0] == session
            for channel, asked in enumerate(self.asked[session]):
                sent[here, channel] = np.interp(code[here, channel], CODES, asked)
        return sent

    def sentences(self) -> tuple[str, ...]:
        """Say what changed, one sentence a session that brought another calibration."""
        sentences = []
        for place in range(1, len(self.hours)):
            now, before = self.ends[place], self.ends[place - 1]
            moves = [
                f"{name} {'raised' if end > was else 'lowered'} from {was:.3f} to {end:.3f}"
                for name, end, was in zip(CHANNELS, now, before, strict=True)
                if abs(end - was) >= 0.0005
            ]
            if self.asked[place] != self.asked[place - 1]:
                sentences.append(
                    f"By hour {self.hours[place]:g} another calibration was loaded: {', '.join(moves) or 'same ends'}. "
                    f"Its file holds the curves, so the model goes by them."
                )
        return tuple(sentences)


def _asked(first: Array, later: Array, channel: int) -> Array:
    """Code values at which the first calibration sends on what the later one does at ``CODES``."""
    sent = np.interp(CODES, later[:, 0], later[:, channel])
    codes, curve = first[:, 0], np.maximum.accumulate(first[:, channel])
    rises = np.concatenate([[True], np.diff(curve) > 0])
    codes, curve = codes[rises], curve[rises]
    slope = (curve[-1] - np.interp(1.0 - LAST, codes, curve)) / LAST
    beyond = np.maximum(sent - curve[-1], 0.0) / slope if slope > 0 else 0.0
    return np.asarray(np.interp(sent, curve, codes) + beyond)
