"""Residual light: light of a display that its curves do not predict, and its change by effects on the channels.

A curve predicts how much light a channel emits at a code value, but not a change of its colour. Also, the light of
several channels is not exactly the sum of their single lights. The first session's reading of a colour gives the
residual light of both causes together. If an effect changes the levels of the channels, the residual light changes too:
the part of one channel follows its ramp, and the part of several channels is proportional to the product of two code
values, which fits mixtures of most displays best.
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

#: Smallest number of levels between black and full drive with which a ramp is interpolated.
LEAST_LEVELS = 3


@dataclass(frozen=True)
class ResidualLight:
    """Residual light of n readings, in units of full red, green and blue.

    ``level`` (n, 3): sRGB-encoded light of the channels by the curves, without effects. ``light`` (n, 3): residual
    light. ``ramps``: channels, each with a function from encoded light (n,) to the channel's residual light (n, 3).
    """

    level: Array
    light: Array
    ramps: tuple[tuple[int, Callable[[Array], Array]], ...]

    @classmethod
    def of(cls, linear: Array, light: Array, read: NDArray[np.bool_], place: NDArray[np.intp]) -> ResidualLight:
        """Make the residual light of n readings from that of m distinct colours.

        ``linear`` (m, 3): light of each channel by the curves; ``light`` (m, 3): residual light; ``read`` (m,): whether
        the first session has read the colour; ``place`` (n,): index of each reading's colour.
        """
        from scipy.interpolate import PchipInterpolator

        level = linear_to_code(np.clip(linear, 0.0, 1.0))
        alone, ramps = read & ((level > 0).sum(axis=1) == 1) & (level < 1).all(axis=1), []
        for channel in range(3):
            ramp = np.flatnonzero(alone & (level[:, channel] > 0))
            knots, first = np.unique(level[ramp, channel], return_index=True)
            if knots.size >= LEAST_LEVELS:
                residual = np.pad(light[ramp[first]], ((1, 1), (0, 0)))
                ramps.append((channel, PchipInterpolator(np.concatenate([[0.0], knots, [1.0]]), residual)))
        return cls(level[place], light[place], tuple(ramps))

    def at(self, linear: Array) -> Array:
        """Residual light (n, 3) if the channels' linear light is ``linear`` (n, 3)."""
        level = linear_to_code(np.clip(linear, 0.0, 1.0))
        lit = self.level > 0
        ratio = np.divide(level, self.level, out=np.ones_like(level), where=lit)
        product = ratio.prod(axis=1, keepdims=True) ** (2.0 / np.maximum(lit.sum(axis=1, keepdims=True), 1))
        return np.asarray(self._together * product + self._of_ramps(level))

    @cached_property
    def _together(self) -> Array:
        """Residual light of several channels together, (n, 3)."""
        return self.light - self._of_ramps(self.level)

    def _of_ramps(self, level: Array) -> Array:
        """Sum of the residual lights of single channels at encoded light (n, 3): (n, 3)."""
        light = np.zeros_like(level)
        for channel, ramp in self.ramps:
            light += ramp(level[:, channel])
        return light
