"""The JSON Schema of ``lutgen lint --json``, beside this file. One more file here is the schema of one more JSON."""

from __future__ import annotations

from typing import Any

from lutgen.schemas import read_schema, schema_names

#: What there is a schema of.
NAMES = schema_names(__name__)


def schema(name: str) -> dict[str, Any]:
    """Return the schema of a command's JSON. Raises LutgenError where ``name`` is none of ``NAMES``."""
    return read_schema(__name__, name)
