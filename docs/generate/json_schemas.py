"""reference/json.md: the output of ``--json``, from the published schemas."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import lutgen
from docs.generate.commands import commands
from docs.generate.markup import anchor, inline, page, table

#: A table shows nested objects down to this depth; for deeper objects the page refers to the schema.
DEPTH = 4


def pages() -> dict[str, str]:
    """Return path below docs/reference → text."""
    schemas = _schemas()
    helps = {name: each.get_short_help_str(limit=1000) for name, each in commands().items()}
    rows = [(f"[`{name} --json`](#{anchor(name)})", _about(name, each, helps)) for name, (_, each) in schemas.items()]
    sections = [_section(name, file, schema) for name, (file, schema) in schemas.items()]
    intro = (
        "What commands write with `--json`, by their schemas (JSON Schema 2020-12), which the package holds and tests "
        "keep to the output. A key may be added under the same version; a key that is removed or changes its meaning "
        "raises `schema`. A dot is a key within an object, `[]` each item of a list, `*` any key."
    )
    return {"json.md": page("JSON", intro, table(("output of", "what it is"), rows), *sections)}


def _about(name: str, schema: dict[str, Any], helps: dict[str, str]) -> str:
    """Return the description of the output: from the schema, or else from the help of its command."""
    command = name.removeprefix("lutgen ").rstrip(" 0123456789")
    return inline(schema.get("description") or helps[command])


def _schemas() -> dict[str, tuple[str, dict[str, Any]]]:
    """Return title → the path of the schema's file from the repository's root, and the schema."""
    home = Path(lutgen.__file__).parent
    schemas = {}
    for path in sorted(home.rglob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        if str(content.get("$id", "")).startswith("urn:lutgen:schema:"):
            schemas[content["title"].removesuffix(" --json")] = path.relative_to(home.parent).as_posix(), content
    return dict(sorted(schemas.items()))


def _section(name: str, file: str, schema: dict[str, Any]) -> str:
    rows = [row for key, each in _keys(schema) for row in _rows(key, each, key_required=key in _required(schema))]
    whole = [_title(each["$ref"]) for each in schema.get("allOf", []) if "$ref" in each]
    also = [f"All of [{title}](#{anchor(title)}), and:" for title in whole]
    parts = [
        f"## {name}",
        inline(schema.get("description", "")),
        " ".join([f"Schema: `{file}`.", *also]),
        table(("key", "type", "meaning"), rows) if rows else "",
    ]
    for title, each in schema.get("$defs", {}).items():
        below = [row for key, value in _keys(each) for row in _rows(key, value, key_required=key in _required(each))]
        if below:
            parts += [f"*{title}*: {inline(each.get('description', ''))}", table(("key", "type", "meaning"), below)]
        elif "enum" in each:
            parts.append(f"*{title}*: {_type(each)}")
    return "\n\n".join(part for part in parts if part)


def _keys(schema: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    more = schema.get("additionalProperties")
    return [*schema.get("properties", {}).items(), *([("*", more)] if isinstance(more, dict) else [])]


def _required(schema: dict[str, Any]) -> list[str]:
    required: list[str] = schema.get("required", [])
    return required


def _rows(key: str, schema: dict[str, Any], *, key_required: bool, depth: int = 1) -> list[tuple[str, str, str]]:
    text = inline(schema.get("description", ""))
    rows = [(f"`{key}`", _type(schema), text if key_required or key.endswith("*") else f"{text} Optional.".strip())]
    if depth < DEPTH:
        inner, suffix = (schema["items"], "[]") if isinstance(schema.get("items"), dict) else (schema, "")
        for name, each in _keys(inner):
            rows += _rows(f"{key}{suffix}.{name}", each, key_required=name in _required(inner), depth=depth + 1)
    return rows


def _type(schema: dict[str, Any]) -> str:
    if "$ref" in schema:
        return f"*{_shown(schema['$ref'])}*"
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(each)}`" for each in schema["enum"])
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    for choice in ("anyOf", "oneOf"):
        if choice in schema:
            return " or ".join(_type(each) for each in schema[choice])
    kind = schema.get("type", "any")
    words = " or ".join(kind) if isinstance(kind, list) else str(kind)
    if isinstance(schema.get("items"), dict):
        words += f" of {_type(schema['items'])}"
    limits = [f"{sign} {schema[name]:g}" for name, sign in _LIMITS.items() if name in schema]
    return f"{words} ({', '.join(limits)})" if limits else words


_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


def _shown(reference: str) -> str:
    return reference.rpartition("/")[2] if "#/$defs/" in reference else _title(reference)


def _title(reference: str) -> str:
    name = reference.removeprefix("urn:lutgen:schema:").partition(":")[0].replace("-", " ")
    return f"lutgen {name}"
