"""A quick loss in the first hundreds of hours, then a slow one: OLEDs burn in.

L = c·e^(−(t/T₁)^β) + (1 − c)·e^(−ℓ·τ), ℓ = 18 000 h/T₂ the slow loss in nepers by 18 000 h.

Meaning of 0 and 1: ``share`` 0 is slow loss alone; 1 would be a display whose whole light belongs to the quick part.
``beta`` 1 is an exponential, below 1 a stretched one.
Valid for all channels alike; unequal emitters are ``channel-decay``. Needs readings at 50 to 1000 h.
Source: a stretched exponential describes the decay of OLEDs: Féry et al., Appl. Phys. Lett. 87, 213502 (2005),
doi:10.1063/1.2133922.
Assumption: the split into two parts, c of 2 to 10 % and T₁ of 200 to 1500 h.
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
    neutral={"share": 0.0, "loss": 0.0},
    forms=(("share", "early_h"), ("share", "early_h", "loss"), ("share", "early_h", "beta", "loss")),
    refined=2,
    baseline="first-hour",
    confused_with={
        "warm-up": "hours of operation against minutes since power-on: log both",
        "backlight-decay": "readings at 50 to 1000 h",
    },
    source="Féry et al. 2005, doi:10.1063/1.2133922 (form); size: an assumption",
    share=Parameter(0.05, (0.0, 0.8), "1", "share of the light that is lost quickly"),
    early_h=Parameter(600.0, (20.0, 15_000.0), "h", "time constant of the quick loss (63 %)"),
    beta=Parameter(1.0, (0.3, 3.0), "1", "shape of the quick loss: 1 exponential, below 1 stretched"),
    loss=Parameter(0.3, (-0.3, 6.0), "1", "nepers that the rest has lost by 18 000 h"),
)
def burn_in_decay(tips: Array, scene: Scene, *, share: float, early_h: float, beta: float, loss: float) -> Array:
    """Dim all tips, quickly at first."""
    left = share * np.exp(-((scene.hours / early_h) ** beta)) + (1.0 - share) * np.exp(-loss * scene.tau)
    return np.asarray(tips * left[..., np.newaxis])
