"""A primary changes colour as it darkens: dark greys of TN and IPS panels are bluish.

P_c(d) = P_c(1) + (1 − d_c^b)^e·k_c. k_c adds X and Z in units of the primary's X + Y + Z and leaves Y unchanged: a
shift of the chromaticity at constant luminance. The simple forms have b = e = 1; the refined forms free them. The
retardation of a liquid-crystal cell depends on the wavelength, so the spectrum of its transmittance changes with the
voltage. White shifts by the sum of its primaries' shifts.

Meaning of 0 and 1: k = 0 is a primary with one chromaticity at all levels. k = 1 would add as much X (or Z) near black
as the full primary has X, Y and Z together.
Valid for a view from straight ahead, after the black level is subtracted. A leak moves chromaticities towards its own
colour.
Sources: primary shift and crosstalk as the two departures of an LCD from additivity: Feng & Yoshida, Proc. CGIV 2008,
327, doi:10.2352/CGIV.2008.4.1.art00071. Measurements of nine medical displays: Cheng, Wu & Badano, Proc. CIC 21, 143
(2013), doi:10.2352/CIC.2013.21.1.art00025.
Assumption: the form and the size.
"""

from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import LASTING, POWER, SATURATION, share_of_final

SHIFTS = ("red_x", "red_z", "green_x", "green_z", "blue_x", "blue_z")


def _shift(primary: str, axis: str) -> Any:
    text = f"{axis.upper()} that {primary} gains towards black, per its X + Y + Z, at 18 000 h"
    return Parameter(0.01, (-0.25, 0.25), "1", text)


@effect(
    stage="emission",
    neutral=dict.fromkeys(SHIFTS, 0.0),
    forms=(
        ("blue_x", "blue_z"),
        ("green_x", "green_z"),
        ("red_x", "red_z"),
        ("green_x", "green_z", "blue_x", "blue_z"),
        SHIFTS,
        ("blue_x", "blue_z", "onset", "level", "bend"),
        ("green_x", "green_z", "onset", "level", "bend"),
        ("red_x", "red_z", "onset", "level", "bend"),
        (*SHIFTS, "level", "bend"),
        (*SHIFTS, "onset", "power", "saturation", "level", "bend"),
    ),
    refined=5,
    confused_with={
        "channel-gamma": "ramps of red, green and blue, in x and y: a gamma keeps their chromaticity",
        "eotf-drift": "ramps of red, green and blue, in x and y",
        "black-level": "ramps: a leak has one colour for all of them; fit it first",
    },
    says="the chromaticity of {channels} shifts in dark tones",
    source="Feng & Yoshida 2008, doi:10.2352/CGIV.2008.4.1.art00071 (effect); size: an assumption",
    **{name: _shift(*name.split("_")) for name in SHIFTS},
    level=Parameter(1.0, (0.3, 6.0), "1", "power of 1 − d with which the shift grows towards black"),
    bend=Parameter(1.0, (0.3, 4.0), "1", "power of d in 1 − d^bend; 2.2 for the light"),
    onset=LASTING,
    power=POWER,
    saturation=SATURATION,
)
def primary_shift(
    tips: Array, scene: Scene, *,
    red_x: float, red_z: float, green_x: float, green_z: float, blue_x: float, blue_z: float,
    level: float, bend: float, onset: float, power: float, saturation: float,
) -> Array:  # fmt: skip
    """Shift each primary by the distance of its code value from 1."""
    code = np.clip(scene.code, 0.0, 1.0)
    away = 1.0 - (code if bend == 1.0 else code**bend)
    if level != 1.0:
        away **= level
    size = share_of_final(scene.tau, onset=onset, power=power, saturation=saturation) * away
    direction = np.array([[red_x, 0.0, red_z], [green_x, 0.0, green_z], [blue_x, 0.0, blue_z]])
    primaries = tips[..., 1:, :]
    shift = (size[..., np.newaxis] * primaries.sum(axis=-1, keepdims=True)) * direction
    whole = shift[..., 0, :] + shift[..., 1, :] + shift[..., 2, :]
    return np.concatenate([(tips[..., 0, :] + whole)[..., np.newaxis, :], primaries + shift], axis=-2)
