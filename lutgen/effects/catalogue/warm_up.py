"""A cold display is darker: its lamp needs minutes to reach its light.

XYZ' = XYZ·(1 − a·e^(−m/τ_w)), with m the minutes since power-on. The pressure of mercury in a fluorescent lamp depends
on its temperature. LEDs are brighter when cold: a < 0. The refined forms replace the exponential by a long tail,
(1 + q·m/τ_w)^(−1/q), which is 1/(1 + m/τ_w) for q = 1; raise m/τ_w to a power; and free the colour.

Meaning of 0 and 1: a = 0 is a display that is warm at once. a = 1 would be a display that is dark at power-on.
Valid for a display that was off long enough to be cold, and whose luminance no sensor holds.
Source: luminance of displays during 70 minutes after power-on: Bird, "Display Warm Up Rates" (SpectraCal, 2010),
https://kb.portrait.com/help/display-warm-up-rates.
Assumption: the form, and 2 to 20 % within 30 to 100 minutes.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import growth

#: Smallest tail that is computed as a tail; below it the exponential gives the same printed digits.
LEAST_TAIL = 1e-7


@effect(
    stage="emission",
    neutral={"amount": 0.0, "grown": 0.0},
    forms=(
        ("amount", "minutes"),
        ("amount", "minutes", "tail"),
        ("amount", "minutes", "tail", "stretch"),
        ("amount", "grown", "minutes"),
        ("amount", "minutes", "tint_x", "tint_z"),
        ("amount", "grown", "minutes", "tail", "tint_x", "tint_z"),
        ("amount", "grown", "minutes", "tail", "stretch", "tint_x", "tint_z"),
    ),
    needs=("warmup_min",),
    confused_with={
        "temperature": "log minutes and temperature apart, and read the first patch again at the end",
        "burn-in-decay": "hours of operation against minutes since power-on",
    },
    says="a cold display lacks {size} of its light",
    says_less="a cold display gives {size} more light",
    source="Bird, Display Warm Up Rates, SpectraCal 2010 (effect); form and size: an assumption",
    amount=Parameter(0.08, (-0.5, 0.9), "1", "share of the warm display's light that is missing at power-on"),
    grown=Parameter(0.0, (-0.5, 0.5), "1", "growth of that share by 18 000 h"),
    minutes=Parameter(30.0, (1.0, 300.0), "min", "time constant (63 %)"),
    tail=Parameter(0.0, (0.0, 3.0), "1", "length of the tail: 0 exponential, 1 rational"),
    stretch=Parameter(1.0, (0.4, 2.5), "1", "power of the time: above 1 the warm-up starts slowly"),
    tint_x=Parameter(0.0, (-2.0, 2.0), "1", "missing share of X over missing share of Y, less 1"),
    tint_z=Parameter(0.0, (-2.0, 2.0), "1", "missing share of Z over missing share of Y, less 1"),
)
def warm_up(
    tips: Array, scene: Scene, *,
    amount: float, grown: float, minutes: float, tail: float, stretch: float, tint_x: float, tint_z: float,
) -> Array:  # fmt: skip
    """Remove the share of the light that the cold lamp does not give yet."""
    age = np.maximum(scene.warmup_min, 0.0) / minutes
    if stretch != 1.0:
        age = age**stretch
    cold = np.exp(-age) if tail < LEAST_TAIL else np.exp(-np.log1p(tail * age) / tail)
    missing = growth(scene.tau, new=amount, grown=grown, power=1.0) * cold
    factor = 1.0 - missing * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z])
    return np.asarray(tips * factor[..., np.newaxis, :])
