"""JSON Schemas that lie beside the code that writes the JSON: the .json files of a package, by their names.

They follow JSON Schema 2020-12, https://json-schema.org. A key may be added under the same version; a key that is taken
away or changes its meaning raises it.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from lutgen.errors import pick_one


def schema_names(package: str) -> tuple[str, ...]:
    """Name the schemas of a package, in alphabetical order."""
    return tuple(sorted(each.name[:-5] for each in files(package).iterdir() if each.name.endswith(".json")))


def read_schema(package: str, name: str) -> dict[str, Any]:
    """Return a schema.

    Raises
    ------
    LutgenError
        The package has none of this name.

    """
    names = schema_names(package)
    if name not in names:
        raise pick_one("schema", name, names)
    found: dict[str, Any] = json.loads(files(package).joinpath(f"{name}.json").read_text(encoding="utf-8"))
    return found
