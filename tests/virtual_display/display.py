"""The physical display: code value → light per sub-pixel → spectrum at the eye → XYZ in cd/m².

Without a hidden effect the display meets the paper's assumptions: sRGB transfer, additive, zero light at black. Its
aging is of the kind that re-measured tips absorb: the lamp dims, optics yellow, phosphor and emitters wear. The aging
is smooth: at the off-knot hours the tips lie within 0.05 % of the straight line between sessions, and within 0.01 %
except for a common gain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.virtual_display.physics import STAGES, Scene, Traits, find
from tests.virtual_display.physics.effect import code_to_linear
from tests.virtual_display.readings import LIFE_H, Readings
from tests.virtual_display.spectra import CLASSES, D65_XY, NM, Array, spectrum_to_xyz

Hidden = tuple[tuple[str, float, str], ...]


@dataclass(frozen=True)
class Display:
    """One display of a class: its primaries when new, and its aging.

    Attributes
    ----------
    steady, wearing
        Spectral radiance of R, G, B at full drive in W/(m² sr nm), (3, 81), in two parts that add up.
    dimming, yellowing, wear
        Losses in nepers at 18 000 h: of all light, at 400 nm, and of the wearing part.
    channels
        Further loss of each channel in nepers, (3,).
    power
        Exponent of time in all these losses.
    held
        Whether a sensor holds white's luminance.

    """

    steady: Array
    wearing: Array
    dimming: float
    yellowing: float
    wear: float
    channels: Array
    power: float
    held: bool

    def parts(self, hours: Array) -> tuple[Array, Array]:
        """Return the two parts of the primaries at these hours, (h, 3, 81) each."""
        age = ((hours / LIFE_H) ** self.power)[:, np.newaxis, np.newaxis]
        loss = self.dimming + self.channels[:, np.newaxis] + self.yellowing * np.exp(-(NM - 400.0) / 60.0)
        steady = self.steady * np.exp(-age * loss)
        wearing = self.wearing * np.exp(-age * (loss + self.wear))
        if self.held:
            gain = _luminance(self.steady + self.wearing) / _luminance(steady + wearing)
            return steady * gain, wearing * gain
        return steady, wearing


def _luminance(primaries: Array) -> Array:
    """Return white's Y, shape (..., 1, 1)."""
    return spectrum_to_xyz(primaries.sum(axis=-2))[..., 1, np.newaxis, np.newaxis]


def display_of(name: str, *, seed: int, ageing: float, held: bool) -> Display:
    """Build the display of class ``name`` with this seed; ``ageing`` scales the rate of aging, 0 is no aging.

    White has 220..380 cd/m² and lies within 0.003 of D65 in x and y.
    """
    rng = np.random.default_rng([seed, 0xD1])
    emission = CLASSES[name]
    x, y = np.array(D65_XY) + rng.uniform(-0.003, 0.003, 2)
    white = rng.uniform(220.0, 380.0) * np.array([x / y, 1.0, (1.0 - x - y) / y])
    gains = np.linalg.solve(spectrum_to_xyz(emission.steady + emission.wearing).T, white)[:, np.newaxis]
    common, yellow, wear = ageing * rng.uniform((0.15, 0.05, 0.05), (0.35, 0.2, 0.15))
    own = ageing * rng.uniform(0.0, 0.03 if emission.lcd else 0.1, 3)
    power = rng.uniform(1.0, 1.15)
    return Display(gains * emission.steady, gains * emission.wearing, common, yellow, wear, own, power, held)


def xyz_at_eye(display: Display, readings: Readings, hidden: Hidden, *, seed: int) -> Array:
    """Return XYZ in cd/m² of every reading without noise, (n, 3), with the effects (name, size, form) of ``hidden``."""
    scene = _scene(display, readings, seed)
    signal = readings.drive
    for stage in STAGES:
        if stage == "transfer":
            signal = code_to_linear(signal)
        elif stage == "emission":
            signal = signal[:, :, np.newaxis] * scene.primaries
        elif stage == "optics":
            signal = signal.sum(axis=1)
        elif stage == "instrument":
            signal = spectrum_to_xyz(signal) * readings.capped[:, np.newaxis]
        for name, size, form in hidden:
            effect = find(name, form)
            if effect.stage == stage:
                signal = effect.act(signal, scene, size)
    return signal


def _scene(display: Display, readings: Readings, seed: int) -> Scene:
    hours, session = np.unique(readings.hours, return_inverse=True)
    steady, wearing = display.parts(hours)
    primaries = steady + wearing
    return Scene(readings, primaries[session], (wearing / primaries)[session], Traits.drawn(seed))
