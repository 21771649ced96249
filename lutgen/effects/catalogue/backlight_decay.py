"""The light source fades: all colours alike.

L = exp(−(t/T)^β), written with the loss at 18 000 h as exp(−ℓ·τ^β), so that T = 18 000 h/ℓ^(1/β). β = 1 is the
exponential of IES TM-21. A decay that slows down has a tail: L = (1 + κ·ℓ·τ^β)^(−1/κ), a log-logistic law at κ = 1,
second-order kinetics where β = 1 as well. LED lamps may first rise by 1 to 3 %: × (1 + r·(1 − e^(−t/t_r))). Dust and
dirt, and layers that absorb all wavelengths alike, take a share of the light in the same way: they are inside this
effect, and what dust scatters is in ``veiling-glare``.

Meaning of 0 and 1: ``loss`` 0 keeps the light of hour 0; ``loss`` 1 leaves 1/e, 37 %, at 18 000 h. ``beta`` 1 is an
exponential, above 1 slow first. ``tail`` 0 is the exponential of that, 1 the log-logistic law.
Valid for one light source behind the whole panel; held luminance needs ``stabilizer-headroom``.
Sources: the form for LED lamps by IES TM-21; Avanaki et al., Proc. SPIE 9420 (2015), doi:10.1117/12.2082315, whose
67 % at 10 000 h and 40 % at 18 000 h are not exponential: T = 19 150 h, β = 1.41 meets both.
Assumption: a stretched exponential, and the size of the first rise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.effects.declare import Parameter, effect

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="emission",
    neutral={"loss": 0.0, "rise": 0.0},
    forms=(("loss",), ("loss", "beta"), ("loss", "beta", "tail"), ("loss", "beta", "rise", "rise_h")),
    baseline="first-hour",
    confused_with={
        "stabilizer-headroom": "hours around the knee: held first, or falling from the start",
        "meter-drift": "a second meter or a check source",
        "drive-loss": "ramps; under a pure power law nothing separates them and the picture is the same",
    },
    source="IES TM-21 (form); Avanaki et al. 2015, doi:10.1117/12.2082315 (67 % and 40 %)",
    loss=Parameter(0.9, (-0.3, 6.0), "1", "nepers lost by 18 000 h: T = 18 000 h/loss^(1/beta)"),
    beta=Parameter(1.0, (0.3, 4.0), "1", "shape: 1 exponential, above 1 slow first"),
    tail=Parameter(0.0, (0.0, 2.0), "1", "how its rate slows down: 0 not at all, 1 log-logistic"),
    rise=Parameter(0.0, (-0.3, 0.3), "1", "share by which the light first rises"),
    rise_h=Parameter(1000.0, (50.0, 6000.0), "h", "time constant of that rise (63 %)"),
)
def backlight_decay(
    tips: Array, scene: Scene, *, loss: float, beta: float, tail: float, rise: float, rise_h: float
) -> Array:
    """Dim all tips."""
    nepers = loss * scene.tau**beta
    if tail:
        slowed = np.log1p(tail * np.maximum(nepers, 0.0)) / tail
        nepers = np.where(nepers > 0.0, slowed, nepers)
    left = np.exp(-nepers) * (1.0 - rise * np.expm1(-scene.hours / rise_h))
    return np.asarray(tips * left[..., np.newaxis])
