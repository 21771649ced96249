"""The model's own jump: the paper's ``nearest`` matrix changes at once where white becomes the nearest colour point.

No physics of the display: the residual sits on the borders between colour points, by a third of what white adds to its
primaries. The cure is ``selection = "continuous"``, which an effect of this stage switches on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.effects.declare import effect

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="selection",
    neutral={},
    confused_with={"crosstalk": "pairs of patches across a border between two colour points"},
    source="Avanaki et al., Proc. SPIE 9420 (2015), step 5",
)
def matrix_switching(linear: Array, scene: Scene) -> Array:  # noqa: ARG001 - an effect's signature
    """Leave the signal alone: its presence is what counts."""
    return linear
