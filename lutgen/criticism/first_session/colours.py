"""Light that a display gives beside what its curves say, taken along where an effect moves its channels.

A curve says how much light a channel gives at a code value, not that the light is of another colour there; and several
channels together give more or less than each alone. Of a colour that the first session has read, its reading tells
both. An effect that takes the channels to another level takes that light along: that of one channel as its ramp shows
it, that of several in proportion to the product of two code values, which describes mixtures of most displays best.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import linear_to_code

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: A ramp of fewer levels between black and full drive says nothing about the levels between them.
LEAST_LEVELS = 3


@dataclass(frozen=True)
class FirstColours:
    """Light in full red, green and blue beside that of the curves, of readings (n,).

    ``level`` (n, 3) is the sRGB-encoded light of their channels without effects, ``light`` (n, 3) what they have beside
    it. ``ramps`` are channels, and functions of encoded light (n,) that give what one channel alone has, (n, 3).
    """

    level: Array
    light: Array
    ramps: tuple[tuple[int, Callable[[Array], Array]], ...]

    @classmethod
    def of(cls, linear: Array, light: Array, read: NDArray[np.bool_], place: NDArray[np.intp]) -> FirstColours:
        """Take different colours.

        ``linear`` (m, 3): their light of each channel by the curves; ``light`` (m, 3): what they have beside it;
        ``read`` (m,): whether the first session has read them; ``place`` (n,): which of them each reading is of.
        """
        from scipy.interpolate import PchipInterpolator

        level = linear_to_code(np.clip(linear, 0.0, 1.0))
        alone, ramps = read & ((level > 0).sum(axis=1) == 1) & (level < 1).all(axis=1), []
        for channel in range(3):
            ramp = np.flatnonzero(alone & (level[:, channel] > 0))
            knots, first = np.unique(level[ramp, channel], return_index=True)
            if knots.size >= LEAST_LEVELS:
                beside = np.pad(light[ramp[first]], ((1, 1), (0, 0)))
                ramps.append((channel, PchipInterpolator(np.concatenate([[0.0], knots, [1.0]]), beside)))
        return cls(level[place], light[place], tuple(ramps))

    def at(self, linear: Array) -> Array:
        """Light (n, 3) beside the curves where the channels' linear light is (n, 3)."""
        level = linear_to_code(np.clip(linear, 0.0, 1.0))
        lit = self.level > 0
        ratio = np.divide(level, self.level, out=np.ones_like(level), where=lit)
        product = ratio.prod(axis=1, keepdims=True) ** (2.0 / np.maximum(lit.sum(axis=1, keepdims=True), 1))
        return np.asarray(self._together * product + self._of_ramps(level))

    @cached_property
    def _together(self) -> Array:
        """What several channels have together, (n, 3)."""
        return self.light - self._of_ramps(self.level)

    def _of_ramps(self, level: Array) -> Array:
        light = np.zeros_like(level)
        for channel, ramp in self.ramps:
            light += ramp(level[:, channel])
        return light
