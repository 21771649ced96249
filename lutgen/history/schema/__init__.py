"""The JSON Schemas of what the commands on sessions write with ``--json``, beside this file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lutgen.schemas import read_schema, schema_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.history.inspect import Inspection

#: What there is a schema of.
NAMES = schema_names(__name__)


def as_json(found: Sequence[Inspection]) -> dict[str, Any]:
    """Return what ``lutgen inspect --json`` writes of these sessions."""
    return {"schema": 1, "sessions": [each.as_json() for each in found]}


def schema(name: str) -> dict[str, Any]:
    """Return the schema of a command's JSON. Raises LutgenError where ``name`` is none of ``NAMES``."""
    return read_schema(__name__, name)
