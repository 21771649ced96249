"""The JSON Schemas of what the commands on pictures write with ``--json``, beside this file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lutgen.display import what_pictures_carry
from lutgen.schemas import read_schema, schema_names

if TYPE_CHECKING:
    from lutgen.display import DisplayModel

#: What there is a schema of.
NAMES = schema_names(__name__)


def seen_on(model: DisplayModel) -> dict[str, Any]:
    """Return what the JSON of every command on pictures says of the display: display, model, remarks."""
    return {
        "display": {"file": model.measurements.file, "sha256": model.measurements.sha256},
        "model": model.file or None,
        "remarks": what_pictures_carry(model),
    }


def schema(name: str) -> dict[str, Any]:
    """Return the schema of a command's JSON. Raises LutgenError where ``name`` is none of ``NAMES``."""
    return read_schema(__name__, name)
