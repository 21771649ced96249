"""ICC profiles as LittleCMS applies them, in floating point. Pillow, GIMP and Java (and so QuPath) use LittleCMS.

An ordinary profile is treated as the profile of a picture. It is converted to an sRGB screen, relative to white. A
device link needs no second profile.

Whole-slide viewers convert with the slide's own profile, and a picture can have only one profile. The scanner's profile
and the aged display are therefore combined: scanner's code values → sRGB code values, relative to white as in viewers
and clipped as for a screen → aged display.
"""

import base64
import struct
import zlib
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.bake import icc_profile as icc
from lutgen.bindings import littlecms
from lutgen.colorimetry import Array
from lutgen.display import AgedDisplay
from lutgen.errors import LutgenError, in_one_line
from lutgen.files import read_at_most
from lutgen.icc_tags import is_profile, tag_table

#: ICC's rendering intents.
PERCEPTUAL, RELATIVE, SATURATION, ABSOLUTE = range(4)

#: Types of tables of version 2, and the offset of their byte with the number of points along an edge.
_TABLES, _POINTS_AT = (b"mft1", b"mft2"), 10

#: The table type of version 4, and the position of the offset of its table. The table's first byte is the number of
#: points along an edge.
_TABLE_V4, _TABLE_V4_AT = b"mAB ", 24


def through_profile(path: Path, code: Array, *, intent: int = RELATIVE) -> Array:
    """Convert code values (n, 3) with the profile ``path`` to an sRGB screen, by one of ICC's rendering intents.

    Raises LutgenError: the binding is missing, or LittleCMS refuses the file.
    """
    return screen_code(_read(path), code, path, intent=intent)


def screen_code(data: bytes, code: Array, file: object, *, intent: int = RELATIVE) -> Array:
    """Convert as :func:`through_profile`, with a profile in memory. ``file`` is named in errors."""
    lib = littlecms()
    screen = _identity_link() if data[12:16] == b"link" else _srgb()
    pixels = np.ascontiguousarray(code, dtype=np.float64).reshape(1, -1, 3)
    colours = {"colorspace": "rgb", "outcolorspace": "rgb", "outdtype": "float64"}
    try:
        shown = lib.cms_transform(pixels, data, screen, intent=intent, **colours)
    except (lib.CmsError, ValueError) as error:
        raise LutgenError(f"{file}: LittleCMS cannot use it: {in_one_line(error)}.") from None
    return np.asarray(shown[0], dtype=np.float64)


def table_of_profile(path: Path) -> tuple[str, int]:
    """Return the space (a key of ``SPACES``) and the size of a profile's table; size 0 without a table.

    Raises LutgenError: the profile is not valid.
    """
    data = _read(path)
    start = next((tag.start for tag in tag_table(data, path) if tag.name == "A2B0"), None)
    if start is None:
        return "linear", 0
    kind = data[start : start + 4]
    space = "code" if data[12:16] == b"link" else "lab" if kind == _TABLE_V4 else "lab-v2"
    if kind == _TABLE_V4:
        (place,) = struct.unpack_from(">I", data.ljust(start + 32, b"\0"), start + _TABLE_V4_AT)
        return space, data[start + place] if 0 < place < len(data) - start else 0
    return space, data[start + _POINTS_AT] if kind in _TABLES else 0


def _read(path: Path) -> bytes:
    data = path.read_bytes()
    sound_profile(data, path)
    return data


def sound_profile(data: bytes, file: object) -> None:
    """Raise LutgenError for a profile of another device than RGB, or with a wrong size in its header."""
    size = int.from_bytes(data[:4], "big")
    if is_profile(data) and size != len(data):
        raise LutgenError(f"{file}: says that it has {size} bytes, and has {len(data)}. Was it cut off? Copy it again.")
    tag_table(data, file)
    if data[16:20] != b"RGB ":
        device = data[16:20].decode("latin-1").strip()
        raise LutgenError(f"{file}: is for a device of {device!r}, and displays are RGB.")


@cache
def _srgb() -> bytes:
    profile: bytes = littlecms().cms_profile("srgb")
    return profile


@cache
def _identity_link() -> bytes:
    """Return an identity device link. The binding requires a second profile."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij")[::-1], axis=-1)
    tags = (
        (b"desc", icc.description("nothing")),
        (b"cprt", icc.text("none")),
        (b"pseq", icc.sequence("nothing")),
        (b"A2B0", icc.table(corners)),
    )
    return icc.profile(device_class=b"link", pcs=b"RGB ", tags=tags)


#: Maximum size of a profile in bytes. Profiles of scanners have some hundred thousand bytes.
LARGEST = 8 << 20

#: Classes of profiles that define the colours of a picture's code values.
_CLASSES = (b"scnr", b"mntr", b"spac")


@dataclass(frozen=True)
class SourceProfile:
    """A link before the first link of a display: code values of a picture → code values that a viewer sends."""

    name: str
    data: bytes = field(repr=False)
    stage: str = "drive"

    def __call__(self, signal: Array) -> Array:
        """Convert code values of the picture (n, 3) to code values of an sRGB screen (n, 3), 0..1."""
        return np.clip(screen_code(self.data, signal, self.name), 0.0, 1.0)

    def before(self, aged: AgedDisplay) -> AgedDisplay:
        """Return the display with the picture's profile before it."""
        return replace(aged, head=(self, *aged.head))

    def as_json(self) -> dict[str, str]:
        """Return the whole profile as JSON data, so that a build can be checked without the profile's file."""
        return {"file": self.name, "zlib_base64": base64.b64encode(zlib.compress(self.data, 9)).decode()}


def source_profile_of(content: Any) -> SourceProfile:
    """Return the profile that a manifest stores. Raises LutgenError when it is not valid."""
    try:
        decompressor = zlib.decompressobj()
        data = decompressor.decompress(base64.b64decode(content["zlib_base64"], validate=True), LARGEST)
        name = str(content["file"])
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        raise LutgenError(f"its source profile cannot be read ({error!r}). Build again.") from None
    return _checked_profile(name, data)


def read_source_profile(path: str | Path) -> SourceProfile:
    """Read the profile of a scanner or of a picture. Raises LutgenError when it does not define RGB colours."""
    path = Path(path)
    data = read_at_most(path, LARGEST, what="the source profile", none="ICC profile")
    return _checked_profile(path.name, data)


def _checked_profile(name: str, data: bytes) -> SourceProfile:
    sound_profile(data, name)
    if data[12:16] not in _CLASSES:
        kind = data[12:16].decode("latin-1")
        raise LutgenError(
            f"{name}: is a profile of class {kind!r}, which does not define a picture's colours. Give the scanner's "
            "profile."
        )
    source = SourceProfile(name, data)
    source(np.eye(3))
    return source


def source_profile_in(aged: AgedDisplay) -> SourceProfile | None:
    """Return the source profile before a display; None without one."""
    match aged.head:
        case (SourceProfile() as source, *_):
            return source
    return None
