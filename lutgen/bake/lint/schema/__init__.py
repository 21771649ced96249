"""The JSON Schemas of ``lutgen lint --json`` and ``lutgen merge --json``, beside this file (2020-12)."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from lutgen.errors import pick_one

#: What there is a schema of.
NAMES = tuple(sorted(each.name[:-5] for each in files(__name__).iterdir() if each.name.endswith(".json")))


def schema(name: str) -> dict[str, Any]:
    """Return the schema of a command's JSON. Raises LutgenError where ``name`` is none of ``NAMES``."""
    if name not in NAMES:
        raise pick_one("schema", name, NAMES)
    found: dict[str, Any] = json.loads(files(__name__).joinpath(f"{name}.json").read_text(encoding="utf-8"))
    return found
