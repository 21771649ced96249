"""The transfer curve of one channel drifts: greys take a tint, and only that channel's ramp bends.

l_c' = l_c^(1 + Γ_c), with one Γ_c for each channel c. The simple forms have a Γ_c that is constant over the levels. The
refined forms have a Γ_c that is free at five levels of one channel. Drivers and calibration tables are separate for
each channel, and can fail separately.

Meaning of 0 and 1: Γ = 0 keeps the curve. Γ = 1 squares the light of the channel: a gamma of 2.2 becomes 4.4. Black and
full drive do not change.
Valid for smooth drifts. A curve with steps is ``quantization``; a curve that changes on one day is ``recalibration``.
Assumption: the mechanism and the size.
"""

from typing import Any

import numpy as np

from lutgen.colorimetry import Array, linear_to_code
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import (
    GROWING,
    POWER,
    SATURATION,
    bent,
    growth,
    level_curve,
    level_parameters,
    share_of_final,
)

CHANNELS = ("red", "green", "blue")
SIZES: dict[str, Any] = {}
for _name in CHANNELS:
    _new, _grown = f"change of {_name}'s exponent at hour 0", f"further change of {_name}'s exponent by 18 000 h"
    SIZES[f"{_name}_new"] = Parameter(0.05, (-0.6, 2.0), "1", _new, beside_first=0.0)
    SIZES[f"{_name}_grown"] = Parameter(0.05, (-0.6, 2.0), "1", _grown)
RED, GREEN, BLUE = (
    level_parameters(name, f"change of {name}'s exponent near code value {{}}, at 18 000 h") for name in CHANNELS
)


@effect(
    stage="transfer",
    neutral=dict.fromkeys((*SIZES, *RED, *GREEN, *BLUE), 0.0),
    forms=(
        ("red_new", "red_grown"),
        ("green_new", "green_grown"),
        ("blue_new", "blue_grown"),
        (*SIZES,),
        (*RED, "onset"),
        (*GREEN, "onset"),
        (*BLUE, "onset"),
        (*RED, "onset", "power", "saturation"),
        (*GREEN, "onset", "power", "saturation"),
        (*BLUE, "onset", "power", "saturation"),
    ),
    refined=4,
    confused_with={
        "primary-shift": "ramps of red, green and blue: a gamma keeps each ramp's chromaticity",
        "eotf-drift": "ramps of red, green and blue: one of them bends, or all",
        "black-level": "single-channel ramps at dark levels",
    },
    says="the transfer curve of {channels} drifts",
    source="mechanism and size: an assumption",
    **SIZES,
    power=POWER,
    saturation=SATURATION,
    onset=GROWING,
    **RED,
    **GREEN,
    **BLUE,
)
def channel_gamma(
    linear: Array, scene: Scene, *,
    red_new: float, red_grown: float, green_new: float, green_grown: float, blue_new: float, blue_grown: float,
    power: float, saturation: float, onset: float,
    red_00: float, red_25: float, red_50: float, red_75: float, red_100: float,
    green_00: float, green_25: float, green_50: float, green_75: float, green_100: float,
    blue_00: float, blue_25: float, blue_50: float, blue_75: float, blue_100: float,
) -> Array:  # fmt: skip
    """Raise the light of each channel to its own power."""
    parts = (
        (red_new, red_grown, (red_00, red_25, red_50, red_75, red_100)),
        (green_new, green_grown, (green_00, green_25, green_50, green_75, green_100)),
        (blue_new, blue_grown, (blue_00, blue_25, blue_50, blue_75, blue_100)),
    )
    channels = []
    for (new, grown, knots), light in zip(parts, np.moveaxis(linear, -1, 0)[..., np.newaxis], strict=True):
        if not (new or grown or any(knots)):
            channels.append(np.broadcast_to(light, np.broadcast_shapes(light.shape, scene.tau.shape)))
            continue
        change = growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation)
        if any(knots):
            curve = level_curve(linear_to_code(light), knots)
            change = change + share_of_final(scene.tau, onset=onset, power=power, saturation=saturation) * curve
        channels.append(bent(light, change))
    return np.concatenate(channels, axis=-1)
