"""Somebody recalibrated: from one hour on the display answers code values differently.

d' = min(1, (1 + g)·d^(1 + Γ)) for hours t ≥ t*: a display gives no more than full drive, so a contrast that is set too
high (g > 0) clips. Γ is one number for all channels, one for each channel, or free at five levels. A fit tries one date
t* in every gap between two sessions. White and primaries that are measured again contain a step of the gain g, so that
only Γ and the clipping are visible there.

Meaning of 0 and 1: g = 0 and Γ = 0 are a calibration that changed nothing. g = 1 would double the drive. Γ = 1 would
double the exponent.
Valid for one event in a campaign. Two events need two recalibrations.
Source: quality assurance checks displays and calibrates them again: Bevins et al., "Practical application of AAPM
Report 270 in display quality assurance" (2020), doi:10.1002/mp.14227.
Assumption: the form and the size.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import bent, level_curve, level_parameters

LEVELS = level_parameters("level", "change of the exponent near code value {}")


@effect(
    stage="drive",
    neutral=dict.fromkeys(("gamma", "red", "green", "blue", "gain", *LEVELS), 0.0),
    forms=(("hour", "gamma"), ("hour", "red", "green", "blue"), ("hour", "gamma", "gain"), ("hour", *LEVELS)),
    refined=2,
    confused_with={
        "stabilizer-headroom": "a column or note of events; both change suddenly",
        "eotf-drift": "readings at more dates: a step or a slow growth",
    },
    says="somebody recalibrated the display {when}",
    source="Bevins et al. 2020, doi:10.1002/mp.14227 (event); form and size: an assumption",
    hour=Parameter(9000.0, (0.0, 100_000.0), "h", "hour of the recalibration", "gaps"),
    gamma=Parameter(0.05, (-0.6, 2.0), "1", "change of the exponent of the code value since then"),
    red=Parameter(0.0, (-0.6, 2.0), "1", "change of red's exponent in addition to gamma"),
    green=Parameter(0.0, (-0.6, 2.0), "1", "change of green's exponent in addition to gamma"),
    blue=Parameter(0.0, (-0.6, 2.0), "1", "change of blue's exponent in addition to gamma"),
    gain=Parameter(0.0, (-0.5, 0.5), "1", "relative change of all code values since then"),
    **LEVELS,
)
def recalibration(
    code: Array, scene: Scene, *,
    hour: float, gamma: float, red: float, green: float, blue: float, gain: float,
    level_00: float, level_25: float, level_50: float, level_75: float, level_100: float,
) -> Array:  # fmt: skip
    """Apply the change of exponent and gain to the code values from ``hour`` on, and clip at full drive."""
    since = (scene.hours >= hour).astype(np.float64)
    change = np.array([gamma + red, gamma + green, gamma + blue])
    knots = (level_00, level_25, level_50, level_75, level_100)
    if any(knots):
        change = change + level_curve(code, knots)
    return np.asarray(np.minimum(bent(code, since * change) * (1.0 + gain * since), np.maximum(code, 1.0)))
