"""The transfer curve drifts: mid-tones of all channels brighten or darken, black and white stay.

l' = l^(1 + Γ), with Γ = ``new`` + ``grown``·τ^p. In the refined forms Γ is linear in the code value (an S-curve), or
free at five levels. The voltage curve of liquid-crystal cells changes with age, and the table that linearises the curve
does not follow.

Meaning of 0 and 1: Γ = 0 keeps the curve. Γ = 1 squares the light: a gamma of 2.2 becomes 4.4.
Valid for smooth drifts that are equal in all channels. The drift of one channel is ``channel-gamma``.
Assumption: the mechanism, and changes of the gamma of 0.02 to 0.2.
"""

from lutgen.colorimetry import Array, linear_to_code
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import (
    GROWING,
    POWER,
    SATURATION,
    bent,
    growth,
    level_curve,
    level_parameters,
    share_of_final,
)

LEVELS = level_parameters("level", "change of the exponent near code value {}, at 18 000 h")


@effect(
    stage="transfer",
    neutral=dict.fromkeys(("new", "grown", "slope_new", "slope_grown", *LEVELS), 0.0),
    forms=(
        ("grown",),
        ("new",),
        ("new", "grown"),
        ("new", "grown", "power"),
        ("new", "slope_new"),
        ("grown", "slope_grown"),
        ("new", "grown", "slope_new", "slope_grown", "power"),
        (*LEVELS, "power"),
        (*LEVELS, "onset", "power"),
        (*LEVELS, "onset", "power", "saturation"),
    ),
    refined=3,
    confused_with={
        "primary-shift": "neutral and single-channel ramps of at least five levels: a gamma keeps the chromaticity",
        "recalibration": "neutral ramps at more dates: a step or a slow growth",
        "channel-gamma": "ramps of red, green and blue",
        "drive-loss": "ramps: a loss of drive hardly bends the curve",
    },
    says="the exponent of the transfer curve changes by {size}",
    source="mechanism and size: an assumption",
    new=Parameter(0.05, (-0.6, 2.0), "1", "change of the exponent at hour 0", beside_first=0.0),
    grown=Parameter(0.05, (-0.6, 2.0), "1", "further change of the exponent by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    slope_new=Parameter(
        0.0, (-0.6, 0.6), "1", "change of the exponent at code 1 less that at code ½, at hour 0", beside_first=0.0
    ),
    slope_grown=Parameter(0.0, (-0.6, 0.6), "1", "growth of that difference by 18 000 h"),
    onset=GROWING,
    **LEVELS,
)
def eotf_drift(
    linear: Array, scene: Scene, *,
    new: float, grown: float, power: float, saturation: float, slope_new: float, slope_grown: float, onset: float,
    level_00: float, level_25: float, level_50: float, level_75: float, level_100: float,
) -> Array:  # fmt: skip
    """Raise the light of every channel to a power that may depend on its level."""
    change = growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation)
    knots = (level_00, level_25, level_50, level_75, level_100)
    if any(knots) or slope_new or slope_grown:
        code = linear_to_code(linear)
        slope = growth(scene.tau, new=slope_new, grown=slope_grown, power=power, saturation=saturation)
        change = change + slope * (2.0 * code - 1.0)
        if any(knots):
            share = share_of_final(scene.tau, onset=onset, power=power, saturation=saturation)
            change = change + share * level_curve(code, knots)
    return bent(linear, change)
