"""How large an effect must be for some readings to show it, over how large it typically is."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.criticism.visibility import Visibility
    from lutgen.effects import Effect


def typical_size(effect: Effect, parameter: str) -> float:
    """Distance of a parameter's typical value from the value at which the effect does nothing, in its unit."""
    return abs(effect.parameters[parameter].value - effect.neutral.get(parameter, 0.0))


def relative_size(visibility: Visibility, effects: Mapping[str, Effect]) -> float | None:
    """Smallest detectable size over the typical one; None where either of them is not defined."""
    effect = effects[visibility.effect]
    if (
        visibility.smallest_detectable is None
        or visibility.parameter not in effect.neutral
        or effect.parameters[visibility.parameter].grid
    ):
        return None
    typical = typical_size(effect, visibility.parameter)
    return visibility.smallest_detectable / typical if typical else None
