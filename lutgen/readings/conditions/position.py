"""Position of a patch on the screen."""

from dataclasses import replace
from itertools import product

import numpy as np

from lutgen.readings.conditions import Array, Column, Condition, Sketch, Values, greys, within

#: The columns of the position.
PLACE = ("u", "v")


def radius(values: Values) -> Array:
    """Return the distance from the centre of the screen, of the values' shape; 1 in the corners."""
    return np.asarray(np.sqrt(2.0 * ((values["u"] - 0.5) ** 2 + (values["v"] - 0.5) ** 2)))


def _signatures(values: Values, _rest: Values) -> dict[str, Array]:
    u, v = 2 * values["u"] - 1, 2 * values["v"] - 1
    return {
        "side": u,
        "height": v,
        "distance from the centre": (u * u + v * v) / 2,
        "distance from the centre to the fourth": ((u * u + v * v) / 2) ** 2,
    }


_U = Column(
    name="u",
    meaning="the position from the left, 0..1",
    blank=0.5,
    usual=0.5,
    unlogged=0.4,
    tried=(0.5, 0.0, 0.1, 0.9, 1.0),
    shown=0.05,
    axis=(0.5, 1.0),
    words="position from the left",
)
_V = replace(
    _U, name="v", meaning="the position from the top, 0..1", tried=(0.5, 0.0, 0.2, 0.8, 1.0),
    words="position from the top",
)  # fmt: skip

_NEAR_EDGES = [place for place in product((0.1, 0.5, 0.9), repeat=2) if place != (0.5, 0.5)]

CONDITION = Condition(
    name="position",
    place=1,
    columns=(_U, _V),
    cell="position",
    span=within(0.02),
    depends="position",
    in_words=lambda at: "centre" if at["u"] == at["v"] == 0.5 else f"position u = {at['u']:g}, v = {at['v']:g}",
    label="u {:g}, v {:g}".format,
    sentence="at {}",
    heading="position",
    short="({:g}, {:g})",
    before="at ",
    axis="distance from the centre (1: a corner)",
    along=radius,
    of_readings=True,
    signatures=_signatures,
    strange=("side", "height"),
    sketches={
        r".*\b(side)": Sketch(
            "optics", ("u",), "share of the light at the right edge", "xyz * (1.0 + {size} * (2.0 * scene.u - 1.0))"
        ),
        r".*\b(height)": Sketch(
            "optics", ("v",), "share of the light at the lower edge", "xyz * (1.0 + {size} * (2.0 * scene.v - 1.0))"
        ),
        r".*\b(distance|position)": Sketch(
            "optics", PLACE, "share of the light in the corners", "xyz * (1.0 + {size} * scene.radius**2)"
        ),
    },
    varied=("nine positions", [patch for u, v in _NEAR_EDGES for patch in greys((1.0, 0.5), u=u, v=v)]),
)
