"""Simulated effects on the aged light that no formula of the catalogue describes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from tests.generators.real.sessions import uniformity

if TYPE_CHECKING:
    from tests.generators.real.scene import Effect, Scene
    from tests.generators.real.sessions import Array


def uneven_screen(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """The uneven, tinted field of one real K2721UG, mirrored at random, grows over the life; simulated.

    The field is measured. That this display has the field, and that the field grows, is simulated.
    """
    field = uniformity()[:: rng.choice([-1, 1]), :: rng.choice([-1, 1])]
    places = np.array([1 / 6, 1 / 2, 5 / 6])  # centres of a 3 x 3 grid
    pattern = RegularGridInterpolator((places, places), field, bounds_error=False, fill_value=None)
    amount = 1.5 * strength * scene.age**0.7
    return np.asarray(xyz * (1.0 + amount[:, None] * (pattern(np.column_stack([scene.v, scene.u])) - 1.0)))


def image_retention(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """A share of the preceding picture remains (0.6 % after a life); simulated.

    The effect depends on the order of reading alone.
    """
    share = 0.006 * strength * scene.age ** rng.uniform(0.5, 1.0)
    before = np.empty_like(xyz)
    for hour in np.unique(scene.hours):
        here = np.flatnonzero(scene.hours == hour)
        here = here[np.argsort(scene.order[here], kind="stable")]
        before[here] = xyz[np.concatenate([here[:1], here[:-1]])]
    return np.asarray(xyz + share[:, None] * (before - xyz))


def flicker_beat(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """The lamp's pulse width beats with the instrument's integration time: a 1 % wave over the readings; simulated."""
    wave = np.sin(2.0 * np.pi * (scene.order / rng.uniform(9.0, 40.0) + rng.random()))
    return np.asarray(xyz * (1.0 + 0.01 * strength * wave * (scene.hours > 0))[:, None])


def automatic_brightness(scene: Scene, xyz: Array, strength: float, rng: np.random.Generator) -> Array:
    """The display changes its brightness in steps of up to 5 % within a session when the room changes; simulated.

    Some real sessions show this effect; BASES excludes those sessions.
    """
    level = np.ones(len(xyz))
    for hour in np.unique(scene.hours)[1:]:
        here = scene.hours == hour
        steps = 0.05 * strength * rng.uniform(-1.0, 1.0, 3)
        for start, step in zip(np.sort(rng.random(3)), steps, strict=True):
            late = here & (scene.order > np.quantile(scene.order[here], start))
            level[late] *= 1.0 + step
    return np.asarray(xyz * level[:, None])


KINDS: dict[str, Effect] = {
    "uneven-screen": uneven_screen,
    "image-retention": image_retention,
    "flicker-beat": flicker_beat,
    "automatic-brightness": automatic_brightness,
}
