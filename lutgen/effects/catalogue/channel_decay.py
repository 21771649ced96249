"""Each channel fades at its own rate, as the three emitters of an OLED do; white drifts with them.

P_c' = P_c·exp(−ℓ_c·τ^p) for each primary P_c. White is the sum of its primaries, and fades with them.

Meaning of 0 and 1: ℓ_c = 0 keeps the channel's light of hour 0. ℓ_c = 1 leaves 1/e, 37 %, at 18 000 h.
Valid where each channel has its own light source, whose spectrum keeps its shape while the source fades.
Source: stretched exponential in time: Féry et al., Appl. Phys. Lett. 87, 213502 (2005), doi:10.1063/1.2133922.
Unequal rates: two sets of an early OLED, Sony's XEL-1, lost 12 % of blue, 8 % of green and 7 % of red in 1000 h
(DisplaySearch, "OLED characterization report: Sony XEL-1", 2008; reported on 8 May 2008 at
https://www.engadget.com/2008/05/08/sony-xel-1-estimated-to-last-customers-only-half-as-long-as-expe/).
Assumption: later displays are of that kind.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, SATURATION, growth, scaled

#: Largest gain of a channel in nepers: keeps the light finite far beyond 18 000 h.
MAX_GAIN = 20.0


@effect(
    stage="emission",
    neutral={"red": 0.0, "green": 0.0, "blue": 0.0},
    forms=(
        ("blue",),
        ("red", "green", "blue"),
        ("blue", "power"),
        ("red", "green", "blue", "power"),
        ("red", "green", "blue", "power", "saturation"),
        ("red", "green", "blue", "power", "red_bend", "blue_bend"),
    ),
    refined=2,
    baseline="first-hour",
    confused_with={
        "phosphor-wear": "spectra of the primaries: unequal emitters keep their chromaticities",
        "drive-loss": "ramps; under a pure power law nothing separates them and the picture is the same",
    },
    says="the light of {channels} fades at its own rate",
    source="Féry et al. 2005, doi:10.1063/1.2133922 (form); size: an assumption",
    red=Parameter(0.2, (-0.5, 10.0), "1", "nepers that red has lost by 18 000 h"),
    green=Parameter(0.2, (-0.5, 10.0), "1", "nepers that green has lost by 18 000 h"),
    blue=Parameter(0.4, (-0.5, 10.0), "1", "nepers that blue has lost by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    red_bend=Parameter(1.0, (0.5, 2.0), "1", "power of red's loss in time relative to green's"),
    blue_bend=Parameter(1.0, (0.5, 2.0), "1", "power of blue's loss in time relative to green's"),
)
def channel_decay(
    tips: Array, scene: Scene, *,
    red: float, green: float, blue: float, power: float, saturation: float, red_bend: float, blue_bend: float,
) -> Array:  # fmt: skip
    """Multiply each primary by its decay; white is the sum of the primaries."""
    bends = np.array([red_bend, 1.0, blue_bend])
    size = growth(scene.tau**bends, new=0.0, grown=1.0, power=power, saturation=saturation)
    return scaled(tips, np.exp(np.minimum(-size * np.array([red, green, blue]), MAX_GAIN)))
