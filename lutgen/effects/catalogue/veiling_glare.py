"""Light scatters within the screen's glass and the meter's lens: a share of the mean light lies over every patch.

XYZ' = XYZ + g·(mean XYZ of the whole screen, patch and surround). On patches that fill the screen the glare is a
factor, which the measured white and primaries already contain. A black patch in a white surround shows the glare. Light
that dust on the screen scatters belongs to this effect. Light that dust absorbs belongs to ``backlight-decay``.

Meaning of 0 and 1: g = 0 scatters nothing. g = 1 would add the whole mean light of the screen to every patch.
Valid for light that spreads evenly over the screen. A halo near a bright edge is not modelled.
Sources: definition, and a test with a dark spot in a bright field: Samei et al. (AAPM TG18), Med. Phys. 32, 1205
(2005), doi:10.1118/1.1861159. Glare ratios of 25 and 89 on two cathode-ray tubes: Flynn & Badano, "Image quality
degradation by light scattering in display devices", J. Digit. Imaging 12, 50 (1999), doi:10.1007/BF03168843.
Assumption: the size on flat panels.
"""

import numpy as np

from lutgen.colorimetry import Array, code_to_linear
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, growth


@effect(
    stage="viewing",
    neutral={"glare": 0.0, "grown": 0.0},
    forms=(
        ("glare",),
        ("glare", "grown"),
        ("glare", "grown", "power"),
        ("glare", "reach"),
        ("glare", "tint_x", "tint_z"),
        ("glare", "grown", "reach", "tint_x", "tint_z"),
    ),
    refined=2,
    needs=("window",),
    confused_with={
        "black-level": "black in a white surround and black in a black one",
        "loading": "a black and a bright patch in a white surround: loading darkens by a factor, glare adds",
        "ambient-reflection": "black in a white and in a black surround",
    },
    says="{size} of the screen's mean light lies over every patch",
    source="Samei et al. 2005 (AAPM TG18), doi:10.1118/1.1861159 (definition); size: an assumption",
    glare=Parameter(0.005, (0.0, 0.1), "1", "share of the screen's mean light that lies over the patch, at hour 0"),
    grown=Parameter(0.002, (-0.05, 0.1), "1", "growth of that share by 18 000 h"),
    power=POWER,
    reach=Parameter(1.0, (0.1, 3.0), "1", "power of the patch's share of the screen in the weight of the patch"),
    tint_x=Parameter(0.0, (-0.5, 1.0), "1", "X that is scattered relative to Y, less 1"),
    tint_z=Parameter(0.0, (-0.5, 1.0), "1", "Z that is scattered relative to Y, less 1"),
)
def veiling_glare(
    xyz: Array, scene: Scene, *, glare: float, grown: float, power: float, reach: float, tint_x: float, tint_z: float
) -> Array:
    """Add a share of the screen's mean light."""
    patch = scene.window**reach
    mean = patch * xyz + ((1.0 - patch) * code_to_linear(scene.surround)) * scene.white
    size = growth(scene.tau, new=glare, grown=grown, power=power)
    return np.asarray(xyz + size * mean * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z]))
