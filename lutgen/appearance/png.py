"""Plain PNG (PNG Third Edition, https://www.w3.org/TR/png-3/): pixels and nothing else, the same bytes everywhere.

What image libraries add (gamma, chromaticities, resolution, texts) differs from one to the next, and changes how some
programs show the picture.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

#: Pixels, uint8 of shape (height, width, 3).
Pixels = NDArray[np.uint8]

SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Eight bits a channel, RGB; deflate, adaptive filters, not interlaced.
KIND = bytes((8, 2, 0, 0, 0))

#: How hard zlib tries.
LEVEL = 6

#: The filter of every row: Paeth's, the best single one for photographs.
_PAETH = 4


def plain_png(pixels: Pixels) -> bytes:
    """Return the PNG of pixels, uint8 of shape (height, width, 3): header, pixels, end."""
    size = struct.pack(">2I", pixels.shape[1], pixels.shape[0])
    return SIGNATURE + chunk(b"IHDR", size + KIND) + chunk(b"IDAT", packed(pixels)) + chunk(b"IEND", b"")


def chunk(kind: bytes, data: bytes) -> bytes:
    """Return a chunk: length, kind, data, checksum (section 5.3)."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def packed(pixels: Pixels) -> bytes:
    """Compress rows less what Paeth's predictor says of them (section 9.4), each behind the filter's number."""
    padded = np.pad(pixels.astype(np.int16), ((1, 0), (1, 0), (0, 0)))
    left, above, corner = padded[1:, :-1], padded[:-1, 1:], padded[:-1, :-1]
    guess = left + above - corner
    off_left, off_above, off_corner = (np.abs(guess - each) for each in (left, above, corner))
    predicted = np.where(
        (off_left <= off_above) & (off_left <= off_corner), left, np.where(off_above <= off_corner, above, corner)
    )
    rows = np.empty((pixels.shape[0], 1 + pixels.shape[1] * 3), np.uint8)
    rows[:, 0] = _PAETH
    rows[:, 1:] = (pixels - predicted).astype(np.uint8).reshape(pixels.shape[0], -1)
    return zlib.compress(rows.tobytes(), LEVEL)
