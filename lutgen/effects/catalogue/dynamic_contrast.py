"""The backlight follows the picture: a dark screen is lit less than a bright one.

P → P·B(m)/B(d)^h for white and all primaries, B(m) = 1 − a·(1 − m)^p the backlight behind a screen of mean code
value m, patch and surround, and d the mean of the patch itself. A curve that was measured on patches that fill the
screen holds what they show already, h = 1; a curve that is taken for granted, as sRGB's, holds nothing of it, h = 0.
Dynamic contrast dims the whole backlight; local dimming does so zone by zone, and is seen here as far as a patch and
its surround share a zone.

Meaning of 0 and 1: a 0 is a steady backlight; a 1 puts it out behind a black screen. Behind a white screen it is full.
Valid for still patches, after the dimming has settled; where the zones lie is not part of it. A LUT cannot carry it. A
supply that droops under a bright screen is ``loading``.
Source: local dimming and what it does to contrast: Hoffman, Stepien & Xiong, J. Soc. Inf. Disp. 24 (2016),
doi:10.1002/jsid.416.
Assumption: the form, and the size.
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
    neutral={"depth": 0.0},
    forms=(("depth",), ("depth", "exponent"), ("depth", "held"), ("depth", "held", "exponent")),
    needs=("window",),
    confused_with={
        "loading": "a dark patch in a bright surround: dimming makes it brighter than on a dark screen, loading darker",
        "veiling-glare": "a black and a mid-grey patch in both surrounds: glare adds, dimming is a factor",
    },
    says="a black screen is lit by {depth:.2g} less than a white one, as a share",
    source="Hoffman, Stepien & Xiong 2016, doi:10.1002/jsid.416 (effect); form and size: an assumption",
    depth=Parameter(0.2, (0.0, 0.99), "1", "share of the backlight that is missing behind a black screen"),
    exponent=Parameter(1.0, (0.3, 8.0), "1", "power of the darkness of the screen; large: nearly black screens alone"),
    held=Parameter(1.0, (0.0, 1.0), "1", "share of a full-screen patch's dimming that its curve holds"),
)
def dynamic_contrast(tips: Array, scene: Scene, *, depth: float, exponent: float, held: float) -> Array:
    """Light the screen by its mean, beside what the curve holds of it."""
    behind, alone = (
        1.0 - depth * np.clip(1.0 - mean, 0.0, 1.0) ** exponent
        for mean in (scene.mean_drive, scene.code.mean(axis=-1, keepdims=True))
    )
    return np.asarray(tips * (behind / alone**held)[..., np.newaxis])
