"""Aging that re-measured tips absorb. Only a prediction from the hour-0 display shows it.

The other forms use: rational or stretched laws for exponentials, τ^1.3 for τ, a drifting absorption edge for an
exponential tail, and a soft knee for a hard knee.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from tests.virtual_display.physics.effect import LCDS, Scene, effect
from tests.virtual_display.spectra import CLASSES, NM, Array

#: Time constant in h of the fast loss of an OLED or of a new lamp.
BURN_IN_H = 600.0

#: Loss of red, green and blue relative to blue, from 7, 8 and 12 % per 1000 h on an early OLED.
CHANNEL_LOSS: Array = np.array([7.0, 8.0, 12.0]) / 12.0

PHOSPHORS = tuple(name for name in CLASSES if name != "OLED")
OWN_LIGHT = ("OLED", "RGB LED LCD")

loss = partial(effect, stage="emission", baseline="first-hour")


def _each(column: Array) -> Array:
    """Reshape (n, k) for the product with spectra of shape (n, 3, 81)."""
    return column[:, :, np.newaxis]


@loss("backlight-decay", "same", typical=0.5, largest=3.0, unit="nepers")
def backlight_decay(spectra: Array, scene: Scene, size: float) -> Array:
    """exp(−s τ^1.41); this power fits the paper's 67 % and 40 %."""
    return spectra * _each(np.exp(-size * scene.tau**1.41))


@loss("backlight-decay", "other", typical=0.5, largest=3.0, unit="nepers")
def backlight_decay_rational(spectra: Array, scene: Scene, size: float) -> Array:
    """1/(1 + s τ^1.3/2)²."""
    return spectra / _each((1.0 + 0.5 * size * scene.tau**1.3) ** 2)


@loss("burn-in-decay", "same", typical=0.05, largest=0.5, unit="quick share")
def burn_in_decay(spectra: Array, scene: Scene, size: float) -> Array:
    """c e^(−t/T₁) + (1 − c) e^(−t/T₂); the slow part loses 3 c in a life."""
    quick = np.exp(-scene.readings.hours[:, np.newaxis] / BURN_IN_H)
    return spectra * _each(size * quick + (1.0 - size) * np.exp(-3.0 * size * scene.tau))


@loss("burn-in-decay", "other", typical=0.05, largest=0.5, unit="quick share")
def burn_in_rational(spectra: Array, scene: Scene, size: float) -> Array:
    """A fast stretched loss (exponent 0.5) and a slow rational loss."""
    hours = scene.readings.hours[:, np.newaxis]
    quick = 1.0 - size * (1.0 - np.exp(-np.sqrt(hours / BURN_IN_H)))
    return spectra * _each(quick / (1.0 + 2.0 * size * scene.tau))


@loss("phosphor-wear", "same", typical=0.2, largest=2.0, unit="nepers", classes=PHOSPHORS)
def phosphor_wear(spectra: Array, scene: Scene, size: float) -> Array:
    """One part of the spectrum falls as exp(−s τ)."""
    return spectra * (1.0 - scene.wearing * (1.0 - _each(np.exp(-size * scene.tau))))


@loss("phosphor-wear", "other", typical=0.2, largest=2.0, unit="nepers", classes=PHOSPHORS)
def phosphor_wear_rational(spectra: Array, scene: Scene, size: float) -> Array:
    """One part falls as 1/(1 + s τ^1.3); a little of the light that the phosphor no longer converts leaks unchanged."""
    lost = 1.0 - 1.0 / (1.0 + size * scene.tau**1.3)
    return spectra * (1.0 - scene.wearing * _each(lost) + 0.05 * (1.0 - scene.wearing) * _each(lost))


@loss("yellowing", "same", typical=0.2, largest=2.0, unit="nepers at 400 nm")
def yellowing(spectra: Array, scene: Scene, size: float) -> Array:
    """Transmittance exp(−a τ e^(−(λ − 400)/60))."""
    return spectra * np.exp(-size * _each(scene.tau) * np.exp(-(NM - 400.0) / 60.0))


@loss("yellowing", "other", typical=0.2, largest=2.0, unit="nepers at 400 nm")
def yellowing_edge(spectra: Array, scene: Scene, size: float) -> Array:
    """An absorption edge that shifts from the violet towards longer wavelengths with τ^1.3."""
    edge = 1.0 / (1.0 + np.exp((NM - 440.0) / 18.0))
    return spectra * np.exp(-size * _each(scene.tau**1.3) * edge)


@loss("stabilizer-headroom", "same", typical=0.2, largest=2.0, unit="nepers below the set point", classes=LCDS)
def stabilizer_headroom(spectra: Array, scene: Scene, size: float) -> Array:
    """min(L_set, L₀ D(t)): constant until the onset, then the exponential decay of the lamp."""
    return spectra * _each(np.exp(-size * np.maximum(scene.tau - scene.traits.onset, 0.0)))


@loss("stabilizer-headroom", "other", typical=0.2, largest=2.0, unit="nepers below the set point", classes=LCDS)
def stabilizer_soft_knee(spectra: Array, scene: Scene, size: float) -> Array:
    """The regulator loses control gradually, over about 1500 h; then an accelerating rational decay."""
    width = 0.08
    late = width * np.logaddexp(0.0, (scene.tau - scene.traits.onset) / width)
    new = width * np.logaddexp(0.0, -scene.traits.onset / width)
    return spectra / _each(1.0 + size * (late - new) ** 1.3)


@loss("channel-decay", "same", typical=0.2, largest=2.0, unit="nepers of blue", classes=OWN_LIGHT)
def channel_decay(spectra: Array, scene: Scene, size: float) -> Array:
    """Each channel has its own exponential."""
    return spectra * _each(np.exp(-size * scene.tau * CHANNEL_LOSS))


@loss("channel-decay", "other", typical=0.2, largest=2.0, unit="nepers of blue", classes=OWN_LIGHT)
def channel_decay_rational(spectra: Array, scene: Scene, size: float) -> Array:
    """Each channel has its own rational decay, with its own power of time."""
    power = np.array([1.3, 0.9, 1.1])
    return spectra / _each(1.0 + size * CHANNEL_LOSS * scene.tau**power)
