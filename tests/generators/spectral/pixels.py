"""Effects before the light: on code values (``CODES``) and on the linear light of the channels (``MIXING``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.laws import growth, sign

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.spectral.scene import Effect, Scene


def _event(rng: np.random.Generator) -> float:
    return float(rng.uniform(4000, 13500))


def recalibration(
    code: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A technician changes the curve at one hour: a parabola in code values, 0 at black and white."""
    after = (scene.hours > _event(rng))[:, None]
    return code + after * sign(rng) * 0.07 * size * code * (1 - code)


def recalibrated_gain(
    linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """White becomes brighter or dimmer at the hour of the recalibration."""
    after = (scene.hours > _event(rng))[:, None]
    return linear * (1 + after * sign(rng) * 0.1 * size)


def quantization(code: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """A calibration table changes the codes, and the panel rounds them: to 8 bits at size 1, fewer above."""
    del scene
    steps = max(2, round(255 / size))
    bend = rng.uniform(0.8, 0.95)
    return np.asarray((np.round(code**bend * steps) / steps) ** (1 / bend))


def drive_loss(code: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """The resistance of a contact divides the voltage, slightly more at high drive: 2–5 % at 18 000 h."""
    resistance = rng.uniform(0.02, 0.05) * size * growth(scene.hours, rng)[:, None]
    return np.asarray(code / (1 + resistance * (0.8 + 0.2 * code)))


def eotf_drift(code: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """The threshold voltage of the liquid crystal drifts: half a sine over all codes, 7 % of light in the middle."""
    bow = sign(rng) * rng.uniform(0.012, 0.022) * size * growth(scene.hours, rng)[:, None]
    return np.asarray(np.maximum(code + bow * np.sin(np.pi * code), 0.0))


def channel_gamma(
    linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The light l of one channel becomes l/(l + (1 − l)e^a): 8 % near a third of its light."""
    channel = int(rng.integers(3))
    a = sign(rng) * rng.uniform(0.08, 0.16) * size * growth(scene.hours, rng)
    bent = linear.copy()
    light = linear[:, channel]
    bent[:, channel] = light / (light + (1 - light) * np.exp(a))
    return bent


def crosstalk(linear: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Neighbouring subpixels couple with saturation: a channel gains by 1 − e^(−2 Σ codes of the other channels)."""
    strength = rng.choice([1.0, 1.0, -1.0]) * rng.uniform(0.012, 0.03) * size
    unequal = rng.uniform(0.7, 1.3, size=3)
    others = scene.plan.drive.sum(axis=1, keepdims=True) - scene.plan.drive
    return np.asarray(linear * (1 + strength * unequal * -np.expm1(-2 * others)))


#: In the order in which they act on the signal.
CODES: dict[str, Effect] = {
    "recalibration": recalibration,
    "quantization": quantization,
    "drive-loss": drive_loss,
    "eotf-drift": eotf_drift,
}
MIXING: dict[str, Effect] = {
    "recalibration": recalibrated_gain,
    "channel-gamma": channel_gamma,
    "crosstalk": crosstalk,
}
