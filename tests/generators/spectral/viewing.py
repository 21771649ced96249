"""Effects of the room, on spectra (``ROOM``), and of the instrument, on XYZ (``INSTRUMENT``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.laws import LIFE, sign
from tests.generators.spectral.spectra import lamp, tilt

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.spectral.scene import Effect, Scene

LAMPS = ("FL2", "FL7", "FL11", "LED-B3", "LED-B5")


def ambient_reflection(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The screen reflects the room's lamp. Open pixels reflect slightly more, from the reflector behind them."""
    reflectance = rng.uniform(0.005, 0.02) * size  # 1/sr
    coating = lamp(str(rng.choice(LAMPS))) * tilt(rng.uniform(-0.5, 0.5))
    share = reflectance * scene.condition("ambient_lx") * (1 + 0.15 * scene.linear.mean(axis=1))
    return np.asarray(spectra + share[:, None] * coating)


def meter_offset(xyz: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Dark current of three photodiodes, doubled by every 10 K."""
    dark = rng.uniform(0.01, 0.03) * size * rng.uniform(0.6, 1.4, size=3)
    return xyz + dark * 2 ** ((scene.condition("temperature_c")[:, None] - 25) / 10)


def meter_drift(xyz: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """The sensitivity drifts and settles: 1 + ε(1 − e^(−t/T)), typically 1.2 % at 18 000 h, different for Z."""
    time = rng.uniform(6000, 20000)
    end = sign(rng) * rng.uniform(0.008, 0.016) * size * np.array([1.0, 1.0, rng.uniform(0.9, 1.2)])
    return np.asarray(xyz * (1 + end * (np.expm1(-scene.hours / time) / np.expm1(-LIFE / time))[:, None]))


ROOM: dict[str, Effect] = {"ambient-reflection": ambient_reflection}
INSTRUMENT: dict[str, Effect] = {"meter-offset": meter_offset, "meter-drift": meter_drift}
