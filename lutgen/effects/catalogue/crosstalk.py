"""A lit neighbour takes light from a subpixel: bright mixtures are darker than the sum of their channels.

l_c' = l_c·(1 − χ(τ)·Σ_{j≠c} l_j). The columns of a panel are coupled electrically. A ramp of one channel does not show
the coupling. The refined forms use other powers of the neighbour's light and of the channel's own light (1/2.2 makes a
product of drives), give each pair of channels its own χ, or add a loss where both neighbours are lit.

Meaning of 0 and 1: χ = 0 is an additive display. χ = 1 would switch a channel off where one neighbour is at full drive.
A negative χ makes mixtures brighter than their sum.
Valid for patches. Coupling along the lines and columns of a picture, beyond the pixel, is not modelled.
Sources: products of two channels as terms of a display's model: Wen & Wu, Color Res. Appl. 31, 102 (2006),
doi:10.1002/col.20187. Crosstalk as one of two departures of an LCD from additivity: Feng & Yoshida, Proc. CGIV 2008,
327, doi:10.2352/CGIV.2008.4.1.art00071.
Assumption: sizes of 1 to 4 %.
"""

from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import LASTING, POWER, SATURATION, growth, share_of_final

PAIRS = ("red_by_green", "red_by_blue", "green_by_red", "green_by_blue", "blue_by_red", "blue_by_green")


def _pair(victim: str, neighbour: str) -> Any:
    return Parameter(0.0, (-0.15, 0.25), "1", f"share of {victim}'s light that full {neighbour} takes, at 18 000 h")


@effect(
    stage="mixing",
    neutral=dict.fromkeys(("new", "grown", "both", *PAIRS), 0.0),
    forms=(
        ("new",),
        ("grown",),
        ("new", "grown"),
        ("new", "grown", "exponent"),
        ("new", "grown", "exponent", "own"),
        ("new", "grown", "power", "saturation", "exponent", "own"),
        ("both", "onset"),
        ("new", "grown", "both", "onset"),
        PAIRS,
        (*PAIRS, "both", "onset", "power", "exponent"),
    ),
    refined=3,
    confused_with={
        "loading": "the same colour in a 10 % window, or random mixtures",
        "matrix-switching": "pairs of patches across a border between two colour points",
    },
    says="a fully lit neighbour takes {size} of a channel's light",
    says_less="a fully lit neighbour adds {size} to a channel's light",
    source="Wen & Wu 2006, doi:10.1002/col.20187 (form); size: an assumption",
    new=Parameter(
        0.02,
        (-0.1, 0.2),
        "1",
        "share of its light that a channel loses to each full neighbour, at hour 0",
        beside_first=0.0,
    ),
    grown=Parameter(0.02, (-0.1, 0.25), "1", "growth of that share by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    exponent=Parameter(
        1.0, (0.1, 3.0), "1", "power of the neighbour's light in the product; 1/2.2 stands for its drive"
    ),
    own=Parameter(1.0, (0.1, 2.0), "1", "power of the channel's own light in the product; 1/2.2 stands for its drive"),
    both=Parameter(0.0, (-0.2, 0.4), "1", "additional share lost where both neighbours are full, at 18 000 h"),
    onset=LASTING,
    **{name: _pair(*name.split("_by_")) for name in PAIRS},
)
def crosstalk(
    linear: Array, scene: Scene, *,
    new: float, grown: float, power: float, saturation: float, exponent: float, own: float,
    both: float, onset: float, red_by_green: float, red_by_blue: float,
    green_by_red: float, green_by_blue: float, blue_by_red: float, blue_by_green: float,
) -> Array:  # fmt: skip
    """Subtract from each channel the light that its lit neighbours take."""
    lit = linear if exponent == 1.0 else np.maximum(linear, 0.0) ** exponent
    loss = growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation) * (
        lit.sum(axis=-1, keepdims=True) - lit
    )
    first = np.array([red_by_green, green_by_blue, blue_by_red])  # by the next channel; `second` by the one after
    second = np.array([red_by_blue, green_by_red, blue_by_green])
    if both or first.any() or second.any():
        next_lit, after_lit = lit[..., [1, 2, 0]], lit[..., [2, 0, 1]]
        extra = first * next_lit + second * after_lit + both * next_lit * after_lit
        loss = loss + share_of_final(scene.tau, onset=onset, power=power, saturation=saturation) * extra
    victim = linear if own == 1.0 else np.maximum(linear, 0.0) ** own
    return np.asarray(np.maximum(linear - victim * loss, 0.0))
