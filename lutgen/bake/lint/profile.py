"""Reading anybody's ICC profile: header, tag table, the heads of its tables, and what LittleCMS makes of white."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.bake.littlecms import through_profile
from lutgen.bindings import LARGEST_LUT, littlecms
from lutgen.errors import LutgenError
from lutgen.icc_tags import HEADER, MOST_TAGS, Tag, is_profile, tags_claimed

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array

#: Tags of tables from the device's colours; a device link has the first alone.
TABLES = ("A2B0", "A2B1", "A2B2")

#: Bytes of an 8-bit and a 16-bit table before its curves (ICC.1:2022, 10.10 and 10.11), and bytes of a number.
_HEADS = {b"mft1": (48, 1), b"mft2": (52, 2)}


class TableHead(NamedTuple):
    """What a table of type mft1 or mft2 says of itself, and the bytes that it would need for that."""

    tag: Tag
    inputs: int
    outputs: int
    points: int
    needs: int


@dataclass(frozen=True)
class ProfileScan:
    """A profile as it stands.

    Attributes
    ----------
    length, head
        Bytes that it has, and the first 128 of them.
    count, tags
        Tags that its table claims, and those that are read: ``MOST_TAGS`` at most.
    tables
        Its tables of the older types, as far as they lie in the file.
    identifier
        Whether the MD5 in its header is its own; None where it has none.
    white
        Code values on an sRGB screen of code 1, 1, 1, by LittleCMS in floating point; None where it gives none.
    unasked
        Why LittleCMS could not be asked; empty where it was.

    """

    path: Path
    length: int
    head: bytes
    count: int
    tags: tuple[Tag, ...]
    tables: tuple[TableHead, ...]
    identifier: bool | None
    white: Array | None
    unasked: str = ""

    @property
    def size(self) -> int:
        """Bytes that it says it has."""
        return int.from_bytes(self.head[:4], "big")

    @property
    def version(self) -> tuple[int, int]:
        """Its version, as 2, 4."""
        return (self.head[8], self.head[9] >> 4) if len(self.head) >= 10 else (0, 0)

    def word(self, start: int) -> str:
        """Four letters of the header."""
        return self.head[start : start + 4].decode("latin-1")

    @property
    def link(self) -> bool:
        """Whether it is a device link."""
        return self.word(12) == "link"

    def has(self, *names: str) -> bool:
        """Whether all these tags are in the table and lie in the file."""
        return set(names) <= {tag.name for tag in self.tags if tag.start + tag.size <= self.length}


def scan_profile(path: Path) -> ProfileScan:
    """Read header, table and the heads of tables; larger files than any profile no further.

    Raises
    ------
    LutgenError
        The file cannot be read.

    """
    try:
        with path.open("rb") as file:
            start = file.read(HEADER + 4 + 12 * MOST_TAGS)
            size = path.stat().st_size
            tags = tuple(tags_claimed(start))
            heads = []
            for tag in tags:
                if tag.name in TABLES and tag.start < size:
                    file.seek(tag.start)
                    heads.append((tag, file.read(_HEADS[b"mft2"][0])))
            whole = size <= LARGEST_LUT and is_profile(start)
            file.seek(0)
            identifier = _identifier(file.read()) if whole else None
    except OSError as error:
        message = f"{path}: cannot be read: {(error.strerror or str(error)).lower()}. Give the name of a profile."
        raise LutgenError(message) from None
    tables = tuple(found for tag, head in heads if (found := _table(tag, head)))
    count = int.from_bytes(start[HEADER : HEADER + 4], "big")
    white, unasked = _white(path) if whole and count <= MOST_TAGS else (None, "")
    return ProfileScan(path, size, start[:HEADER], count, tags, tables, identifier, white, unasked)


def _identifier(data: bytes) -> bool | None:
    """Whether the MD5 is that of the profile with flags, intent and the MD5 left 0 (ICC.1:2022, 7.2.18)."""
    if not any(data[84:100]):
        return None
    blank = b"".join((data[:44], bytes(4), data[48:64], bytes(4), data[68:84], bytes(16), data[100:]))
    return hashlib.md5(blank, usedforsecurity=False).digest() == data[84:100]


def _table(tag: Tag, head: bytes) -> TableHead | None:
    if head[:4] not in _HEADS or len(head) < _HEADS[head[:4]][0]:
        return None
    start, width = _HEADS[head[:4]]
    inputs, outputs, points = head[8:11]
    curves = [256, 256] if width == 1 else [int.from_bytes(head[place : place + 2], "big") for place in (48, 50)]
    numbers = inputs * curves[0] + points**inputs * outputs + outputs * curves[1]
    return TableHead(tag, inputs, outputs, points, start + width * numbers)


def _white(path: Path) -> tuple[Array | None, str]:
    try:
        littlecms()
    except LutgenError as error:
        return None, str(error)
    try:
        white: Array = through_profile(path, np.ones((1, 3)))[0]
    except LutgenError:
        return None, ""
    return (white if np.isfinite(white).all() else None), ""
