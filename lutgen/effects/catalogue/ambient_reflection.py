"""The screen reflects the room: a constant light of the lamp's colour lies over everything.

XYZ' = XYZ + R_d·E·lamp. R_d is the diffuse reflection coefficient in cd/m² per lx (1/sr). E is the illuminance on the
screen in lx. R_d·E is the added luminance in cd/m², so the equation has no factor π. ``lamp`` is the lamp's XYZ with
Y = 1: D65 in the simple form, a free colour in the refined forms. ``exponent`` p replaces E by 100 lx·(E/100 lx)^p, for
a light meter that is not linear. Light that dust on the screen reflects is a part of R_d.

Meaning of 0 and 1: ``reflectance`` 0 is a screen that reflects nothing. ``reflectance`` 1/sr would add 1 cd/m² for
every lx: about three times the reflection of a perfectly white matt surface (1/π).
Valid for diffuse reflection. The mirror image of a lamp depends on the position of the eye or the meter, and is not
modelled.
Sources: definition: Samei et al. (AAPM TG18), Med. Phys. 32, 1205 (2005), doi:10.1118/1.1861159. R_d of 0.025 and 0.058
1/sr on two cathode-ray tubes: Flynn & Badano, "Image quality degradation by light scattering in display devices", J.
Digit. Imaging 12, 50 (1999), doi:10.1007/BF03168843.
Assumption: R_d is as small as 0.002 1/sr on flat panels, at 4 to 150 lx.
"""

import numpy as np

from lutgen.colorimetry import D65, Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene

#: Illuminance in lx at which ``exponent`` changes nothing.
USUAL_LX = 100.0


@effect(
    stage="viewing",
    neutral={"reflectance": 0.0},
    forms=(("reflectance",), ("reflectance", "tint_x", "tint_z"), ("reflectance", "exponent", "tint_x", "tint_z")),
    needs=("ambient_lx",),
    confused_with={
        "black-level": "black under a shroud: room light disappears, a leak stays; or several levels of ambient light",
        "meter-offset": "read with the lens capped, or several levels of ambient light",
        "veiling-glare": "black at two levels of ambient light",
    },
    says="the screen reflects {reflectance:.2g} cd/m² per lux",
    source="Samei et al. 2005 (AAPM TG18), doi:10.1118/1.1861159 (definition); size on flat panels: an assumption",
    reflectance=Parameter(0.01, (0.0, 0.6), "1/sr", "luminance that the screen reflects per illuminance on it"),
    tint_x=Parameter(0.0, (-0.4, 0.6), "1", "X of the lamp relative to D65's, less 1 (incandescent: 0.16)"),
    tint_z=Parameter(0.0, (-0.95, 1.0), "1", "Z of the lamp relative to D65's, less 1 (incandescent: −0.67)"),
    exponent=Parameter(1.0, (0.5, 2.0), "1", "power of the illuminance, where the light meter is not linear"),
)
def ambient_reflection(
    xyz: Array, scene: Scene, *, reflectance: float, tint_x: float, tint_z: float, exponent: float
) -> Array:
    """Add the room light that the screen reflects."""
    light = scene.ambient_lx if exponent == 1.0 else USUAL_LX * (scene.ambient_lx / USUAL_LX) ** exponent
    return np.asarray(xyz + reflectance * light * (D65 * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z])))
