"""The screen darkens towards its edges, more so as it ages: light guides and lamps lose most where they are hottest.

XYZ' = XYZ·(1 − k(τ)·ρ²). ρ is the distance from the centre: 0 in the centre, 1 in the corners. The refined forms free
the power of ρ, the shape of the contours (circles to rounded rectangles), the ratio of horizontal to vertical fall-off,
a slope across the screen, and the colour of the loss. No other effect depends on the position. Five positions in a
session show the shape.

Meaning of 0 and 1: k = 0 is an even screen. k = 1 would leave the corners black. The centre never changes.
Valid for a smooth fall-off. A dark line or a bright edge is not modelled. A LUT cannot carry this effect.
Source: 10.4 ± 2.4 % largest luminance deviation over 23 medical displays: J. Digit. Imaging (2015),
doi:10.1007/s10278-015-9811-7. How to measure uniformity: Samei et al. (AAPM TG18), doi:10.1118/1.1861159.
Assumption: the form, and the growth with age.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, SATURATION, growth


@effect(
    stage="optics",
    neutral={"new": 0.0, "grown": 0.0},
    forms=(
        ("new", "grown"),
        ("new", "grown", "power"),
        ("new", "grown", "exponent"),
        ("new", "grown", "exponent", "contour", "stretch"),
        ("new", "grown", "power", "exponent", "contour", "stretch"),
        ("new", "grown", "power", "saturation", "exponent", "contour"),
        ("new", "grown", "exponent", "tint_x", "tint_z"),
        ("new", "grown", "power", "saturation", "exponent", "contour", "tint_x", "tint_z"),
        ("new", "grown", "power", "exponent", "contour", "stretch", "tint_x", "tint_z"),
        ("new", "grown", "power", "exponent", "contour", "stretch", "slope_u", "slope_v"),
    ),
    needs=("u", "v"),
    confused_with={},
    says="the corners lack {size} of the light",
    says_less="the corners give {size} more light",
    source="doi:10.1007/s10278-015-9811-7 (size when new); form and growth: an assumption",
    new=Parameter(0.1, (-0.1, 0.6), "1", "share of the light that is missing in the corners, at hour 0"),
    grown=Parameter(0.05, (-0.3, 0.6), "1", "growth of that share by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    exponent=Parameter(2.0, (0.5, 8.0), "1", "power of the distance from the centre"),
    contour=Parameter(2.0, (1.0, 8.0), "1", "shape of the lines of equal loss: 2 circles, more: rounded rectangles"),
    stretch=Parameter(0.0, (-0.95, 0.95), "1", "excess of the horizontal loss: above 0 the sides lose more"),
    slope_u=Parameter(0.0, (-2.0, 2.0), "1", "slope from left to right, relative to the loss in the corners"),
    slope_v=Parameter(0.0, (-2.0, 2.0), "1", "slope from top to bottom, relative to the loss in the corners"),
    tint_x=Parameter(0.0, (-1.0, 1.0), "1", "loss of X over loss of Y, less 1"),
    tint_z=Parameter(0.0, (-1.0, 2.0), "1", "loss of Z over loss of Y, less 1"),
)
def edge_falloff(
    xyz: Array, scene: Scene, *,
    new: float, grown: float, power: float, saturation: float, exponent: float, contour: float, stretch: float,
    slope_u: float, slope_v: float, tint_x: float, tint_z: float,
) -> Array:  # fmt: skip
    """Darken by the distance from the centre; keep the centre."""
    across, down = 2.0 * scene.u - 1.0, 2.0 * scene.v - 1.0
    norm = ((1.0 + stretch) * np.abs(across) ** contour + (1.0 - stretch) * np.abs(down) ** contour) / 2.0
    shape = norm ** (exponent / contour) + slope_u * across + slope_v * down
    loss = growth(scene.tau, new=new, grown=grown, power=power, saturation=saturation) * shape
    return np.asarray(xyz * (1.0 - loss * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z])))
