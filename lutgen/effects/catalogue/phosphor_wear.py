"""Parts of the light source wear faster than the rest, and white drifts away from its colour.

S'(λ) = S(λ)·(1 − Σ_i a_i(λ)·(1 − exp(−w_i·g(τ)))). a_i(λ) is the share of part i in the light at λ, w_i its loss in
nepers at 18 000 h, and g a power of time. The parts, in the order of ``wear``, ``second``, ``third``, are: of a CCFL
the blue (BAM), green and red phosphors; of a white LED the yellow phosphor (YAG) and the chip; of LEDs with a green and
a red phosphor (PFS or CaAlSiN₃) the red one, the green one, the chip; of quantum dots the green ones, the red ones, the
chip; of RGB LEDs, OLEDs and the layers of a WRGB OLED the blue, green and red emitters. The effect acts on the
display's spectra, which lutgen estimates from the class of the display. The words after ``# display:`` name the class.
Otherwise lutgen chooses the class whose typical spectra need the least correction.

Meaning of 0 and 1: ``wear`` 0 keeps the spectrum. ``wear`` 1 leaves 1/e, 37 %, of that part at 18 000 h.
Valid as far as the spectra are. With an estimated spectrum the size is an estimate too. The LUT is correct in both
cases, because it is fitted to XYZ. No form frees three parts at once: where a sensor holds white, the readings do not
show the common loss of the parts.
Sources: phosphors of fluorescent lamps deteriorate: Lehmann, "Phosphor deterioration in fluorescent lamps", J.
Electrochem. Soc. 130, 426 (1983). The light of a whole LED falls exponentially: IES TM-21-11, "Projecting Long Term
Lumen Maintenance of LED Light Sources".
Assumption: which part wears first, the exponential loss of a part, and Δu'v' of 0.002 to 0.007 at 6000 h.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, SATURATION, growth
from lutgen.effects.spectra import WAVELENGTHS, mapped, of_scene


@effect(
    stage="emission",
    neutral={"wear": 0.0, "second": 0.0, "third": 0.0},
    forms=(
        ("wear",),
        ("second",),
        ("third",),
        ("wear", "power"),
        ("second", "power"),
        ("wear", "second"),
        ("second", "third"),
        ("wear", "second", "power"),
        ("second", "third", "power"),
        ("wear", "second", "power", "saturation"),
    ),
    refined=3,
    baseline="first-hour",
    confused_with={
        "yellowing": "a spectrum; with a guessed one both give the same picture",
        "meter-drift": "a second meter or a check source",
        "channel-decay": "spectra of the primaries: a worn phosphor also moves their chromaticities",
    },
    source="IES TM-21-11 (loss of a whole LED); which part wears, form and size: an assumption",
    wear=Parameter(0.15, (0.0, 3.0), "1", "nepers that the part that wears first has lost by 18 000 h"),
    second=Parameter(0.0, (-0.3, 3.0), "1", "nepers that the next part has lost by 18 000 h"),
    third=Parameter(0.0, (-0.3, 3.0), "1", "nepers that the part after that has lost by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
)
def phosphor_wear(
    tips: Array, scene: Scene, *, wear: float, second: float, third: float, power: float, saturation: float
) -> Array:
    """Remove the light that the worn parts have lost."""
    if not (wear or second or third):
        return tips
    light = of_scene(scene.light, "phosphor-wear")
    tau, index = np.unique(scene.tau, return_inverse=True)
    size = growth(tau, new=0.0, grown=1.0, power=power, saturation=saturation)[:, np.newaxis]
    left = np.ones(WAVELENGTHS.size)
    for lost, share in zip((wear, second, third), light.parts.values(), strict=False):
        left = left + np.expm1(-lost * size) * share
    return mapped(tips, light.maps(left)[index.reshape(-1)][:, np.newaxis])
