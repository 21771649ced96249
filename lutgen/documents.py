"""JSON, TOML and ICC profiles of files that may hold anything: bounded, whatever their numbers claim.

Python's own readers take NaN, numbers beyond every double and integers of 4000 digits, and a key of a hundred thousand
parts keeps ``tomllib`` busy for minutes. Of an ICC profile the tag table is read (ICC.1:2022, 7.3).
"""

from __future__ import annotations

import json
import re
import struct
import tomllib
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from lutgen.cells import LONGEST
from lutgen.errors import LutgenError

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


HEADER = 128

#: Tags of a profile, at most: LittleCMS refuses more, and profiles have 10 to 20.
MOST_TAGS = 100

#: Least bytes of a tag: its type, four reserved bytes, and one byte of content.
SMALLEST_TAG = 12


class Tag(NamedTuple):
    """A row of the table: the tag's signature, and which bytes of the file it claims."""

    name: str
    start: int
    size: int


def is_profile(data: bytes) -> bool:
    """Whether a file that begins with these bytes is an ICC profile."""
    return data[36:40] == b"acsp"


def tags_claimed(data: bytes) -> Iterator[Tag]:
    """Yield the rows of the table that the first bytes of a profile hold, ``MOST_TAGS`` at most, believing none."""
    if len(data) < HEADER + 4:
        return
    (count,) = struct.unpack_from(">I", data, HEADER)
    for row in range(min(count, MOST_TAGS, (len(data) - HEADER - 4) // 12)):
        name, start, size = struct.unpack_from(">4sII", data, HEADER + 4 + 12 * row)
        yield Tag(name.decode("latin-1"), start, size)


def tag_table(data: bytes, file: object) -> tuple[Tag, ...]:
    """Return the tags of a whole profile, all of which lie in it; ``file`` is named in errors.

    Raises LutgenError: it is no profile, or its table lies.
    """
    if len(data) < HEADER + 4 or not is_profile(data):
        raise LutgenError(f"{file}: is no ICC profile: it has {len(data)} bytes and not ICC's signature.")
    (count,) = struct.unpack_from(">I", data, HEADER)
    if count > MOST_TAGS or HEADER + 4 + 12 * count > len(data):
        raise LutgenError(f"{file}: claims {count} tags: more than {MOST_TAGS}, or than its bytes hold. Copy it anew.")
    tags = tuple(tags_claimed(data))
    for tag in tags:
        if tag.start + tag.size > len(data) or tag.size < SMALLEST_TAG:
            raise LutgenError(f"{file}: its tag {tag.name!r} lies outside the file. Copy it anew.")
    return tags
