"""Writing TOML 1.0: the few kinds of value that a model file holds, numbers exactly, and comments.

Python reads TOML and does not write it, and the packages that do leave no comments.
"""

from __future__ import annotations

import json
import re
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

#: Keys that need no quotes.
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def value_text(value: Any) -> str:
    """Write a text, number (numpy's too), truth value, or list of them."""
    if isinstance(value, str):
        # JSON's escapes are TOML's; JSON lets DEL stand, TOML does not.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Integral):
        return repr(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    return f"[{', '.join(map(value_text, value))}]"


def key_text(key: str) -> str:
    """Write a key."""
    return key if _BARE.fullmatch(key) else value_text(key)


def table_lines(head: str, values: Mapping[str, Any], comments: Mapping[str, str] | None = None) -> list[str]:
    """Write a table: its head, one line a key, with the comments that are given; keys whose value is None are left out.

    A list of lists takes one line a row.
    """
    lines = [head] if head else []
    for key, value in values.items():
        if value is None:
            continue
        comment = f"  # {(comments or {})[key]}" if comments and key in comments else ""
        if isinstance(value, list) and value and isinstance(value[0], list):
            lines += [f"{key_text(key)} = [{comment}", *(f"  {value_text(row)}," for row in value), "]"]
        else:
            lines.append(f"{key_text(key)} = {value_text(value)}{comment}")
    return lines


def document(parts: Iterable[list[str]]) -> bytes:
    """Join tables, an empty line between them."""
    return ("\n\n".join("\n".join(part) for part in parts if part) + "\n").encode()
