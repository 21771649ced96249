"""The model's own jump: the paper's ``nearest`` matrix changes at once where white becomes the nearest colour point.

This is no physics of the display. The model jumps at the borders between colour points, by a third of the difference
between white and the sum of its primaries. The remedy is ``selection = "continuous"``, which an effect of this stage
switches on.

Meaning of 0 and 1: it has no size; it is there or not.
Valid for models with ``selection = "nearest"`` of a display that is not additive.
Source: Avanaki et al., Proc. SPIE 9420 (2015), doi:10.1117/12.2082315, step 5 of section 2.2.
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
    source="Avanaki et al. 2015, doi:10.1117/12.2082315, step 5",
)
def matrix_switching(linear: Array, scene: Scene) -> Array:  # noqa: ARG001 - an effect's signature
    """Leave the signal alone: its presence is what counts."""
    return linear
