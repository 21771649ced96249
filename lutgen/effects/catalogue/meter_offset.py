"""The meter reports light that is not there: its dark signal is added to every reading, also with the lens capped.

XYZ += o, constant in time: o of Y with D65's ratio of X and Z in the simple form, free X and Z in the refined one.

Meaning of 0 and 1: 0 is a meter that reads nothing in the dark; 1 would be 1 cd/m² too much in every reading.
Valid for one dark signal for the whole campaign. Never baked: it is no light of the display.
Assumption: from about 0.003 cd/m² on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import D65
from lutgen.effects.declare import Parameter, effect

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="instrument",
    neutral={"offset": 0.0, "offset_x": 0.0, "offset_z": 0.0},
    forms=(("offset",), ("offset", "offset_x", "offset_z")),
    confused_with={
        "black-level": "read with the lens capped",
        "ambient-reflection": "read with the lens capped",
    },
    says="the meter adds {offset:.2g} cd/m² to every reading",
    source="size: an assumption",
    offset=Parameter(0.01, (-0.5, 0.5), "cd/m²", "luminance that is added, with X and Z in the ratio of D65"),
    offset_x=Parameter(0.0, (-0.5, 0.5), "cd/m²", "X that is added beside that"),
    offset_z=Parameter(0.0, (-0.5, 0.5), "cd/m²", "Z that is added beside that"),
)
def meter_offset(xyz: Array, scene: Scene, *, offset: float, offset_x: float, offset_z: float) -> Array:  # noqa: ARG001 - an effect's signature
    """Add the dark signal."""
    return np.asarray(xyz + (offset * D65 + np.array([offset_x, 0.0, offset_z])))
