"""Effects on the drive, the transfer and the mixing, that is, before the light.

The other forms: contacts age with an S-curve and differ per channel; an EOTF changes by a contrast S-curve in code
values, or by a shifted toe; quantization rounds the panel's own code after its calibration LUT; cross-coupling
saturates and is stronger between neighbours; a supply droops by power, not by drive; non-additivity is a smooth
product.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_display.physics.effect import Scene, code_to_linear, effect, late, linear_to_code

if TYPE_CHECKING:
    from tests.virtual_display.spectra import Array

#: Share of the electrical power per channel: red and blue emitters need more than their share of white.
POWER_SHARE: Array = np.array([0.30, 0.30, 0.40])

#: Coupling between sub-pixels: the order on the panel is R G B, so red and blue are not neighbours.
NEIGHBOURS: Array = np.array([[0.0, 1.3, 0.5], [1.0, 0.0, 1.0], [0.5, 1.3, 0.0]])


@effect("drive-loss", "same", stage="drive", typical=0.02, largest=0.3, unit="share of drive at 18 000 h")
def drive_loss(code: Array, scene: Scene, size: float) -> Array:
    """d → (1 − ρ τ) d."""
    return code * (1.0 - size * scene.tau)


@effect("drive-loss", "other", stage="drive", typical=0.02, largest=0.3, unit="share of drive at 18 000 h")
def drive_loss_by_contacts(code: Array, scene: Scene, size: float) -> Array:
    """Contacts corrode late, by different amounts for the three source drivers."""
    return np.asarray(code / (1.0 + size * late(scene.tau) * np.array([1.0, 0.8, 1.25])))


@effect("quantization", "same", stage="drive", typical=1 / 255, largest=1 / 15, unit="step of the code")
def quantization(code: Array, scene: Scene, size: float) -> Array:
    """d → round(d N)/N, N whole."""
    del scene
    steps = max(round(1.0 / size), 1) if size else 0
    return np.round(code * steps) / steps if steps else code


@effect("quantization", "other", stage="drive", typical=1 / 255, largest=1 / 15, unit="step of the panel's code")
def quantization_of_the_panel(code: Array, scene: Scene, size: float) -> Array:
    """A calibration LUT before a panel of gamma 2.2, with biased rounding."""
    del scene
    steps = max(round(1.0 / size), 1) if size else 0
    if not steps:
        return code
    native = code_to_linear(code) ** (1.0 / 2.2)
    return linear_to_code((np.floor(native * steps + 0.4) / steps) ** 2.2)


@effect("recalibration", "same", stage="transfer", typical=0.05, largest=0.5, unit="exponent")
def recalibration(linear: Array, scene: Scene, size: float) -> Array:
    """A step of the exponent at an hour t*."""
    return linear ** (1.0 + scene.traits.sign * size * (scene.tau >= scene.traits.onset))


@effect("recalibration", "other", stage="transfer", typical=0.1, largest=1.0, unit="share of the new curve")
def recalibration_to_lightness(linear: Array, scene: Scene, size: float) -> Array:
    """A recalibration to equal steps of lightness (CIE L*) instead of sRGB."""
    code = linear_to_code(linear)
    lightness = np.where(code <= 0.08, code / 9.033, ((code + 0.16) / 1.16) ** 3)
    return np.where(scene.tau >= scene.traits.onset, (1.0 - size) * linear + size * lightness, linear)


@effect("eotf-drift", "same", stage="transfer", typical=0.05, largest=0.5, unit="exponent at 18 000 h")
def eotf_drift(linear: Array, scene: Scene, size: float) -> Array:
    """l → l^(1 + δ τ)."""
    return linear ** (1.0 + scene.traits.sign * size * scene.tau)


@effect("eotf-drift", "other", stage="transfer", typical=0.05, largest=0.5, unit="share of the S-curve at 18 000 h")
def eotf_s_curve(linear: Array, scene: Scene, size: float) -> Array:
    """The code changes by a contrast S-curve, d + s d (1 − d)(d − 0.4)·4, with τ^1.3."""
    code = linear_to_code(linear)
    bend = 4.0 * code * (1.0 - code) * (code - 0.4)
    return code_to_linear(code + scene.traits.sign * size * scene.tau**1.3 * bend)


@effect("channel-gamma", "same", stage="transfer", typical=0.05, largest=0.5, unit="exponent at 18 000 h")
def channel_gamma(linear: Array, scene: Scene, size: float) -> Array:
    """l → l^(1 + δ τ) in one channel."""
    power = np.eye(3)[scene.traits.channel] * scene.traits.sign * size * scene.tau
    return np.asarray(linear ** (1.0 + power))


@effect("channel-gamma", "other", stage="transfer", typical=0.05, largest=0.5, unit="share of the bend at 18 000 h")
def channel_bend(linear: Array, scene: Scene, size: float) -> Array:
    """One channel's light falls between its ends, l − s l (1 − √l), late in life."""
    sag = linear * (1.0 - np.sqrt(linear)) * np.eye(3)[scene.traits.channel]
    return np.asarray(linear - 1.5 * scene.traits.sign * size * late(scene.tau) * sag)


@effect("crosstalk", "same", stage="mixing", typical=0.02, unit="share of light per full neighbour")
def crosstalk(linear: Array, scene: Scene, size: float) -> Array:
    """l_c → l_c (1 − χ Σ l_j) over the other channels."""
    del scene
    others = linear @ (1.0 - np.eye(3))
    return linear * (1.0 - size * others)


@effect("crosstalk", "other", stage="mixing", typical=0.02, unit="share of light per full neighbour")
def crosstalk_of_neighbours(linear: Array, scene: Scene, size: float) -> Array:
    """Coupling that saturates, is stronger between neighbours, and grows slightly with age."""
    pull = linear**0.85 @ NEIGHBOURS.T
    return linear / (1.0 + size * (1.0 + 0.3 * scene.tau) * pull)


@effect("loading", "same", stage="mixing", typical=0.05, largest=0.5, unit="share of light at full white")
def loading(linear: Array, scene: Scene, size: float) -> Array:
    """The mean light of the whole screen, with equal weights of the channels, dims all light proportionally."""
    mean: Array = scene.screen_light.mean(axis=1, keepdims=True)
    return linear * (1.0 - size * mean)


@effect("loading", "other", stage="mixing", typical=0.05, largest=1.0, unit="droop at full white")
def loading_by_power(linear: Array, scene: Scene, size: float) -> Array:
    """A limiter that depends on power: 1/(1 + ξ p^1.5)."""
    power = np.maximum(scene.screen_light @ POWER_SHARE, 0.0)[:, np.newaxis]
    return linear / (1.0 + size * power**1.5)


@effect("matrix-switching", "same", stage="mixing", typical=0.03, unit="share of white beside the primaries' sum")
def non_additive(linear: Array, scene: Scene, size: float) -> Array:
    """White is more than the sum of the primaries: the extra light is proportional to the smallest channel."""
    del scene
    least: Array = linear.min(axis=1, keepdims=True)
    return linear + size * least


@effect("matrix-switching", "other", stage="mixing", typical=0.03, unit="share of white beside the primaries' sum")
def non_additive_product(linear: Array, scene: Scene, size: float) -> Array:
    """The extra light is a smooth product, 3rgb/(rg + gb + br), the harmonic mean, instead of the smallest channel."""
    del scene
    r, g, b = linear.T
    pairs = r * g + g * b + b * r
    extra = 3.0 * r * g * b / np.where(pairs > 0.0, pairs, 1.0)
    return np.asarray(linear + size * extra[:, np.newaxis])
