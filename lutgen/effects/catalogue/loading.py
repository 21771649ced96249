"""A bright screen lowers its supply voltage: all light, also of black, falls with the mean drive of the whole screen.

P' = P·(1 − ξ(τ)·m) for white and all primaries, with m the mean code value of patch and surround. Supply lines droop,
and the brightness limiters of OLED screens reduce the light. On full-field patches loading looks like crosstalk,
because bright mixtures are bright screens. The refined forms average another power of the code values (their light),
with the weight of each channel in the power of the screen, and make the loss proportional to a power of m (a limiter's
knee).

Meaning of 0 and 1: ξ = 0 is a screen on which the size of a patch does not matter. ξ = 1 would switch a white screen
off. ξ is never negative: no supply gains by its load. A screen that brightens with its load has ``dynamic-contrast``.
Valid for still patches. A limiter that reacts within seconds, or to the last minutes, is not modelled.
Source: the luminance of an OLED monitor falls when many pixels are lit, most for white: Elze, Taylor & Bex, Med. Phys.
40, 092701 (2013), doi:10.1118/1.4818056.
Assumption: up to 26 % on an OLED with a white surround; that LCDs have the effect too, and its size there.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, SATURATION, growth, over_screen


@effect(
    stage="emission",
    neutral={"new": 0.0, "grown": 0.0},
    forms=(
        ("new",),
        ("grown",),
        ("new", "grown"),
        ("new", "grown", "power"),
        ("new", "bend"),
        ("new", "grown", "bend"),
        ("new", "grown", "power", "exponent", "bend"),
        ("new", "grown", "power", "saturation", "exponent", "bend"),
        ("new", "grown", "exponent", "weight_red", "weight_blue"),
    ),
    refined=3,
    confused_with={
        "crosstalk": "window patches: the same colour in 10 % of the screen",
        "veiling-glare": "window patches: loading darkens by a factor, glare adds",
        "eotf-drift": "window patches",
    },
    says="a white screen loses {size} of its light",
    source="Elze, Taylor & Bex 2013, doi:10.1118/1.4818056 (effect on OLEDs); size: an assumption",
    new=Parameter(0.03, (0.0, 0.6), "1", "share of the light that a white screen loses, at hour 0"),
    grown=Parameter(0.03, (-0.2, 0.35), "1", "growth of that share by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    exponent=Parameter(1.0, (0.3, 4.0), "1", "power of the code values that is averaged; 2.2 for their light"),
    bend=Parameter(1.0, (0.3, 8.0), "1", "power of that mean to which the loss is proportional; large for a limiter"),
    weight_red=Parameter(0.0, (-0.9, 3.0), "1", "weight of red in the mean relative to green's, less 1"),
    weight_blue=Parameter(0.0, (-0.9, 3.0), "1", "weight of blue in the mean relative to green's, less 1"),
)
def loading(
    tips: Array, scene: Scene, *,
    new: float, grown: float, power: float, saturation: float, exponent: float, bend: float,
    weight_red: float, weight_blue: float,
) -> Array:  # fmt: skip
    """Darken white and all primaries by the mean code value of the screen, patch and surround."""
    load, _ = over_screen(scene, exponent, weight_red=weight_red, weight_blue=weight_blue)
    if bend != 1.0:
        load = np.maximum(load, 0.0) ** bend
    loss = np.maximum(growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation), 0.0) * load
    return np.asarray(tips * np.maximum(1.0 - loss, 0.0)[..., np.newaxis])
