"""JSON and TOML of files that may hold anything: bounded depth, and only numbers that a computer can hold.

Python's own readers take NaN, numbers beyond every double and integers of 4000 digits, and a key of a hundred thousand
parts keeps ``tomllib`` busy for minutes.
"""

from __future__ import annotations

import json
import re
import tomllib
from math import isfinite
from typing import TYPE_CHECKING, Any, NoReturn

from lutgen.cells import LONGEST

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Parts of a key, and tables and lists inside one another, at most: no file of lutgen's has ten.
DEEPEST = 50

#: Integers of TOML 1.0, and of JSON that others read too: those of 64 bits.
LARGEST = 2**63

#: A string, a comment, or one letter that nests or parts.
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
    """Read JSON. Raises ValueError for what is none, NaN, and numbers that no double or 64-bit integer holds."""
    try:
        return json.loads(data, parse_constant=_refuse, parse_float=_double, parse_int=_integer)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def canonical_json(content: Any) -> str:
    """Write JSON for a hash: the same content, in whatever order, gives the same text. Raises ValueError for NaN."""
    return json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def toml_text(text: str) -> str:
    """Quote a text for TOML, which takes JSON's strings, but no DEL in them."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def from_toml(text: str) -> dict[str, Any]:
    """Read TOML. Raises ValueError for what is none, is nested too deeply, or holds an integer beyond 64 bits."""
    if deepest(text) > DEEPEST:
        raise ValueError(f"it is nested more than {DEEPEST} deep")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, RecursionError):  # an integer of more than 4300 digits
        raise ValueError(f"it holds an integer beyond ±{LARGEST}") from None
    if any(isinstance(value, int) and not -LARGEST <= value < LARGEST for value in _values(content)):
        raise ValueError(f"it holds an integer beyond ±{LARGEST}")
    return content


def deepest(text: str) -> int:
    """Return how deep TOML is nested, and how many parts its longest key has, in one pass over the text."""
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


def _values(content: Any) -> Iterator[Any]:
    if isinstance(content, dict | list):
        for each in content.values() if isinstance(content, dict) else content:
            yield from _values(each)
    else:
        yield content


def _refuse(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number of JSON")


def _double(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"{text[:40]} is beyond every double")
    return value


def _integer(text: str) -> int:
    value = int(text) if len(text) <= LONGEST else LARGEST
    if not -LARGEST <= value < LARGEST:
        raise ValueError(f"{text[:40]} is beyond ±{LARGEST}")
    return value
