"""Reading JSON and TOML of untrusted files: bounded depth, finite doubles and 64-bit integers only.

Python's own readers accept NaN, numbers too large for a double and integers of 4000 digits. A key of a hundred thousand
parts keeps ``tomllib`` busy for minutes.
"""

import json
import re
import tomllib
from collections.abc import Iterator
from math import isfinite
from typing import Any, NoReturn

from lutgen.cells import LONGEST

#: Maximum number of parts of a key, and maximum depth of nested tables and lists. No file of lutgen's needs ten.
DEEPEST = 50

#: Bound of integers: the 64-bit range, as TOML 1.0 defines it and as other JSON readers support it.
LARGEST = 2**63

#: A string, a comment, or one character that opens, closes or separates.
_MARK = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*"""|'
    r"'''(?:[^']|'(?!''))*'''|"
    r'"(?:[^"\\\n]|\\.)*"|'
    r"'[^'\n]*'|"
    r"#[^\n]*|"
    r"[\[\]{}.,=\n]",
    re.DOTALL,
)


def from_json(data: bytes | str) -> Any:
    """Read JSON. Raises ValueError for invalid JSON, NaN, and numbers that fit no double or 64-bit integer."""
    try:
        return json.loads(data, parse_constant=_refuse, parse_float=_double, parse_int=_integer)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def canonical_json(content: Any) -> str:
    """Write JSON for a hash: equal content gives equal text in any order of keys. Raises ValueError for NaN."""
    return json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def toml_text(text: str) -> str:
    """Quote a text for TOML. TOML accepts JSON strings, except an unescaped DEL character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def from_toml(text: str) -> dict[str, Any]:
    """Read TOML. Raises ValueError for invalid TOML, too deep nesting, or an integer of more than 64 bits."""
    if deepest(text) > DEEPEST:
        raise ValueError(f"it is nested more than {DEEPEST} deep")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, RecursionError):  # an integer of more than 4300 digits
        raise ValueError(f"it holds an integer beyond ±{LARGEST}") from None
    if any(isinstance(value, int) and not -LARGEST <= value < LARGEST for value in values_in(content)):
        raise ValueError(f"it holds an integer beyond ±{LARGEST}")
    return content


def deepest(text: str) -> int:
    """Return the larger of the nesting depth and the number of dots of the longest key, in one pass over the text."""
    largest = depth = parts = 0
    for match in _MARK.finditer(text):
        mark = match[0]
        if mark in ("[", "{"):
            depth += 1
        elif mark in ("]", "}"):
            depth = max(depth - 1, 0)
        parts = parts + 1 if mark == "." else parts if len(mark) > 1 else 0
        largest = max(largest, depth, parts)
    return largest


def values_in(content: Any) -> Iterator[Any]:
    """Yield every text, number, truth value and date of what ``from_json`` or ``from_toml`` returned."""
    if isinstance(content, dict | list):
        for each in content.values() if isinstance(content, dict) else content:
            yield from values_in(each)
    else:
        yield content


def _refuse(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number of JSON")


def _double(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"{text[:40]} is too large for a double")
    return value


def _integer(text: str) -> int:
    value = int(text) if len(text) <= LONGEST else LARGEST
    if not -LARGEST <= value < LARGEST:
        raise ValueError(f"{text[:40]} is beyond ±{LARGEST}")
    return value
