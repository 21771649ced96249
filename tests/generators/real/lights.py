"""Simulated effects on light: mixing, emission, optics, room and instrument. The forms differ from those of lutgen.

``EMITTED`` act on the light of the real display at hour 0 and age with it. ``SEEN`` act on the aged light. Each
function returns simulated XYZ (n, 3) in cd/m².
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.real.response import WAVELENGTHS, observer

if TYPE_CHECKING:
    from tests.generators.real.scene import Effect, Scene
    from tests.generators.real.sessions import Array


def crosstalk(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Neighbouring channels lose light to one another: geometric means of pairs, 2.5 % of white; simulated.

    The effect grows within some thousand hours after hour 0, because the light at hour 0 already contains the mixing of
    the real display.
    """
    light = scene.display.channels(scene.drive)
    pairs = ((0, 1), (1, 2), (0, 2))
    primaries = scene.display.primaries
    shared = np.zeros_like(xyz)
    for i, j in pairs:
        shared += np.sqrt(np.clip(light[:, [i]] * light[:, [j]], 0.0, None)) * (primaries[:, i] + primaries[:, j])
    return np.asarray(xyz - 0.0125 * strength * scene.onset(rng.uniform(800, 3000))[:, None] * shared)


def primary_shift(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Dark levels become bluish: X falls and Z rises with the square of the missing drive; Y is constant; simulated.

    The effect grows within some thousand hours after hour 0, because the light at hour 0 already contains the tint of
    the real display.
    """
    colours = rng.uniform(0.5, 1.5, 3)
    light = scene.display.channels(scene.drive)
    shifted = light * (1.0 - np.clip(light, 0.0, 1.0) ** (1 / 2.2)) ** 2 * colours * scene.display.primaries[1]
    amount = 0.12 * strength * scene.onset(rng.uniform(800, 3000)) * shifted.sum(axis=1)
    return np.asarray(xyz + amount[:, None] * np.array([-0.4, 0.0, 1.0]))


def black_level(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Closed subpixels leak more light as the polarisers age: the contrast falls exponentially, to a half; simulated.

    The added light is the real black made bluer. Only the closed subpixels add it.
    """
    closed = 1.0 - scene.display.channels(scene.drive).mean(axis=1)
    growth = np.exp(np.log(2.0) * strength * scene.age ** rng.uniform(1.0, 1.5)) - 1.0
    return np.asarray(xyz + (growth * closed)[:, None] * scene.display.black * np.array([1.0, 1.0, 1.15]))


def local_dimming(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Zones of the backlight dim under dark pictures, from the second session on (new firmware); simulated."""
    depth = 0.3 * strength * (1.0 - scene.drive.max(axis=1)) ** rng.uniform(4.0, 8.0)
    return np.asarray(xyz * np.where(scene.hours > 0, 1.0 - depth, 1.0)[:, None])


def loading(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """The supply voltage falls with the screen's power: a series resistance, 8 % at full white; simulated."""
    power = rng.dirichlet([20.0, 18.0, 24.0])
    own = scene.display.channels(scene.drive) @ power
    around = scene.display.channels(np.repeat(scene.surround[:, None], 3, axis=1)) @ power
    mean = scene.window * own + (1.0 - scene.window) * around
    return np.asarray(xyz / (1.0 + 0.087 * strength * mean)[:, None])


def edge_falloff(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Light falls off from the centre as under a lens (cos⁴): 8 % in a corner when new, 20 % later; simulated."""
    squared = ((scene.u - 0.5) ** 2 + (scene.v - 0.5) ** 2) / 0.5
    steep = strength * (0.042 + 0.075 * scene.age ** rng.uniform(0.6, 1.0))
    return np.asarray(xyz * ((1.0 + steep * squared) ** -2.0)[:, None])


def warm_up(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """A cold lamp is dimmer: a Hill function of the minutes, 12 % at power-on, relative to rest; simulated."""
    half = rng.uniform(6.0, 20.0)

    def level(minutes: Array | float) -> Array:
        return np.asarray(1.0 - 0.12 * strength / (1.0 + (np.asarray(minutes) / half) ** 1.5))

    return np.asarray(xyz * (level(scene.warmup_min) / level(scene.rest_min))[:, None])


def temperature(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Light falls with temperature, with a characteristic temperature of 250 K (0.4 %/K); simulated."""
    return np.asarray(xyz * np.exp(-strength * (scene.temperature_c - scene.rest_c) / rng.uniform(220, 300))[:, None])


def veiling_glare(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """The cover glass exchanges 1 % of the patch's light with that of the surround; simulated."""
    share = rng.uniform(0.007, 0.013) * strength * (1.0 - scene.window)[:, None]
    return np.asarray((1.0 - share) * xyz + share * scene.surround_light())


def ambient_reflection(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """An anti-reflective, purplish screen reflects the light of a lamp (Planck spectrum, 2700–5000 K); simulated.

    0.5–1.5 % of the illuminance over π at strength 1.
    """
    kelvin = rng.uniform(2700.0, 5000.0)
    metres = WAVELENGTHS * 1e-9
    coating = 1.0 + 4.0 * ((WAVELENGTHS - 550.0) / 150.0) ** 2 * 0.1
    lamp = coating / metres**5 / np.expm1(1.4388e-2 / (metres * kelvin)) @ observer()
    luminance = rng.uniform(0.005, 0.015) * strength * scene.ambient_lx / np.pi
    return np.asarray(xyz + luminance[:, None] * lamp / lamp[1])


def meter_offset(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """Dark current of the instrument: 0.02 cd/m², doubled by each 9 K; simulated.

    It adds to readings under a lens cap too.
    """
    offset = 0.02 * strength * rng.uniform(0.7, 1.3, 3)
    return np.asarray(xyz + 2.0 ** ((scene.temperature_c - scene.rest_c) / 9.0)[:, None] * offset)


EMITTED: dict[str, Effect] = {"crosstalk": crosstalk, "primary-shift": primary_shift, "black-level": black_level}
SEEN: dict[str, Effect] = {
    "loading": loading,
    "warm-up": warm_up,
    "temperature": temperature,
    "edge-falloff": edge_falloff,
    "veiling-glare": veiling_glare,
    "ambient-reflection": ambient_reflection,
}
INSTRUMENT: dict[str, Effect] = {"meter-offset": meter_offset}
OUTSIDE_EMITTED: dict[str, Effect] = {"local-dimming": local_dimming}
