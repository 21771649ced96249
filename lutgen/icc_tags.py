"""The tag table of an ICC profile (ICC.1:2022, 7.3), with bounds on the counts and sizes that it states, and its ID."""

import hashlib
import struct
from collections.abc import Iterator
from typing import NamedTuple

from lutgen.errors import LutgenError

HEADER = 128

#: Maximum number of tags of a profile. LittleCMS refuses more. Usual profiles have 10 to 20.
MOST_TAGS = 100

#: Minimum size of a tag in bytes: its type, four reserved bytes and its content.
SMALLEST_TAG = 12


class Tag(NamedTuple):
    """A row of the tag table: the tag's signature, and the offset and size of its data in the file, in bytes."""

    name: str
    start: int
    size: int


def is_profile(data: bytes) -> bool:
    """Whether a file that begins with these bytes is an ICC profile."""
    return data[36:40] == b"acsp"


def identifier(data: bytes) -> bytes:
    """Return the ID of a profile: its MD5, computed with 0 for flags, intent and ID (ICC.1:2022, 7.2.18)."""
    blank = b"".join((data[:44], bytes(4), data[48:64], bytes(4), data[68:84], bytes(16), data[100:]))
    return hashlib.md5(blank, usedforsecurity=False).digest()


def tags_claimed(data: bytes) -> Iterator[Tag]:
    """Yield the rows of the tag table in the first bytes of a profile, at most ``MOST_TAGS``, without checking them."""
    if len(data) < HEADER + 4:
        return
    (count,) = struct.unpack_from(">I", data, HEADER)
    for row in range(min(count, MOST_TAGS, (len(data) - HEADER - 4) // 12)):
        name, start, size = struct.unpack_from(">4sII", data, HEADER + 4 + 12 * row)
        yield Tag(name.decode("latin-1"), start, size)


def tag_table(data: bytes, file: object) -> tuple[Tag, ...]:
    """Return the tags of a whole profile, after a check that each tag lies in the file. ``file`` is named in errors.

    Raises LutgenError: the data is no profile, or its tag table is wrong.
    """
    if len(data) < HEADER + 4 or not is_profile(data):
        raise LutgenError(f"{file}: is no ICC profile: it has {len(data)} bytes and not ICC's signature.")
    (count,) = struct.unpack_from(">I", data, HEADER)
    if count > MOST_TAGS or HEADER + 4 + 12 * count > len(data):
        raise LutgenError(
            f"{file}: claims {count} tags: more than {MOST_TAGS}, or more than fit in the file. Copy it again."
        )
    tags = tuple(tags_claimed(data))
    for tag in tags:
        if tag.start + tag.size > len(data) or tag.size < SMALLEST_TAG:
            wrong = f"lies outside the file, or has fewer than {SMALLEST_TAG} bytes"
            raise LutgenError(f"{file}: its tag {tag.name!r} {wrong}. Copy it again.")
    return tags
