"""Effects as JSON: the registry, for programs that list, choose or document them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

    from lutgen.effects import Effect

#: Version of what :func:`registry_json` gives.
SCHEMA = 1


def registry_json(effects: Iterable[Effect]) -> dict[str, Any]:
    """Return effects as JSON holds them, in the order given."""
    return {"schema": SCHEMA, "effects": [effect_json(effect) for effect in effects]}


def effect_json(effect: Effect) -> dict[str, Any]:
    """Return all that an effect declares, its function apart."""
    return {
        "name": effect.name,
        "stage": effect.stage,
        "summary": effect.summary,
        "baseline": effect.baseline,
        "needs": list(effect.needs),
        "origin": effect.origin,
        "parameters": {
            name: {
                "value": parameter.value,
                "bounds": list(parameter.bounds),
                "unit": parameter.unit,
                "meaning": parameter.meaning,
                "neutral": effect.neutral.get(name),
                "grid": list(parameter.grid) if not isinstance(parameter.grid, str) else parameter.grid,
            }
            for name, parameter in effect.parameters.items()
        },
        "forms": [list(form) for form in effect.forms],
        "refined": effect.refined,
        "confused_with": dict(effect.confused_with or {}),
        "source": effect.source,
        "text": effect.text,
    }
