"""ICC profiles as LittleCMS applies them, in floating point: the library of Pillow, GIMP and Java (and so QuPath).

An ordinary profile is the picture's own, and the result is that of an sRGB screen, relative to white; a device link
defines both sides.
"""

from __future__ import annotations

import struct
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bindings import littlecms
from lutgen.errors import LutgenError, in_one_line
from lutgen.icc_tags import is_profile, tag_table

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array

#: ICC's rendering intents.
PERCEPTUAL, RELATIVE, SATURATION, ABSOLUTE = range(4)

#: Types of tables of version 2, and the byte that holds their number of points along an edge.
_TABLES = {b"mft1": 10, b"mft2": 10}

#: The type of version 4, and the byte that holds the offset of its table, whose first byte is the number of points.
_TABLE_V4, _TABLE_V4_AT = b"mAB ", 24


def through_profile(path: Path, code: Array, *, intent: int = RELATIVE) -> Array:
    """Send code values (n, 3) through the profile ``path`` to an sRGB screen, by one of ICC's intents.

    Raises LutgenError: the binding is missing, or LittleCMS refuses the file.
    """
    return screen_code(_read(path), code, path, intent=intent)


def screen_code(data: bytes, code: Array, file: object, *, intent: int = RELATIVE) -> Array:
    """As :func:`through_profile`, for a profile in memory; ``file`` is named in errors."""
    lib = littlecms()
    screen = _nothing_more() if data[12:16] == b"link" else _srgb()
    pixels = np.ascontiguousarray(code, dtype=np.float64).reshape(1, -1, 3)
    colours = {"colorspace": "rgb", "outcolorspace": "rgb", "outdtype": "float64"}
    try:
        shown = lib.cms_transform(pixels, data, screen, intent=intent, **colours)
    except (lib.CmsError, ValueError) as error:
        raise LutgenError(f"{file}: LittleCMS cannot use it: {in_one_line(error)}.") from None
    return np.asarray(shown[0], dtype=np.float64)


def table_of_profile(path: Path) -> tuple[str, int]:
    """Return how a profile's table is indexed and its size, 0 where it has none. Raises LutgenError."""
    data = _read(path)
    start = next((tag.start for tag in tag_table(data, path) if tag.name == "A2B0"), None)
    if start is None:
        return "linear", 0
    kind = data[start : start + 4]
    space = "code" if data[12:16] == b"link" else "lab" if kind == _TABLE_V4 else "lab-v2"
    if kind == _TABLE_V4:
        (place,) = struct.unpack_from(">I", data.ljust(start + 32, b"\0"), start + _TABLE_V4_AT)
        return space, data[start + place] if 0 < place < len(data) - start else 0
    size = _TABLES.get(kind)
    return space, data[start + size] if size else 0


def _read(path: Path) -> bytes:
    data = path.read_bytes()
    sound_profile(data, path)
    return data


def sound_profile(data: bytes, file: object) -> None:
    """Raise LutgenError for a profile of no RGB device, or with a wrong size in its header."""
    size = int.from_bytes(data[:4], "big")
    if is_profile(data) and size != len(data):
        raise LutgenError(f"{file}: says that it has {size} bytes, and has {len(data)}. Was it cut off? Copy it anew.")
    tag_table(data, file)
    if data[16:20] != b"RGB ":
        device = data[16:20].decode("latin-1").strip()
        raise LutgenError(f"{file}: is for a device of {device!r}, and displays are RGB.")


@cache
def _srgb() -> bytes:
    profile: bytes = littlecms().cms_profile("srgb")
    return profile


@cache
def _nothing_more() -> bytes:
    """A device link that changes nothing: the binding asks for a second profile."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij")[::-1], axis=-1)
    tags = (
        (b"desc", icc.description("nothing")),
        (b"cprt", icc.text("none")),
        (b"pseq", icc.sequence("nothing")),
        (b"A2B0", icc.table(corners)),
    )
    return icc.profile(device_class=b"link", pcs=b"RGB ", tags=tags)
