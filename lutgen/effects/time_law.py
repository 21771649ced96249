"""How sizes run in time: the parameters that many effects share.

``power`` and ``saturation`` bend the growth of :func:`~lutgen.effects.scene.growth`. Where an effect has several
amplitudes, ``onset`` says once for all of them how much was there at hour 0; the amplitudes are the sizes at 18 000 h.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.effects.declare import Parameter
from lutgen.effects.scene import growth

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

POWER = Parameter(1.0, (0.3, 6.0), "1", "power of time with which it grows")
SATURATION = Parameter(
    0.0, (0.0, 20.0), "1", "nepers by which its growth has saturated by 18 000 h, 0: a power of time"
)
GROWING = Parameter(0.0, (0.0, 1.5), "1", "share of the size at 18 000 h that is there at hour 0")
LASTING = Parameter(1.0, (0.0, 1.5), "1", "share of the size at 18 000 h that is there at hour 0")


def share_of_final(tau: Array, *, onset: float, power: float, saturation: float = 0.0) -> Array:
    """Size at τ as a share of that at τ = 1, shape of ``tau``."""
    return growth(tau, new=onset, grown=1.0 - onset, power=power, saturation=saturation)
