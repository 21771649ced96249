"""Drive is lost on its way to the pixels: every code value arrives a little smaller.

d' = (1 − ρ(τ))·d. Contacts oxidise and driver outputs sag. Under a pure power law a smaller drive is a gain of each
channel, and white and primaries that are measured again contain this gain. Under sRGB's curve, only its straight toe
leaves a small residual in the mid-tones. With ``lean`` a high drive loses more than a low drive, as over the resistance
of a contact, and the curve bends too: the loss is ρ(τ)·(1 + ``lean``·d). A liquid crystal that responds less, as if its
drive were smaller, belongs to this effect. A liquid crystal whose response changes its shape belongs to ``eotf-drift``.
A liquid crystal that no longer closes belongs to ``black-level``.

Meaning of 0 and 1: ρ = 0 passes the code value unchanged. ρ = 1 leaves no drive.
Valid for analogue drive. A digital link passes a code value exactly or fails.
Assumption: the mechanism, and losses of 0.5 to 10 %.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import LASTING, POWER, SATURATION, growth, share_of_final


@effect(
    stage="drive",
    neutral={"new": 0.0, "grown": 0.0, "red": 0.0, "green": 0.0, "blue": 0.0},
    forms=(
        ("grown",),
        ("new",),
        ("new", "grown"),
        ("new", "grown", "power", "saturation"),
        ("grown", "lean"),
        ("grown", "power", "lean"),
        ("grown", "power", "saturation", "lean"),
        ("red", "green", "blue"),
        ("red", "green", "blue", "onset", "power"),
        ("red", "green", "blue", "onset", "power", "saturation"),
    ),
    refined=3,
    confused_with={
        "eotf-drift": "ramps: a gamma bends dark levels most, a loss that grows with the drive the bright ones",
        "channel-decay": "ramps; under a pure power law nothing separates them and the picture is the same",
        "backlight-decay": "ramps; under a pure power law nothing separates them and the picture is the same",
    },
    says="pixels lose {size} of their drive",
    says_less="pixels gain {size} of drive",
    source="mechanism and size: an assumption",
    new=Parameter(0.01, (-0.1, 0.4), "1", "share of the drive that is lost at hour 0", beside_first=0.0),
    grown=Parameter(0.03, (-0.3, 0.5), "1", "growth of that share by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    onset=LASTING,
    lean=Parameter(0.0, (0.0, 1.0), "1", "relative increase of that share at full drive"),
    red=Parameter(0.0, (-0.3, 0.5), "1", "share of red's drive that is lost in addition, at 18 000 h"),
    green=Parameter(0.0, (-0.3, 0.5), "1", "share of green's drive that is lost in addition, at 18 000 h"),
    blue=Parameter(0.0, (-0.3, 0.5), "1", "share of blue's drive that is lost in addition, at 18 000 h"),
)
def drive_loss(
    code: Array, scene: Scene, *,
    new: float, grown: float, power: float, saturation: float, onset: float, lean: float,
    red: float, green: float, blue: float,
) -> Array:  # fmt: skip
    """Reduce the code values; clip the loss at 1."""
    loss = growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation)
    loss = loss * (1.0 + lean * code)
    if red or green or blue:
        share = share_of_final(scene.tau, onset=onset, power=power, saturation=saturation)
        loss = loss + share * np.array([red, green, blue])
    return np.asarray(code * np.maximum(1.0 - loss, 0.0))
