"""Black leaks light: a share of the backlight passes the panel at code 0, and more of it as the panel ages.

XYZ' = XYZ + κ(τ)·q·W(t). W(t) is the white at that hour. q is the leak's colour relative to white, slightly blue in
LCDs. κ(τ) is the sum of ``new`` and ``grown`` times a power of τ.

Meaning of 0 and 1: κ = 0 is a panel that blocks all light (an OLED). κ = 1 would be black as bright as white. 1/κ is
the contrast ratio of the display in a dark room.
Valid for a leak that is proportional to the backlight. Local dimming darkens black with the picture, and is not
modelled.
Sources: a constant light under all colours as a term of an LCD's model: Day, Taplin & Berns, Color Res. Appl. 29, 365
(2004), doi:10.1002/col.20046; Yoshida & Yamamoto (2003), doi:10.1002/ecjc.10074. Size when new: 0.43 to 0.87 cd/m² of
black and 263 to 715 cd/m² of white on five medical LCDs, in "Luminance and contrast performance of liquid crystal
displays for mammographic applications", whose abstract is at
https://researcher.watson.ibm.com/publications/luminance-and-contrast-performance-of-liquid-crystal-displays-for-mammographic-applications.
Assumption: the leak grows by a factor of 1.2 to 3 over the life of a display.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, SATURATION, growth


@effect(
    stage="optics",
    neutral={"new": 0.0, "grown": 0.0},
    forms=(
        ("grown",),
        ("new",),
        ("new", "grown"),
        ("new", "grown", "power"),
        ("new", "tint_x", "tint_z"),
        ("new", "grown", "tint_x", "tint_z"),
        ("new", "grown", "power", "tint_x", "tint_z"),
        ("new", "grown", "power", "saturation", "tint_x", "tint_z"),
    ),
    refined=3,
    confused_with={
        "ambient-reflection": "black under a shroud: room light disappears, a leak stays",
        "veiling-glare": "black on black beside black on white",
        "meter-offset": "read with the lens capped, and on a second date: a leak follows the backlight",
    },
    says="black leaks {size} of white",
    says_less="black leaks less, by {size} of white",
    source="Day, Taplin & Berns 2004, doi:10.1002/col.20046 (form); size of growth: an assumption",
    new=Parameter(0.0015, (0.0, 0.03), "1", "share of white's light that passes at black, at hour 0", beside_first=0.0),
    grown=Parameter(0.0015, (-0.03, 0.06), "1", "growth of that share by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    tint_x=Parameter(0.0, (-0.5, 0.5), "1", "X of the leak relative to white's, less 1"),
    tint_z=Parameter(0.0, (-0.5, 1.0), "1", "Z of the leak relative to white's, less 1"),
)
def black_level(
    xyz: Array, scene: Scene, *, new: float, grown: float, power: float, saturation: float, tint_x: float, tint_z: float
) -> Array:
    """Add the leak to every colour."""
    colour = scene.white * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z])
    share = growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation)
    return np.asarray(xyz + share * colour)
