"""Effects that lutgen's catalogue lacks: a diagnosis must say this instead of naming the nearest entry."""

from __future__ import annotations

import numpy as np

from tests.virtual_display.physics.effect import LCDS, Scene, effect, late
from tests.virtual_display.spectra import NM, Array

#: Code range of a grey-voltage segment between two taps of a source driver's resistor string.
SEGMENT = (0.32, 0.50)

#: Relative change of each channel's light from one side of the screen to the other.
ACROSS: Array = np.array([1.0, -0.3, -0.9])


@effect("black-crush", "outside", stage="drive", typical=0.1, largest=0.5, unit="code below which it darkens")
def black_crush(code: Array, scene: Scene, size: float) -> Array:
    """Liquid crystal that needs more voltage with age: codes below a threshold become dark; the others stay."""
    threshold = np.maximum(size * late(scene.tau), 1e-9)
    return np.where(code < threshold, code**2 / threshold, code)


@effect("driver-segment", "outside", stage="transfer", typical=0.05, largest=0.5, unit="share of light at the kink")
def driver_segment(linear: Array, scene: Scene, size: float) -> Array:
    """A tap of the grey-voltage string fails: all channels lose light in one range of codes, suddenly and late."""
    low, high = SEGMENT
    hat = np.maximum(1.0 - np.abs(2.0 * scene.code - low - high) / (high - low), 0.0)
    return linear * (1.0 - size * hat * (scene.tau >= scene.traits.onset))


@effect("colour-across", "outside", stage="emission", typical=0.03, largest=0.3, unit="share from centre to side")
def colour_across(spectra: Array, scene: Scene, size: float) -> Array:
    """Lamps of different age on the two sides: each primary's colour shifts from left to right, and more with age."""
    x = (2.0 * scene.readings.u - 1.0)[:, np.newaxis, np.newaxis]
    return spectra * (1.0 + size * x * ACROSS[:, np.newaxis] * (0.3 + scene.tau)[:, :, np.newaxis])


@effect("image-retention", "outside", stage="transfer", typical=0.005, largest=0.1, unit="share of the last patch")
def image_retention(linear: Array, scene: Scene, size: float) -> Array:
    """Ions in the cell keep a share of the preceding patch, in reading order."""
    before = np.roll(scene.linear, 1, axis=0)
    first = np.diff(scene.readings.hours, prepend=-1.0) != 0.0
    before[first] = 0.0
    return linear + size * (before - linear)


@effect("viewing-gamma", "outside", stage="transfer", typical=0.05, largest=0.5, unit="exponent, top to bottom")
def viewing_gamma(linear: Array, scene: Scene, size: float) -> Array:
    """A TN panel seen from above and below: the transfer depends on the height on the screen."""
    return linear ** (1.0 + size * (2.0 * scene.readings.v - 1.0))[:, np.newaxis]


@effect("blue-run-in", "outside", stage="emission", typical=0.1, largest=0.9, unit="share at power-on", classes=LCDS)
def blue_run_in(spectra: Array, scene: Scene, size: float) -> Array:
    """A cold phosphor: excess violet light just after power-on, no excess when warm, and yellow in between."""
    minutes = np.nan_to_num(scene.readings.warmup_min, nan=np.inf)[:, np.newaxis, np.newaxis]
    swing = np.exp(-minutes / 8.0) - 0.6 * np.exp(-minutes / 25.0)
    return spectra * (1.0 + size * swing / (1.0 + np.exp((NM - 500.0) / 8.0)))


@effect("room-sensor", "outside", stage="emission", typical=0.1, largest=1.0, unit="share at 400 lx", classes=LCDS)
def room_sensor(spectra: Array, scene: Scene, size: float) -> Array:
    """An ambient-light sensor brightens the screen in a lit room."""
    lux = scene.readings.ambient_lx[:, np.newaxis, np.newaxis]
    return spectra * (1.0 + size * 1.25 * lux / (lux + 100.0))


@effect("dynamic-dimming", "outside", stage="emission", typical=0.03, largest=0.5, unit="share on black", classes=LCDS)
def dynamic_dimming(spectra: Array, scene: Scene, size: float) -> Array:
    """A backlight that dims dark pictures for contrast: a darker screen gives less light, not more."""
    dark: Array = (1.0 - scene.screen_light.mean(axis=1)) ** 4
    return spectra * (1.0 - size * dark[:, np.newaxis, np.newaxis])
