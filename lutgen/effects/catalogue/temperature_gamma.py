"""A warmer liquid crystal answers its drive otherwise: the transfer curve bends with the temperature.

l → l^(1 + c·(T − T₀)), T₀ = 25 °C: mid-tones move, black and white stay, as in ``eotf-drift``, but with the temperature
and not with the hours. The refined form gives each channel a bend of its own.

Meaning of 0 and 1: c 0 is a curve that no temperature changes; 0.01/K adds a hundredth to the exponent a kelvin.
Valid for a few tens of kelvins about 25 °C, and for a column that follows the panel: the air in the room lags behind.
Light that changes by a factor is ``temperature``.
Source: threshold voltage and transmittance of liquid crystal displays depend on the temperature, by the switching mode:
"Temperature dependence of the electro-optic characteristics in the liquid crystal display switching modes" (2009).
Assumption: the form, and sizes of some thousandths per kelvin.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import REFERENCE_C
from lutgen.effects.shapes import bent

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="transfer",
    neutral={"slope": 0.0, "red": 0.0, "blue": 0.0},
    forms=(("slope",), ("slope", "red", "blue")),
    needs=("temperature_c",),
    confused_with={
        "eotf-drift": "the temperature column: a curve that ages stays when the panel cools",
        "temperature": "greys and ramps at two temperatures: white stays where only the curve bends",
    },
    says="the exponent of the curve changes by {slope:.2g} per kelvin",
    source="electro-optic characteristics of switching modes by temperature (2009); form and size: an assumption",
    slope=Parameter(0.003, (-0.05, 0.05), "1/K", "change of the exponent per kelvin above 25 °C"),
    red=Parameter(0.0, (-0.05, 0.05), "1/K", "change of red's exponent per kelvin, in addition"),
    blue=Parameter(0.0, (-0.05, 0.05), "1/K", "change of blue's exponent per kelvin, in addition"),
)
def temperature_gamma(linear: Array, scene: Scene, *, slope: float, red: float, blue: float) -> Array:
    """Bend the curves by the temperature."""
    return bent(linear, (scene.temperature_c - REFERENCE_C) * np.array([slope + red, slope, slope + blue]))
