"""Effects on emission and optics: the light itself, and the layers that it passes on its way out of the panel.

The other forms: a primary's colour changes with level along a knee instead of a line; warm-up is rational instead of
exponential; temperature acts by an Arrhenius law and differently on blue and red; the falloff at the edges is a fourth
power of each axis; leaked light has the colour of the backlight through crossed polarisers, and grows in an S-curve.
"""

from __future__ import annotations

import numpy as np

from tests.virtual_display.physics.effect import LCDS, Scene, effect, late
from tests.virtual_display.readings import REFERENCE_C
from tests.virtual_display.spectra import CMF, NM, Array

#: Time constant of the lamp's warm-up, min.
WARM_UP_MIN = 30.0


def _tilt(scene: Scene) -> Array:
    """±1 from one side of each primary's spectrum to the other, at constant luminance, (n, 3, 81)."""
    weight = scene.primaries * CMF[1]
    centre = (weight * NM).sum(axis=-1, keepdims=True) / weight.sum(axis=-1, keepdims=True)
    tilt = np.tanh((NM - centre) / 40.0)
    return np.asarray(tilt - (weight * tilt).sum(axis=-1, keepdims=True) / weight.sum(axis=-1, keepdims=True))


@effect("primary-shift", "same", stage="emission", typical=0.05, largest=0.45, unit="tilt of a primary at black")
def primary_shift(spectra: Array, scene: Scene, size: float) -> Array:
    """P(d) = P(1) + (1 − d) k: dark primaries are bluer, in proportion to the missing drive."""
    return spectra * (1.0 - size * (1.0 - scene.code)[:, :, np.newaxis] * _tilt(scene))


@effect("primary-shift", "other", stage="emission", typical=0.05, largest=0.8, unit="tilt of a primary at black")
def primary_shift_knee(spectra: Array, scene: Scene, size: float) -> Array:
    """A knee at middle level, an exponential tilt, and unequal channels."""
    share = 1.0 / (1.0 + (scene.code / 0.45) ** 2.5)
    unequal = np.array([1.2, 0.7, 1.0])
    return np.asarray(spectra * np.exp(-size * (share * unequal)[:, :, np.newaxis] * _tilt(scene)))


def _cold_minutes(scene: Scene) -> Array:
    return np.nan_to_num(scene.readings.warmup_min, nan=np.inf)[:, np.newaxis, np.newaxis]


@effect("warm-up", "same", stage="emission", typical=0.1, largest=0.9, unit="share missing at power-on", classes=LCDS)
def warm_up(spectra: Array, scene: Scene, size: float) -> Array:
    """× (1 − a e^(−m/τ_w))."""
    return spectra * (1.0 - size * np.exp(-_cold_minutes(scene) / WARM_UP_MIN))


@effect("warm-up", "other", stage="emission", typical=0.1, largest=0.9, unit="share missing at power-on", classes=LCDS)
def warm_up_rational(spectra: Array, scene: Scene, size: float) -> Array:
    """The lamp warms up as 1/(1 + m/τ)², first fast, then slowly."""
    return spectra * (1.0 - size / (1.0 + _cold_minutes(scene) / WARM_UP_MIN) ** 2)


@effect("temperature", "same", stage="emission", typical=0.003, largest=0.03, unit="1/K")
def temperature(spectra: Array, scene: Scene, size: float) -> Array:
    """× (1 − c (T − 25 °C))."""
    kelvin = (scene.readings.temperature_c - REFERENCE_C)[:, np.newaxis, np.newaxis]
    return spectra * (1.0 - size * kelvin)


@effect("temperature", "other", stage="emission", typical=0.003, largest=0.03, unit="1/K")
def temperature_arrhenius(spectra: Array, scene: Scene, size: float) -> Array:
    """Quenching by an Arrhenius law, stronger at long wavelengths."""
    inverse = 1.0 / (REFERENCE_C + 273.15) - 1.0 / (scene.readings.temperature_c + 273.15)
    kelvin = inverse[:, np.newaxis, np.newaxis] * (REFERENCE_C + 273.15) ** 2
    return spectra * np.exp(-size * kelvin * (1.0 + 0.5 * (NM - 560.0) / 100.0))


@effect("edge-falloff", "same", stage="optics", typical=0.1, largest=0.45, unit="share missing in a new corner")
def edge_falloff(spectrum: Array, scene: Scene, size: float) -> Array:
    """× (1 − k (1 + τ) ρ²), ρ = 1 in the corner."""
    u, v = scene.readings.u[:, np.newaxis], scene.readings.v[:, np.newaxis]
    rho_2 = 2.0 * ((u - 0.5) ** 2 + (v - 0.5) ** 2)
    return spectrum * (1.0 - size * (1.0 + scene.tau) * rho_2)


@effect("edge-falloff", "other", stage="optics", typical=0.1, largest=0.35, unit="share missing in a new corner")
def edge_falloff_box(spectrum: Array, scene: Scene, size: float) -> Array:
    """Fourth powers of each axis, wider than high; the growth is late and larger."""
    x, y = 2.0 * scene.readings.u[:, np.newaxis] - 1.0, 2.0 * scene.readings.v[:, np.newaxis] - 1.0
    return spectrum * (1.0 - size * (1.0 + 1.7 * late(scene.tau)) * (0.6 * x**4 + 0.4 * y**4))


@effect("black-level", "same", stage="optics", typical=0.0016, unit="share of white, new", classes=LCDS)
def black_level(spectrum: Array, scene: Scene, size: float) -> Array:
    """+ κ (1 + τ) W(t) q, q slightly blue."""
    return spectrum + size * (1.0 + scene.tau) * scene.white * (560.0 / NM) ** 0.5


@effect("black-level", "other", stage="optics", typical=0.0016, unit="share of white, new", classes=LCDS)
def black_level_of_polarisers(spectrum: Array, scene: Scene, size: float) -> Array:
    """Crossed polarisers transmit violet most, dichroic dye bleaches late, and only closed sub-pixels leak."""
    closed = scene.spectrum(1.0 - scene.linear)
    return spectrum + size * (1.0 + 2.0 * late(scene.tau)) * closed * (560.0 / NM) ** 1.5


@effect("black-level", "constant", stage="optics", typical=0.0016, unit="share of white", classes=LCDS)
def black_level_unchanging(spectrum: Array, scene: Scene, size: float) -> Array:
    """A leak that does not grow, for data sets where nothing can distinguish it from other additive light."""
    return spectrum + size * scene.white
