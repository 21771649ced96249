"""``Scene``: all that an effect may know of a reading besides the signal that passes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.spectra import SpectralDisplay

#: The life over which τ runs from 0 to 1: the paper's 18 000 h.
LIFE_H = 18_000.0

#: Panel temperature that is meant where none was logged.
REFERENCE_C = 25.0


def _column(value: float) -> Array:
    return np.full((1, 1), value)


@dataclass(frozen=True)
class Scene:
    """What surrounds the signal of n readings, in arrays that broadcast with it.

    Attributes
    ----------
    hours
        Operating hours, (n, 1) or (1, 1).
    code
        Code values that were asked for, before any effect, (n, 3).
    white, fresh_white
        XYZ in cd/m² of the display's white at that hour and at hour 0, before any effect, (..., n or 1, 3).
    u, v
        Position, 0..1 from the top left; the centre is ½, ½.
    ambient_lx
        Room light falling on the screen.
    warmup_min
        Minutes since power-on; infinity when warm.
    temperature_c
        Temperature; ``REFERENCE_C`` where unknown.
    window, surround
        Share of the screen that the patch covers, and the code value of the grey around it.
    capped
        1 where the meter's lens was capped, so that it sees no display, else 0.
    light
        The display's light as spectra.

    """

    hours: Array
    code: Array
    white: Array
    fresh_white: Array
    u: Array = field(default_factory=lambda: _column(0.5))
    v: Array = field(default_factory=lambda: _column(0.5))
    ambient_lx: Array = field(default_factory=lambda: _column(0.0))
    warmup_min: Array = field(default_factory=lambda: _column(np.inf))
    temperature_c: Array = field(default_factory=lambda: _column(REFERENCE_C))
    window: Array = field(default_factory=lambda: _column(1.0))
    surround: Array = field(default_factory=lambda: _column(0.0))
    capped: Array = field(default_factory=lambda: _column(0.0))
    light: SpectralDisplay | None = None

    @property
    def tau(self) -> Array:
        """Hours as a share of ``LIFE_H``."""
        return self.hours / LIFE_H

    @property
    def radius(self) -> Array:
        """ρ, distance from the centre of the screen; 1 in its corners."""
        return np.asarray(np.sqrt(2.0 * ((self.u - 0.5) ** 2 + (self.v - 0.5) ** 2)))

    @property
    def mean_drive(self) -> Array:
        """Mean code value of the whole screen, patch and surround."""
        return np.asarray(self.window * self.code.mean(axis=-1, keepdims=True) + (1.0 - self.window) * self.surround)


def growth(tau: Array, *, new: float, grown: float, power: float, saturation: float = 0.0) -> Array:
    """Size at τ of what is ``new`` at hour 0 and has grown by ``grown`` at τ = 1, as a power of time.

    With ``saturation`` s the power bends over as Weibull's law does, (1 − e^(−s τ^p))/(1 − e^(−s)): an exponential
    approach for p = 1, an S-curve for larger powers, within 1 % of logistic curves of most steepnesses and middles.
    """
    size = tau**power
    if saturation:
        size = np.expm1(-saturation * size) / np.expm1(-saturation)
    return new + grown * size
