"""The model's own jump: the paper's ``nearest`` matrix changes at once where white becomes the nearest colour point.

This effect is not physics of the display. At the border of white the model jumps by a third of the difference between
white and the sum of its primaries, times the largest channel. The remedy: each colour receives a share of this
difference that equals the grey in the colour. The grey is the smallest channel, which is the paper's ``continuous``
selection. With ``softness`` s the grey is the power mean (⅓ Σ l^(−1/s))^(−s) of the channels.

Meaning of 0 and 1: s = 0 is the smallest channel. s = 1 is the harmonic mean of the three channels. The effect has no
amplitude: it is present or absent.
Valid for models with ``selection = "nearest"`` of a display that is not additive.
Source: Avanaki et al., Proc. SPIE 9420 (2015), doi:10.1117/12.2082315, step 5 of section 2.2.
Assumption: the power mean.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene


@effect(
    stage="selection",
    neutral={},
    forms=((), ("softness",)),
    confused_with={"crosstalk": "pairs of patches across a border between two colour points"},
    says="the model jumps between its matrices where the display does not",
    source="Avanaki et al. 2015, doi:10.1117/12.2082315, step 5",
    softness=Parameter(
        0.0, (0.0, 3.0), "1", "weight of the other channels: 0 the smallest channel alone, 1 the harmonic mean"
    ),
)
def matrix_switching(linear: Array, scene: Scene, *, softness: float) -> Array:  # noqa: ARG001 - an effect's signature
    """Return the grey in each colour: the same linear light in all three channels."""
    least = np.maximum(linear.min(axis=-1, keepdims=True), 0.0)
    if softness:
        share = least / np.where(linear > 0.0, linear, 1.0)
        # The smallest channel's own share is 1, so the mean is at least 1/3. Black's shares are 0: it needs the
        # maximum.
        mean = np.maximum((share ** (1.0 / softness)).mean(axis=-1, keepdims=True), 1.0 / 3.0)
        least = least * mean**-softness
    return np.broadcast_to(least, linear.shape)
