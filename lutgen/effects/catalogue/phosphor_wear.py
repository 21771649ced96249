"""One part of the light source wears faster than the rest, and white drifts away from its colour.

The part's share of the spectrum is multiplied by exp(−w·g(τ)), g a power of time: in a CCFL the blue phosphor (BAM),
then the green one; in a white LED the yellow phosphor (YAG), then the chip; in LEDs with a green and a red phosphor
(PFS or CaAlSiN₃) the red one, then the green one; of quantum dots the green ones, then the red ones; of RGB LEDs, OLEDs
and the layers of a WRGB OLED the blue emitter, then the green one. Acts on the display's spectra, estimated from its
class: the words of ``# display:``, or where these name none the kind of light whose spectra the primaries change least.

Meaning of 0 and 1: ``wear`` 0 keeps the spectrum; 1 leaves 1/e, 37 %, of that part at 18 000 h.
Valid as far as the spectra are: with an estimated spectrum the size is an estimate too. The LUT is correct all the
same, since it is fitted to XYZ.
Assumption: which part leads, its exponential loss, and Δu'v' of 0.002 to 0.007 at 6000 h.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.effects.declare import Parameter, effect
from lutgen.effects.shapes import POWER, SATURATION, growth
from lutgen.effects.spectra import WAVELENGTHS, mapped, of_scene

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="emission",
    neutral={"wear": 0.0, "second": 0.0},
    forms=(
        ("wear",),
        ("wear", "power"),
        ("wear", "second", "power"),
        ("wear", "second", "power", "saturation"),
    ),
    baseline="first-hour",
    confused_with={
        "yellowing": "a spectrum; with a guessed one both give the same picture",
        "meter-drift": "a second meter or a check source",
        "channel-decay": "spectra of the primaries: a worn phosphor also moves their chromaticities",
    },
    source="size: an assumption",
    wear=Parameter(0.15, (0.0, 3.0), "1", "nepers that the part that wears first has lost by 18 000 h"),
    second=Parameter(0.0, (-0.3, 3.0), "1", "nepers that the next part has lost by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
)
def phosphor_wear(tips: Array, scene: Scene, *, wear: float, second: float, power: float, saturation: float) -> Array:
    """Take the worn parts' light away."""
    if not (wear or second):
        return tips
    light = of_scene(scene.light, "phosphor-wear")
    tau, index = np.unique(scene.tau, return_inverse=True)
    size = growth(tau, new=0.0, grown=1.0, power=power, saturation=saturation)[:, np.newaxis]
    left = np.ones(WAVELENGTHS.size)
    for lost, share in zip((wear, second), light.parts.values(), strict=False):
        left = left + np.expm1(-lost * size) * share
    return mapped(tips, light.maps(left)[index.reshape(-1)][:, np.newaxis])
