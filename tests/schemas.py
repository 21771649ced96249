"""The published JSON Schemas by name, and validators for the output of commands."""

import json
from functools import cache
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

ROOT = Path(__file__).parents[1] / "lutgen"


@cache
def schemas() -> dict[str, dict[str, Any]]:
    """Return the schemas by the name in the identifier, such as ``compare`` or ``study-plan``."""
    contents = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(ROOT.glob("*/schema/*.json"))]
    return {str(content["$id"]).split(":")[3]: content for content in contents}


@cache
def validator(name: str) -> Draft202012Validator:
    """Return a validator for a schema, which may refer to other schemas."""
    known = Registry().with_resources((each["$id"], Resource.from_contents(each)) for each in schemas().values())
    return Draft202012Validator(schemas()[name], registry=known)
