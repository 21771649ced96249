"""The meter's sensitivity drifts, and every display that it reads seems to drift.

XYZ' = XYZ·(1 + ε·τ^p). ε is the drift at 18 000 h, which is about two years of continuous operation. The filters of a
colorimeter may drift by different amounts: the refined forms free X and Z. Filters whose wavelengths shift are
``meter-mismatch``.

Meaning of 0 and 1: ε = 0 is a steady meter. ε = 1 would be a meter that reports twice the light at 18 000 h.
Valid for drifts of at most 6 % that grow early or steadily, of one meter over the whole campaign. A second meter, or a
new calibration of the meter, causes a step and no drift.
Never baked: a meter adds no light to the display.
Source: luminance meters built into displays do not stay constant: Silosky & Marsh, "Constancy of built-in luminance
meter measurements in diagnostic displays", Med. Phys. 40, 121902 (2013).
Assumption: 0.2 to 1 % a year, so 0.4 to 2 % at 18 000 h.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene


@effect(
    stage="instrument",
    neutral={"drift": 0.0, "drift_x": 0.0, "drift_z": 0.0},
    forms=(("drift",), ("drift", "power"), ("drift", "drift_x", "drift_z"), ("drift", "drift_x", "drift_z", "power")),
    baseline="first-hour",
    confused_with={
        "backlight-decay": "a second meter or a check source",
        "yellowing": "a second meter or a check source",
        "phosphor-wear": "a second meter or a check source",
        "meter-mismatch": "a check source",
    },
    says="the meter's readings change by {size} in 18 000 h",
    source="Silosky & Marsh 2013, Med. Phys. 40, 121902 (effect); size: an assumption",
    drift=Parameter(0.01, (-0.06, 0.06), "1", "relative change of all readings by 18 000 h"),
    drift_x=Parameter(0.0, (-0.06, 0.06), "1", "relative change of X in addition, by 18 000 h"),
    drift_z=Parameter(0.0, (-0.06, 0.06), "1", "relative change of Z in addition, by 18 000 h"),
    power=Parameter(1.0, (0.3, 2.0), "1", "power of time in the drift: below 1 filters bleach early, at 1 steadily"),
)
def meter_drift(xyz: Array, scene: Scene, *, drift: float, drift_x: float, drift_z: float, power: float) -> Array:
    """Multiply the readings by the drift."""
    return np.asarray(xyz * (1.0 + scene.tau**power * np.array([drift + drift_x, drift, drift + drift_z])))
