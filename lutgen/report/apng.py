"""Animated PNG (PNG Third Edition, https://www.w3.org/TR/png-3/), frame by frame, the same bytes on every run.

Programs that know no animation show the first frame.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from lutgen.report.grey_page import Pixels

_SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Eight bits a channel, RGB; deflate, adaptive filters, not interlaced.
_KIND = bytes((8, 2, 0, 0, 0))

#: The filter of every row: Paeth's, the best single one for photographs.
_PAETH = 4


def write_apng(frames: Iterable[Pixels], count: int, seconds: float, path: Path) -> None:
    """Write ``count`` frames, uint8 of one shape (h, w, 3), each shown for so many seconds, again and again."""
    delay = (max(round(1000 * seconds), 1), 1000)
    sequence = 0
    with path.open("wb") as file:
        file.write(_SIGNATURE)
        for number, frame in enumerate(frames):
            size = (frame.shape[1], frame.shape[0])
            if number == 0:
                file.write(_chunk(b"IHDR", struct.pack(">2I", *size) + _KIND))
                file.write(_chunk(b"sRGB", b"\0"))
                file.write(_chunk(b"acTL", struct.pack(">2I", count, 0)))
            file.write(_chunk(b"fcTL", struct.pack(">5I2H2B", sequence, *size, 0, 0, *delay, 0, 0)))
            data = zlib.compress(_filtered(frame), 6)
            file.write(
                _chunk(b"IDAT", data) if number == 0 else _chunk(b"fdAT", struct.pack(">I", sequence + 1) + data)
            )
            sequence += 1 if number == 0 else 2
        file.write(_chunk(b"IEND", b""))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _filtered(frame: Pixels) -> bytes:
    """Rows less what Paeth's predictor says of them (section 9.4), each behind the filter's number."""
    padded = np.pad(frame.astype(np.int16), ((1, 0), (1, 0), (0, 0)))
    left, above, corner = padded[1:, :-1], padded[:-1, 1:], padded[:-1, :-1]
    guess = left + above - corner
    off_left, off_above, off_corner = (np.abs(guess - each) for each in (left, above, corner))
    predicted = np.where(
        (off_left <= off_above) & (off_left <= off_corner), left, np.where(off_above <= off_corner, above, corner)
    )
    rows = np.empty((frame.shape[0], 1 + frame.shape[1] * 3), np.uint8)
    rows[:, 0] = _PAETH
    rows[:, 1:] = (frame - predicted).astype(np.uint8).reshape(frame.shape[0], -1)
    return rows.tobytes()
