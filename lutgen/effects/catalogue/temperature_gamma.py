"""A warmer liquid crystal answers its drive otherwise: the transfer curve bends with the temperature.

l' = l^(1 + c·(T − T₀)), with T₀ = 25 °C. Mid-tones change; black and white stay, as in ``eotf-drift``. The change
depends on the temperature, not on the hours. In the refined forms c is linear in the code value, or each channel has
its own c.

Meaning of 0 and 1: c = 0 is a curve that does not depend on the temperature. c = 0.01/K adds 0.01 to the factor of the
exponent for each kelvin.
Valid for a few tens of kelvins about 25 °C, and for a temperature column that follows the panel. The air temperature of
the room lags behind the panel. Light that changes by a factor is ``temperature``.
Source: threshold voltage and transmittance of liquid crystal displays depend on the temperature, by the switching mode:
"Temperature dependence of the electro-optic characteristics in the liquid crystal display switching modes" (2009),
whose abstract is at https://acemap.info/paper/154422966. Of IPS, PVA and FFS, the mode FFS depends on it least.
Assumption: the form, and sizes of some thousandths per kelvin.
"""

import numpy as np

from lutgen.colorimetry import Array, linear_to_code
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import REFERENCE_C, Scene
from lutgen.effects.shapes import bent


@effect(
    stage="transfer",
    neutral={"slope": 0.0, "tilt": 0.0, "red": 0.0, "blue": 0.0},
    forms=(("slope",), ("slope", "tilt"), ("slope", "red", "blue"), ("slope", "tilt", "red", "blue")),
    needs=("temperature_c",),
    confused_with={
        "eotf-drift": "the temperature column: a curve that ages stays when the panel cools",
        "temperature": "greys and ramps at two temperatures: white stays where only the curve bends",
    },
    says="the exponent of the curve changes by {size} per kelvin",
    source="electro-optic characteristics of switching modes by temperature (2009); form and size: an assumption",
    slope=Parameter(0.003, (-0.05, 0.05), "1/K", "change of the exponent per kelvin above 25 °C"),
    tilt=Parameter(0.0, (-0.05, 0.05), "1/K", "change of the exponent per kelvin at code 1 less that at code ½"),
    red=Parameter(0.0, (-0.05, 0.05), "1/K", "change of red's exponent per kelvin, in addition"),
    blue=Parameter(0.0, (-0.05, 0.05), "1/K", "change of blue's exponent per kelvin, in addition"),
)
def temperature_gamma(linear: Array, scene: Scene, *, slope: float, tilt: float, red: float, blue: float) -> Array:
    """Raise the light of each channel to a power that depends on the temperature."""
    per_kelvin = np.array([slope + red, slope, slope + blue])
    if tilt:
        per_kelvin = per_kelvin + tilt * (2.0 * linear_to_code(linear) - 1.0)
    return bent(linear, (scene.temperature_c - REFERENCE_C) * per_kelvin)
