"""A quick loss at first, within some hundreds of hours, then a slow one: OLEDs burn in.

L = c·e^(−(t/T₁)^β) + (1 − c)·e^(−ℓ·τ). c is ``share``, T₁ is ``early_h``, and ℓ is ``loss``, the slow loss in nepers at
18 000 h. The refined form gives red, green and blue different shares c. White is the sum of its primaries.

Meaning of 0 and 1: ``share`` 0 is the slow loss alone. ``share`` 1 would be a display that loses all its light quickly.
``beta`` 1 is an exponential; below 1 is a stretched exponential.
Valid where the slow loss of all channels is equal; ``channel-decay`` has unequal slow losses. The fit needs readings at
50 to 1000 h.
Source: a stretched exponential describes the decay of OLEDs: Féry et al., Appl. Phys. Lett. 87, 213502 (2005),
doi:10.1063/1.2133922.
Assumption: the split into two parts, with c of 2 to 10 % and T₁ of 200 to 1500 h.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import scaled


@effect(
    stage="emission",
    neutral={"share": 0.0, "loss": 0.0, "red": 0.0, "blue": 0.0},
    forms=(
        ("share", "early_h"),
        ("share", "early_h", "loss"),
        ("share", "early_h", "beta", "loss"),
        ("share", "early_h", "loss", "red", "blue"),
    ),
    refined=2,
    baseline="first-hour",
    confused_with={
        "warm-up": "hours of operation against minutes since power-on: log both",
        "backlight-decay": "readings at 50 to 1000 h",
        "channel-decay": "readings at 50 to 1000 h",
    },
    source="Féry et al. 2005, doi:10.1063/1.2133922 (form); size: an assumption",
    share=Parameter(0.05, (0.0, 0.8), "1", "share of the light that is lost quickly"),
    early_h=Parameter(600.0, (20.0, 3000.0), "h", "time constant of the quick loss (63 %)"),
    beta=Parameter(1.0, (0.3, 3.0), "1", "shape of the quick loss: 1 exponential, below 1 stretched"),
    loss=Parameter(0.3, (-0.3, 6.0), "1", "nepers that the rest has lost by 18 000 h"),
    red=Parameter(0.0, (-0.8, 0.8), "1", "red's quickly lost share less green's"),
    blue=Parameter(0.0, (-0.8, 0.8), "1", "blue's quickly lost share less green's"),
)
def burn_in_decay(
    tips: Array, scene: Scene, *, share: float, early_h: float, beta: float, loss: float, red: float, blue: float
) -> Array:
    """Multiply all tips by the quick and the slow decay."""
    quick, slow = np.exp(-((scene.hours / early_h) ** beta)), np.exp(-loss * scene.tau)
    if red or blue:
        shares = np.clip(share + np.array([red, 0.0, blue]), 0.0, 1.0)
        return scaled(tips, shares * quick + (1.0 - shares) * slow)
    return np.asarray(tips * (share * quick + (1.0 - share) * slow)[..., np.newaxis])
