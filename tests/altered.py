"""JSON with one changed value, which the schema must refuse."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence


def altered(content: Any, path: Sequence[str | int], value: object) -> Any:
    """Return a copy of JSON content that has ``value`` at a path of keys and indices."""
    changed = place = deepcopy(content)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return changed
