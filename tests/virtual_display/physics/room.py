"""Effects of viewing and of the instrument: light that does not come from the display, and errors of the meter.

The other forms: the coating reflects violet more than red and wears, and the lux meter reads low in bright light; glare
decreases with the window's size and is bluish; a meter's offset drifts with the meter's age and differs in X, Y, Z.
"""

from __future__ import annotations

import numpy as np

from tests.virtual_display.physics.effect import Scene, effect, late
from tests.virtual_display.spectra import NM, Array, planck

#: Hours in a year of continuous operation: the calibration of meters is counted in years.
YEAR_H = 8766.0


@effect("ambient-reflection", "same", stage="viewing", typical=0.005, unit="1/sr")
def ambient_reflection(spectrum: Array, scene: Scene, size: float) -> Array:
    """+ R_d E, in the lamp's colour."""
    return spectrum + size * scene.readings.ambient_lx[:, np.newaxis] * planck(scene.traits.lamp_k)


@effect("ambient-reflection", "other", stage="viewing", typical=0.005, unit="1/sr")
def ambient_on_a_coating(spectrum: Array, scene: Scene, size: float) -> Array:
    """A coating that reflects violet and red more than green and wears off, and a lux meter that saturates."""
    lux = scene.readings.ambient_lx[:, np.newaxis]
    coating = 1.0 + 0.25 * ((NM - 550.0) / 100.0) ** 2
    return (
        spectrum
        + size * (1.0 + 0.5 * late(scene.tau)) * lux / (1.0 - lux / 3000.0) * planck(scene.traits.lamp_k) * coating
    )


@effect("veiling-glare", "same", stage="viewing", typical=0.01, unit="share of the screen's mean light")
def veiling_glare(spectrum: Array, scene: Scene, size: float) -> Array:
    """+ g times the mean light of the screen."""
    return spectrum + size * scene.spectrum(scene.screen_light)


@effect("veiling-glare", "other", stage="viewing", typical=0.01, unit="share of a white surround's light")
def veiling_glare_of_a_lens(spectrum: Array, scene: Scene, size: float) -> Array:
    """Light scattered in the lens: bluish, and less from far than from near the patch."""
    surround = scene.readings.surround[:, np.newaxis]
    near = scene.readings.window[:, np.newaxis] ** 0.4
    light = near * scene.linear + (1.0 - near) * surround**2.3
    return spectrum + size * scene.spectrum(light) * (560.0 / NM)


@effect("meter-offset", "same", stage="instrument", typical=0.01, largest=0.3, unit="cd/m²")
def meter_offset(xyz: Array, scene: Scene, size: float) -> Array:
    """+ o, the same in every reading, including readings with the lens cap on."""
    return xyz + size * (np.ones(3) + 0.0 * scene.tau)


@effect("meter-offset", "other", stage="instrument", typical=0.01, largest=0.3, unit="cd/m²")
def meter_offset_drifting(xyz: Array, scene: Scene, size: float) -> Array:
    """A dark current that grows with the meter's age and differs between its three detectors."""
    return np.asarray(xyz + size * (0.8 + 0.5 * late(scene.tau)) * np.array([1.0, 0.8, 1.4]))


@effect("meter-drift", "same", stage="instrument", typical=0.005, unit="1/year", baseline="first-hour")
def meter_drift(xyz: Array, scene: Scene, size: float) -> Array:
    """× (1 − ε t)."""
    return xyz * (1.0 - size * scene.readings.hours[:, np.newaxis] / YEAR_H)


@effect("meter-drift", "other", stage="instrument", typical=0.005, unit="1/year at first", baseline="first-hour")
def meter_drift_settling(xyz: Array, scene: Scene, size: float) -> Array:
    """Filters that bleach, first fast, the blue filter most."""
    years = scene.readings.hours[:, np.newaxis] / YEAR_H
    return np.asarray(xyz * np.exp(-size * years / (1.0 + 0.3 * years) * np.array([0.9, 1.0, 1.3])))


@effect("meter-mismatch", "same", stage="viewing", typical=0.5, unit="nm by the end of life", baseline="first-hour")
def meter_mismatch(spectrum: Array, scene: Scene, size: float) -> Array:
    """Filters that have shifted towards red. This is equivalent to a spectrum shifted towards violet."""
    return _seen_from(spectrum, size * scene.tau)


@effect("meter-mismatch", "other", stage="viewing", typical=0.5, unit="nm by the end of life", baseline="first-hour")
def meter_mismatch_settling(spectrum: Array, scene: Scene, size: float) -> Array:
    """Filters that shift fast at first, and more at long wavelengths than at short ones."""
    moved = size * scene.tau * 1.3 / (0.3 + scene.tau)
    return _seen_from(spectrum, moved * (NM / 550.0))


def _seen_from(spectrum: Array, moved: Array) -> Array:
    """Return spectra (n, 81) at wavelengths ``moved`` nm, (n, 1) or (n, 81), beyond the nominal ones.

    The interpolation between samples is linear.
    """
    at = np.broadcast_to(NM + moved, np.shape(spectrum))
    return np.array([np.interp(where, NM, each) for where, each in zip(at, spectrum, strict=True)])
