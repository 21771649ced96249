"""Damage that the image libraries miss or only print about: PNG's checksums, and metadata cut off a TIFF's end."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from pathlib import Path

#: Bytes of one value of each TIFF type (TIFF 6.0, section 2; 13: IFD; 16 to 18: BigTIFF).
_TIFF_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}


def is_whole(path: Path) -> bool:
    """Whether a file that begins as a PNG or TIFF is whole, as far as can be seen without decoding it."""
    with path.open("rb") as file:
        check = _png_is_whole if file.read(1) == b"\x89" else _tiff_is_whole
        file.seek(0)
        try:
            return check(file, path.stat().st_size)
        except struct.error:
            return False


def _png_is_whole(file: BinaryIO, size: int) -> bool:
    """Follow the chunks to the end, verifying their checksums; libpng prints what it dislikes."""
    file.seek(8)
    while file.tell() < size:
        head = file.read(8)
        (length,) = struct.unpack(">I", head[:4])
        if file.tell() + length + 4 > size:
            return False
        checksum, left = zlib.crc32(head[4:]), length
        while left:
            part = file.read(min(left, 1 << 20))
            checksum, left = zlib.crc32(part, checksum), left - len(part)
        if struct.unpack(">I", file.read(4)) != (checksum,):
            return False
        if head[4:] == b"IEND":
            return True
    return False


def _tiff_is_whole(file: BinaryIO, size: int) -> bool:
    """Look whether all that the first directory points to lies inside the file; libtiff drops what does not."""
    start = file.read(16)
    order = "<" if start[:2] == b"II" else ">"
    (version,) = struct.unpack(order + "H", start[2:4])
    # Offset of the directory, its number of entries, an entry's type, count and value or offset.
    big = version == 43
    where, number, entry = ("Q", "Q", "HHQQ") if big else ("I", "H", "HHII")
    (offset,) = struct.unpack_from(order + where, start, 8 if big else 4)
    file.seek(offset)
    (entries,) = struct.unpack(order + number, file.read(struct.calcsize(order + number)))
    length = struct.calcsize(order + entry)
    if file.tell() + entries * length > size:
        return False
    for _tag, kind, count, value in struct.iter_unpack(order + entry, file.read(entries * length)):
        bytes_ = count * _TIFF_SIZES.get(kind, 0)
        if bytes_ > struct.calcsize(where) and value + bytes_ > size:
            return False
    return True
