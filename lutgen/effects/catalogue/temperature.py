"""A warmer display gives another amount of light: LEDs fade with the temperature of their junction.

XYZ' = XYZ·(1 + c·(T − T₀)), with T₀ = 25 °C. The refined forms give each primary its own coefficient (red LEDs fade
several times faster than blue LEDs), a quadratic term, and a colour.

Meaning of 0 and 1: c = 0 is a display whose light does not depend on the temperature. c = 1/K would double the light
with one kelvin.
Valid for a few tens of kelvins about 25 °C, and for a temperature column that follows the lamp. The air temperature of
the room lags behind the lamp.
Assumption: −0.1 to −0.6 % per kelvin.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import REFERENCE_C, Scene
from lutgen.effects.shapes import scaled


@effect(
    stage="emission",
    neutral={"slope": 0.0, "curve": 0.0, "red": 0.0, "green": 0.0, "blue": 0.0},
    forms=(
        ("slope",),
        ("slope", "curve"),
        ("red", "green", "blue"),
        ("slope", "tint_x", "tint_z"),
        ("slope", "curve", "tint_x", "tint_z"),
        ("curve", "red", "green", "blue"),
    ),
    needs=("temperature_c",),
    confused_with={
        "warm-up": "log minutes and temperature apart",
        "backlight-decay": "the temperature column: without it a warmer room looks like wear",
    },
    says="light changes by {size} per kelvin",
    source="US patent 10607551 B2 (light of LEDs linear in their temperature); size: an assumption",
    slope=Parameter(-0.003, (-0.06, 0.06), "1/K", "relative change of the light per kelvin above 25 °C"),
    curve=Parameter(0.0, (-0.002, 0.002), "1/K²", "relative change of the light per squared kelvin"),
    red=Parameter(0.0, (-0.06, 0.06), "1/K", "relative change of red per kelvin, in addition to slope"),
    green=Parameter(0.0, (-0.06, 0.06), "1/K", "relative change of green per kelvin, in addition to slope"),
    blue=Parameter(0.0, (-0.06, 0.06), "1/K", "relative change of blue per kelvin, in addition to slope"),
    tint_x=Parameter(0.0, (-3.0, 3.0), "1", "change of X over change of Y, less 1"),
    tint_z=Parameter(0.0, (-3.0, 3.0), "1", "change of Z over change of Y, less 1"),
)
def temperature(
    tips: Array, scene: Scene, *,
    slope: float, curve: float, red: float, green: float, blue: float, tint_x: float, tint_z: float,
) -> Array:  # fmt: skip
    """Multiply all tips by the factor of the temperature."""
    warmer = scene.temperature_c - REFERENCE_C
    if red or green or blue:
        tips = scaled(tips, 1.0 + warmer * np.array([red, green, blue]))
    change = (slope * warmer + curve * warmer**2) * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z])
    return np.asarray(tips * (1.0 + change)[..., np.newaxis, :])
