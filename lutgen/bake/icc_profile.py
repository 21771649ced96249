"""Writing ICC profiles: the few tags that a display profile and a device link need.

Version 2.4 (ICC.1:2001-04) is read by every viewer. Version 4.3 (ICC.1:2010) is needed because Chromium and Firefox
decode tables of L*a*b* with version 4's encoding, even in profiles of version 2. No maintained Python library writes
profiles with tables. LittleCMS writes them, but its Python bindings do not. This module therefore writes the bytes
itself, and LittleCMS reads them back.
"""

import struct
from collections.abc import Sequence
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.spaces import D50, D65_TO_D50
from lutgen.colorimetry import Array, code_to_linear
from lutgen.icc_tags import HEADER, identifier

LARGEST = 65_535

#: Points of the curves beside a matrix, as in common sRGB profiles.
TONE_POINTS = 1024

#: Version → its number in the header.
_VERSIONS = {2: 0x02400000, 4: 0x04300000}

#: The date in the header. It is fixed, so that the same inputs give the same file.
_DATE = struct.pack(">6H", 2000, 1, 1, 0, 0, 0)


def profile(*, device_class: bytes, pcs: bytes, tags: Sequence[tuple[bytes, bytes]], version: int = 2) -> bytes:
    """Return a profile of an RGB device from its class, its connection space and its tags (signature, content).

    Tags with equal content share one copy in the file. ``version`` is 2 or 4. The tags must be of that version.
    """
    contents = list(dict.fromkeys(content for _, content in tags))
    padded = [content + bytes(-len(content) % 4) for content in contents]
    start = HEADER + 4 + 12 * len(tags)
    places = dict(zip(contents, accumulate(map(len, padded), initial=start), strict=False))
    table = b"".join(name + struct.pack(">II", places[content], len(content)) for name, content in tags)
    body = struct.pack(">I", len(tags)) + table + b"".join(padded)
    head = struct.pack(">I4xI", HEADER + len(body), _VERSIONS[version]) + device_class + b"RGB " + pcs
    # Intent 1 is relative colorimetric.
    head += _DATE + b"acsp" + bytes(24) + struct.pack(">I", 1) + _fixed(D50) + bytes(48)
    return b"".join((head[:84], identifier(head + body), head[100:], body))


def display_tags(
    title: str, lines: Sequence[str], colorants: Array, version: int = 2
) -> tuple[tuple[bytes, bytes], ...]:
    """Return the tags of every display profile: its texts, D50 as white, the sRGB curve, and the matrix after it.

    ``colorants``: XYZ under D50 of full red, green and blue, one per row, shape (3, 3).
    """
    tone = curve(code_to_linear(np.linspace(0.0, 1.0, TONE_POINTS)))
    return (
        (b"desc", description(title) if version == 2 else localized(title)),
        (b"cprt", text("none") if version == 2 else localized("none")),
        (b"targ", text("\n".join(lines))),
        (b"wtpt", xyz(D50)),
        (b"chad", matrix(D65_TO_D50)),
        *((name, xyz(colorant)) for name, colorant in zip((b"rXYZ", b"gXYZ", b"bXYZ"), colorants, strict=True)),
        *((name, tone) for name in (b"rTRC", b"gTRC", b"bTRC")),
    )


def _fixed(values: Array) -> bytes:
    """Pack s15Fixed16 numbers."""
    return np.rint(np.asarray(values).ravel() * 65_536).astype(">i4").tobytes()


def description(words: str) -> bytes:
    """Pack textDescriptionType with its ASCII text. The Unicode and ScriptCode texts stay empty."""
    ascii_text = _ascii(words)
    return b"desc" + struct.pack(">4xI", len(ascii_text)) + ascii_text + bytes(4 + 4 + 2 + 1 + 67)


def localized(words: str) -> bytes:
    """Pack multiLocalizedUnicodeType of one text (ICC.1:2010, 10.13), the type of descriptions in version 4."""
    data = words.encode("utf-16-be")
    return b"mluc" + struct.pack(">4xII4sII", 1, 12, b"enUS", len(data), 28) + data


def text(words: str) -> bytes:
    """Pack textType."""
    return b"text" + bytes(4) + _ascii(words)


def _ascii(words: str) -> bytes:
    # Escape non-ASCII letters, so that a name in another script is not lost.
    return words.encode("ascii", errors="backslashreplace").replace(b"\0", b" ") + b"\0"


def xyz(values: Array) -> bytes:
    """Pack XYZType of one triplet."""
    return b"XYZ " + bytes(4) + _fixed(values)


def matrix(values: Array) -> bytes:
    """Pack s15Fixed16ArrayType."""
    return b"sf32" + bytes(4) + _fixed(values)


def curve(values: Array) -> bytes:
    """Pack curveType from evenly spaced points 0..1. An empty curve is the identity."""
    return b"curv" + struct.pack(">4xI", len(values)) + steps(values).tobytes()


def table(values: Array) -> bytes:
    """Pack lut16Type from RGB with identity curves: values 0..1, shape (n, n, n, 3), axes blue, green, red."""
    straight = steps(np.tile([0.0, 1.0], 3)).tobytes()
    head = b"mft2" + struct.pack(">4xBBBx", 3, 3, len(values)) + _fixed(np.eye(3)) + struct.pack(">HH", 2, 2)
    # The format requires that red varies slowest.
    return b"".join((head, straight, steps(values.transpose(2, 1, 0, 3)).tobytes(), straight))


def table_to_lab(values: Array) -> bytes:
    """Pack version 4's lutAToBType (ICC.1:2010, 10.10) from RGB as :func:`table`, without matrix and M curves."""
    straight = curve(np.zeros(0)) * 3
    clut = bytes([len(values)] * 3 + [0] * 13 + [2, 0, 0, 0]) + steps(values.transpose(2, 1, 0, 3)).tobytes()
    clut += bytes(-len(clut) % 4)
    start = 32
    offsets = struct.pack(">5I", start, 0, 0, start + len(straight), start + len(straight) + len(clut))
    return b"".join((b"mAB " + bytes(4) + bytes([3, 3, 0, 0]), offsets, straight, clut, straight))


def sequence(*words: str) -> bytes:
    """Pack profileSequenceDescType: the source and the target of a device link."""
    each = (bytes(20) + description("") + description(word) for word in words)
    return b"pseq" + struct.pack(">4xI", len(words)) + b"".join(each)


def steps(values: Array) -> NDArray[np.uint16]:
    """Quantise 0..1 to 16 bit, big-endian."""
    return np.rint(np.asarray(values) * LARGEST).astype(">u2")
