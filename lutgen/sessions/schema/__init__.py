"""The JSON Schema of what ``lutgen inspect`` writes with ``--json``, beside this file.

It follows JSON Schema 2020-12, https://json-schema.org. A key may be added under the same version; a key that is taken
away or changes its meaning raises it.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from lutgen.errors import pick_one

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.sessions.inspect import Inspection

#: What there is a schema of.
NAMES = tuple(sorted(each.name[:-5] for each in files(__name__).iterdir() if each.name.endswith(".json")))


def as_json(found: Sequence[Inspection]) -> dict[str, Any]:
    """Return what ``lutgen inspect --json`` writes of these sessions."""
    return {"schema": 1, "sessions": [each.as_json() for each in found]}


def schema(name: str) -> dict[str, Any]:
    """Return the schema of a command's JSON.

    Raises
    ------
    LutgenError
        ``name`` is none of ``NAMES``.

    """
    if name not in NAMES:
        raise pick_one("schema", name, NAMES)
    found: dict[str, Any] = json.loads(files(__name__).joinpath(f"{name}.json").read_text(encoding="utf-8"))
    return found
