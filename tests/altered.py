"""JSON with one changed value, which the schema must refuse."""

from collections.abc import Sequence
from copy import deepcopy
from typing import Any


def altered(content: Any, path: Sequence[str | int], value: object) -> Any:
    """Return a copy of JSON content that has ``value`` at a path of keys and indices."""
    changed = place = deepcopy(content)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return changed
