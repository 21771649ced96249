"""The backlight follows the picture: a dark screen is lit less than a bright one.

P' = P·B(m)/B(d)^h for white and all primaries, with B(m) = 1 − a·(1 − m)^p, the backlight behind a screen of mean code
value m. m is the mean over patch and surround; d is the mean of the patch alone. A curve measured on patches that fill
the screen contains their dimming: h = 1. A curve that is assumed, such as sRGB's, does not: h = 0. The refined forms
average another power of the code values, such as their light, with a weight for each channel, as in luma, or take the
brightest channel of each patch. Dynamic contrast dims the whole backlight. Local dimming dims zone by zone; the model
describes local dimming where a patch and its surround share a zone.

Meaning of 0 and 1: a = 0 is a steady backlight. a = 1 switches the backlight off behind a black screen. Behind a white
screen the backlight is full.
Valid for still patches, after the dimming has settled. The position of the zones is not modelled. A LUT cannot carry
this effect. A supply that droops under a bright screen is ``loading``.
Source: local dimming and its influence on contrast: Hoffman, Stepien & Xiong, J. Soc. Inf. Disp. 24 (2016),
doi:10.1002/jsid.416.
Assumption: the form and the size.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import over_screen


@effect(
    stage="emission",
    neutral={"depth": 0.0},
    forms=(
        ("depth",),
        ("depth", "exponent"),
        ("depth", "held"),
        ("depth", "held", "exponent"),
        ("depth", "held", "exponent", "average"),
        ("depth", "held", "exponent", "brightest"),
        ("depth", "held", "exponent", "average", "weight_red", "weight_blue"),
    ),
    needs=("window",),
    confused_with={
        "loading": "a dark patch in a bright surround: dimming makes it brighter than on a dark screen, loading darker",
        "veiling-glare": "a black and a mid-grey patch in both surrounds: glare adds, dimming is a factor",
    },
    says="a black picture dims the light source by {size}",
    source="Hoffman, Stepien & Xiong 2016, doi:10.1002/jsid.416 (effect); form and size: an assumption",
    depth=Parameter(0.2, (0.0, 0.99), "1", "share of the backlight that is missing behind a black screen"),
    exponent=Parameter(
        1.0, (0.3, 8.0), "1", "power of the darkness of the screen; large: only nearly black screens dim"
    ),
    held=Parameter(1.0, (0.0, 1.0), "1", "share of a full-screen patch's dimming that the curve contains"),
    average=Parameter(1.0, (0.3, 4.0), "1", "power of the code values that is averaged; 2.2 for their light"),
    weight_red=Parameter(0.0, (-0.9, 3.0), "1", "weight of red in the mean relative to green's, less 1"),
    weight_blue=Parameter(0.0, (-0.9, 3.0), "1", "weight of blue in the mean relative to green's, less 1"),
    brightest=Parameter(0.0, (0.0, 1.0), "1", "share of the brightest channel in place of the mean of the three"),
)
def dynamic_contrast(
    tips: Array, scene: Scene, *, depth: float, exponent: float, held: float, average: float,
    weight_red: float, weight_blue: float, brightest: float,
) -> Array:  # fmt: skip
    """Multiply all tips by the backlight behind the screen; divide by the dimming that the curve contains."""
    means = over_screen(scene, average, weight_red=weight_red, weight_blue=weight_blue, brightest=brightest)
    behind, alone = (1.0 - depth * np.clip(1.0 - mean, 0.0, 1.0) ** exponent for mean in means)
    return np.asarray(tips * (behind / alone**held)[..., np.newaxis])
