"""Simulated changes of the code value on its way to the panel. The forms differ from those of lutgen.

Each function returns simulated code values (n, 3), 0..1. The curves of the real display convert them to light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tests.generators.real.scene import Effect, Scene
    from tests.generators.real.sessions import Array


def eotf_drift(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """Mid-tones become darker because the threshold of the liquid crystal drifts: a parabola in code value; simulated.

    3 % of full drive at medium code values at 18 000 h. This changes a gamma of 2.2 by about 0.09.
    """
    shift = 0.03 * strength * scene.age ** rng.uniform(0.7, 1.2)
    return drive - shift[:, None] * 4.0 * drive * (1.0 - drive)


def channel_gamma(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """The mid-tones of one channel change: a Möbius function of its code value with fixed points 0 and 1; simulated."""
    channel = int(rng.integers(3))
    bend = np.exp(rng.choice([-1.0, 1.0]) * 0.14 * strength * scene.age)
    changed = drive.copy()
    changed[:, channel] = drive[:, channel] / (drive[:, channel] + bend * (1.0 - drive[:, channel]))
    return changed


def drive_loss(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """Contacts oxidise: the panel's input is the lower leg of a voltage divider; 4 % at 18 000 h; simulated."""
    half = rng.uniform(0.2, 0.6)
    resistance = 0.042 * strength * (1.0 + half) * scene.age / (scene.age + half)
    return drive / (1.0 + resistance[:, None] * (0.9 + 0.1 * drive))


def quantization(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """A cable or driver with fewer bits, from the second session on; simulated.

    The rounding comes after the session's own calibration curves.

    Seven bits at strength 1, because the real session already contains the rounding to eight bits.
    """
    del rng
    step = strength / 127.0
    table = scene.display.calibration
    changed = drive.copy()
    for channel in range(3):
        curve = np.maximum.accumulate(table[:, channel + 1]) + 1e-9 * np.arange(len(table))  # invertible
        sent = np.interp(drive[:, channel], table[:, 0], curve)
        rounded = np.clip(step * np.round(sent / step), curve[0], curve[-1])
        changed[:, channel] = np.interp(rounded, curve, table[:, 0])
    return np.where(scene.hours[:, None] > 0, changed, drive)


def recalibration(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """One recalibration changes the tone curve (by a sine) and the gains from one hour on; simulated."""
    hours = np.unique(scene.hours)
    event = hours[int(rng.integers(max(1, len(hours) // 3), max(2, 2 * len(hours) // 3 + 1)))]
    gains = 1.0 - 0.02 * strength * rng.random(3)
    bent = drive * gains + rng.choice([-1.0, 1.0]) * 0.025 * strength * np.sin(np.pi * drive)
    return np.where(scene.hours[:, None] >= event, np.clip(bent, 0.0, 1.0), drive)


def highlight_clip(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """The contrast is too high from the second session on: all codes above 94 % give full drive; simulated."""
    del rng
    return np.where(scene.hours[:, None] > 0, np.minimum(drive * (1.0 + 0.064 * strength), 1.0), drive)


def vivid_mode(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """A picture mode raises the saturation from one session on: channels move away from their mean; simulated."""
    hours = np.unique(scene.hours)
    event = hours[int(rng.integers(1, max(2, len(hours) // 2)))]
    mean = drive.mean(axis=1, keepdims=True)
    return np.where(scene.hours[:, None] >= event, np.clip(drive + 0.06 * strength * (drive - mean), 0, 1), drive)


def stuck_bit(scene: Scene, drive: Array, strength: float, rng: np.random.Generator) -> Array:
    """A line of the cable fails: one bit of the 8-bit code of one channel reads 0 from one session on; simulated."""
    hours = np.unique(scene.hours)
    event = hours[int(rng.integers(1, max(2, len(hours) // 2)))]
    channel, bit = int(rng.integers(3)), 8
    code = np.round(drive[:, channel] * 255.0).astype(int)
    lost = np.where((code & bit > 0) & (scene.hours >= event), strength * bit / 255.0, 0.0)
    changed = drive.copy()
    changed[:, channel] = np.clip(drive[:, channel] - lost, 0.0, 1.0)
    return changed


KINDS: dict[str, Effect] = {
    "eotf-drift": eotf_drift,
    "channel-gamma": channel_gamma,
    "drive-loss": drive_loss,
    "recalibration": recalibration,
    "quantization": quantization,
}
OUTSIDE: dict[str, Effect] = {
    "highlight-clip": highlight_clip,
    "vivid-mode": vivid_mode,
    "stuck-bit": stuck_bit,
}
