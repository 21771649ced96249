"""The meter reports light that is not there: its dark signal is added to every reading, also with the lens capped.

XYZ' = XYZ + o. In the simple form o has the colour of D65; the refined forms free X and Z. The dark current of a
silicon diode grows with its temperature T by e^(κ(T − 25 °C)), which doubles in about 10 K. The dark current may grow
with age by 1 + g·τ.

Meaning of 0 and 1: ``offset`` 0 is a meter that reads nothing in the dark. ``offset`` 1 would add 1 cd/m² to every
reading. ``grown`` 1 is a dark signal that has doubled at 18 000 h.
Valid for the dark signal of one meter over the whole campaign. Never baked: a meter adds no light to the display.
Source: the dark signal of array spectroradiometers: CIE 233:2019, "Calibration, Characterization and Use of Array
Spectroradiometers".
Assumption: the form for colorimeters, and sizes from about 0.003 cd/m² on.
"""

import numpy as np

from lutgen.colorimetry import D65, Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import REFERENCE_C, Scene


@effect(
    stage="instrument",
    neutral={"offset": 0.0, "offset_x": 0.0, "offset_z": 0.0},
    forms=(
        ("offset",),
        ("offset", "offset_x", "offset_z"),
        ("offset", "offset_x", "offset_z", "grown"),
        ("offset", "offset_x", "offset_z", "per_kelvin"),
    ),
    confused_with={"black-level": "read with the lens capped", "ambient-reflection": "read with the lens capped"},
    says="the meter adds {offset:.2g} cd/m² to every reading",
    source="CIE 233:2019 (dark signal of array spectroradiometers); form and size: an assumption",
    offset=Parameter(0.01, (-0.5, 0.5), "cd/m²", "luminance that is added, with X and Z in the ratio of D65"),
    offset_x=Parameter(0.0, (-0.5, 0.5), "cd/m²", "X that is added in addition"),
    offset_z=Parameter(0.0, (-0.5, 0.5), "cd/m²", "Z that is added in addition"),
    grown=Parameter(0.0, (-0.9, 5.0), "1", "growth of the dark signal by 18 000 h, relative to hour 0"),
    per_kelvin=Parameter(0.0, (0.0, 0.15), "1/K", "growth in nepers per kelvin; 0.069 doubles the dark signal in 10 K"),
)
def meter_offset(
    xyz: Array, scene: Scene, *, offset: float, offset_x: float, offset_z: float, grown: float, per_kelvin: float
) -> Array:
    """Add the dark signal."""
    dark = offset * D65 + np.array([offset_x, 0.0, offset_z])
    if grown:
        dark = dark * (1.0 + grown * scene.tau)
    return np.asarray(xyz + (dark * np.exp(per_kelvin * (scene.temperature_c - REFERENCE_C)) if per_kelvin else dark))
