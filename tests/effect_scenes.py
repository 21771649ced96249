"""Scenes, signals and values for the tests of effects."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import D65, LINEAR_TO_XYZ
from lutgen.effects import Effect, Scene, catalogue
from lutgen.effects.spectra import SpectralDisplay

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: White is slightly less than the sum of its primaries, as on most displays.
TIPS = 250.0 * np.vstack([0.99 * D65, LINEAR_TO_XYZ.T])
N = 24


class Term:
    """An effect and its values, as the chain of effects takes them."""

    def __init__(self, effect: Effect, **values: float) -> None:
        self.effect, self.values = effect, effect.rest() | values


def scene_of(n: int = N, *, columns: bool = True, seed: int = 7, **given: Any) -> Scene:
    """Return n readings under every condition, or at rest if ``columns`` is false."""
    rng = np.random.default_rng(seed)
    code = rng.uniform(size=(n, 3))
    code[:7] = np.array([[0, 0, 0], [1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0.5], [0.04, 0, 1]])
    hours = rng.choice([0.0, 500.0, 9000.0, 18_000.0, 30_000.0], size=(n, 1))
    hours[:5, 0] = [0.0, 500.0, 9000.0, 18_000.0, 30_000.0]
    base = Scene(
        hours=hours,
        code=code,
        white=np.tile(TIPS[0], (n, 1)) * rng.uniform(0.5, 1.0, size=(n, 1)),
        fresh_white=TIPS[:1],
        light=light(),
    )
    if columns:
        minutes = rng.uniform(0, 240, size=(n, 1))
        minutes[3], minutes[4] = 0.0, np.inf
        conditions: dict[str, Any] = {
            "u": rng.choice([0.0, 0.1, 0.5, 1.0], size=(n, 1)),
            "v": rng.choice([0.0, 0.3, 0.5, 1.0], size=(n, 1)),
            "ambient_lx": rng.uniform(0, 150, size=(n, 1)),
            "warmup_min": minutes,
            "temperature_c": rng.uniform(5, 45, size=(n, 1)),
            "window": rng.choice([0.02, 0.1, 1.0], size=(n, 1)),
            "surround": rng.choice([0.0, 0.5, 1.0], size=(n, 1)),
            "capped": rng.choice([0.0, 1.0], size=(n, 1)),
        }
        base = replace(base, **conditions)
    return replace(base, **given)


@cache
def light() -> SpectralDisplay:
    return SpectralDisplay.of("ccfl", TIPS)


def signal_of(effect: Effect, scene: Scene, variants: tuple[int, ...] = ()) -> Array:
    """Return the signal at the effect's stage in a scene, with leading axes of variants; read-only."""
    n = len(scene.code)
    rng = np.random.default_rng(3)
    if effect.stage == "drive":
        signal = scene.code.copy()
    elif effect.stage in {"transfer", "mixing", "selection"}:
        signal = rng.uniform(size=(n, 3))
        signal[0], signal[1] = 0.0, 1.0
    elif effect.stage == "emission":
        signal = TIPS * rng.uniform(0.5, 1.0, size=(*variants, n, 4, 1))
    else:
        signal = rng.uniform(0, 250, size=(*variants, n, 3))
        signal[..., 0, :] = 0.0
    signal.flags.writeable = False
    return signal


def lively(effect: Effect) -> dict[str, float]:
    """Return values with which the effect acts.

    They are typical values. An amplitude that is typically 0 gets a tenth of its upper bound. The effect is not
    complete at hour 0.
    """
    values = {
        name: parameter.value if parameter.value or name not in effect.neutral else 0.1 * parameter.bounds[1]
        for name, parameter in effect.parameters.items()
    }
    return values | ({"onset": 0.4} if "onset" in values else {})


def one(name: str, signal: object, scene: Scene, **values: float) -> Array:
    """Apply one effect with some given values; all other values are at rest."""
    effect = catalogue()[name]
    return effect.function(np.asarray(signal, dtype=float), scene, **effect.rest() | values)


def at(hours: float = 18_000.0, code: object = (0.5, 0.5, 0.5), **columns: float) -> Scene:
    """Return a scene of one reading."""
    return Scene(
        hours=np.array([[hours]]),
        code=np.array([code], dtype=float),
        white=TIPS[:1],
        fresh_white=TIPS[:1],
        light=light(),
        **{name: np.array([[value]]) for name, value in columns.items()},
    )
