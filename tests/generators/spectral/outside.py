"""Effects of real displays that no formula of the catalogue describes.

``PIXELS`` act on linear light (n, 3), ``LIGHT`` on spectra (n, wavelengths).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.laws import sign
from tests.generators.spectral.spectra import tilt

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.spectral.scene import Effect, Scene


def viewing_angle(
    linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Mid-tones become brighter towards one side of the screen, as on a TN or VA panel seen from a fixed place."""
    aside = sign(rng) * (scene.condition("u") - 0.5) + 0.4 * (scene.condition("v") - 0.5)
    return np.asarray(linear + rng.uniform(0.1, 0.2) * size * aside[:, None] * linear * (1 - np.sqrt(linear)))


def local_dimming(
    linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The zone behind a dark patch dims in eight steps of its brightest channel; a bright surround undoes this."""
    bloom = 0.5 * scene.surround[:, 0] * (1 - scene.condition("window"))
    brightest = np.maximum(linear.max(axis=1), bloom)
    duty = np.ceil(np.sqrt(brightest) * 8) / 8
    depth = min(rng.uniform(0.08, 0.18) * size, 0.9)
    return np.asarray(linear * (1 - depth * np.clip(1 - duty, 0, 1))[:, None])


def dynamic_contrast(
    linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The backlight follows the mean of the present screen and, slowly, of the preceding one."""
    mean = scene.screen.mean(axis=1)
    lagging = 0.7 * mean + 0.3 * scene.before(mean)
    darkness = 1 / (1 + np.exp((lagging - 0.25) / 0.06))
    return np.asarray(linear * (1 - rng.uniform(0.04, 0.1) * size * darkness)[:, None])


def static_dimming(
    linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A burn-in protection dims the still picture after some readings of a session, until the session ends."""
    still = scene.place() - rng.integers(30, 60)
    depth = rng.uniform(0.04, 0.1) * size
    return np.asarray(linear * (1 - depth * np.clip(still / 15, 0, 1))[:, None])


def image_retention(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A part of the preceding patch remains visible."""
    trace = rng.uniform(0.001, 0.004) * size * scene.before(scene.linear)
    return np.asarray(spectra + np.einsum("nc,ncl->nl", trace, scene.primaries))


def mura(spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Vertical bands of a dirty screen: some columns are darker and tinted, independent of their distance."""
    u = scene.condition("u") - 0.5
    wave, phase = rng.uniform(0.25, 0.6), rng.uniform(0.8, 2.4)
    stripes = np.sin(2 * np.pi * u / wave + phase) - np.sin(phase)
    return np.asarray(spectra * (1 + rng.uniform(0.015, 0.03) * size * stripes[:, None] * tilt(0.7)))


def auto_brightness(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A light sensor brightens the backlight in a lit room. This is a factor; a reflection would be a sum."""
    lit = np.log1p(scene.condition("ambient_lx") / 30) / np.log1p(500 / 30)
    return np.asarray(spectra * (1 + rng.uniform(0.08, 0.2) * size * lit)[:, None])


def flicker_aliasing(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Temporal dithering beats with the meter's shutter: a ripple along the code value, zero at 0 and at 1."""
    level = scene.plan.drive.max(axis=1)
    ripple = np.sin(np.pi * rng.integers(7, 12) * level) * (1 - level)
    return np.asarray(spectra * (1 + rng.uniform(0.02, 0.05) * size * ripple)[:, None])


def pwm_beat(spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """The backlight's pulses beat slowly with the readings: a wave along the order of reading."""
    phase = 2 * np.pi * scene.plan.order / rng.uniform(9, 25) + rng.uniform(0, 2 * np.pi)
    return np.asarray(spectra * (1 + rng.uniform(0.006, 0.012) * size * np.sin(phase))[:, None])


PIXELS: dict[str, Effect] = {
    "viewing-angle": viewing_angle,
    "local-dimming": local_dimming,
    "dynamic-contrast": dynamic_contrast,
    "static-dimming": static_dimming,
}
LIGHT: dict[str, Effect] = {
    "image-retention": image_retention,
    "mura": mura,
    "auto-brightness": auto_brightness,
    "flicker-aliasing": flicker_aliasing,
    "pwm-beat": pwm_beat,
}
