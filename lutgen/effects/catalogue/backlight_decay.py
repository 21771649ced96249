"""The light source fades: all colours alike.

L = exp(−(t/T)^β) = exp(−ℓ·τ^β), with τ = t/18 000 h and T = 18 000 h/ℓ^(1/β). ℓ is the loss in nepers at 18 000 h.
β = 1 is the exponential of IES TM-21. With ``tail`` κ the decay slows down: L = (1 + κ·ℓ·τ^β)^(−1/κ). κ = 1 is a
log-logistic law, and for β = 1 second-order kinetics. LED lamps may first rise by 1 to 3 %: the factor is
1 + r·(1 − e^(−t/t_r)). Dust, dirt and layers that absorb all wavelengths alike also remove a share of the light, and
belong to this effect. Light that dust scatters belongs to ``veiling-glare``.

Meaning of 0 and 1: ``loss`` 0 keeps the light of hour 0. ``loss`` 1 leaves 1/e, 37 %, at 18 000 h. ``beta`` 1 is an
exponential; above 1 the decay is slow at first. ``tail`` 0 is the stretched exponential; 1 is the log-logistic law.
Valid for one light source behind the whole panel. A display that holds its luminance needs ``stabilizer-headroom``.
Sources: form for LED lamps: IES TM-21. Avanaki et al., Proc. SPIE 9420 (2015), doi:10.1117/12.2082315: 67 % at
10 000 h and 40 % at 18 000 h, which no exponential fits; T = 19 150 h and β = 1.41 fit both.
Assumption: the stretched exponential, and the size of the first rise.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
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
    says="the light source fades",
    says_less="the light source brightens",
    source="IES TM-21 (form); Avanaki et al. 2015, doi:10.1117/12.2082315 (67 % and 40 %)",
    loss=Parameter(0.9, (-0.3, 6.0), "1", "nepers lost by 18 000 h: T = 18 000 h/loss^(1/beta)"),
    beta=Parameter(1.0, (0.3, 4.0), "1", "shape: 1 exponential, above 1 slow first"),
    tail=Parameter(0.0, (0.0, 2.0), "1", "slowing of the decay rate: 0 none, 1 log-logistic"),
    rise=Parameter(0.0, (-0.3, 0.3), "1", "share of the light by which the lamp first rises"),
    rise_h=Parameter(1000.0, (50.0, 6000.0), "h", "time constant of the first rise (63 %)"),
)
def backlight_decay(
    tips: Array, scene: Scene, *, loss: float, beta: float, tail: float, rise: float, rise_h: float
) -> Array:
    """Multiply all tips by the decay."""
    nepers = loss * scene.tau**beta
    if tail:
        slowed = np.log1p(tail * np.maximum(nepers, 0.0)) / tail
        nepers = np.where(nepers > 0.0, slowed, nepers)
    left = np.exp(-nepers) * (1.0 - rise * np.expm1(-scene.hours / rise_h))
    return np.asarray(tips * left[..., np.newaxis])
