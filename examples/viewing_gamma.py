"""Seen from above or below, a TN panel's mid-tones change: the exponent of its curve goes with the height."""

from lutgen.colorimetry import Array
from lutgen.effects import Parameter, Scene, effect


@effect(
    stage="transfer",
    neutral={"tilt": 0.0},
    needs=("v",),
    tilt=Parameter(0.05, (-0.5, 0.5), "1", "change of the exponent from the middle of the screen to its lower edge"),
)
def viewing_gamma(linear: Array, scene: Scene, *, tilt: float) -> Array:
    """Bend the transfer curve by the height."""
    return linear ** (1.0 + tilt * (2.0 * scene.v - 1.0))
