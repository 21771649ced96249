"""The JSON Schemas of what the commands on pictures write with ``--json``, beside this file.

They follow JSON Schema 2020-12, https://json-schema.org. A key may be added under the same version; a key that is taken
away or changes its meaning raises it.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from lutgen.display import what_pictures_carry
from lutgen.errors import pick_one

if TYPE_CHECKING:
    from lutgen.display import DisplayModel

#: What there is a schema of.
NAMES = tuple(sorted(each.name[:-5] for each in files(__name__).iterdir() if each.name.endswith(".json")))


def seen_on(model: DisplayModel) -> dict[str, Any]:
    """Return what the JSON of every command on pictures says of the display: display, model, remarks."""
    return {
        "display": {"file": model.measurements.file, "sha256": model.measurements.sha256},
        "model": model.file or None,
        "remarks": what_pictures_carry(model),
    }


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
