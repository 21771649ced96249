"""Animated PNG (PNG Third Edition, https://www.w3.org/TR/png-3/), frame by frame, the same bytes on every run.

Programs that know no animation show the first frame. Pillow compresses each frame; its own writer of animations would
hold all frames in memory at once.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from lutgen.report.drawing.grey_page import Pixels

SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Eight bits a channel, RGB; deflate, adaptive filters, not interlaced.
KIND = bytes((8, 2, 0, 0, 0))


def write_apng(frames: Iterable[Pixels], count: int, seconds: float, path: Path) -> None:
    """Write ``count`` frames, uint8 of one shape (h, w, 3), each shown for so many seconds, again and again."""
    from PIL.PngImagePlugin import putchunk

    delay = (max(round(1000 * seconds), 1), 1000)
    sequence = 0
    with path.open("wb") as file:
        file.write(SIGNATURE)
        for number, frame in enumerate(frames):
            size = (frame.shape[1], frame.shape[0])
            if number == 0:
                putchunk(file, b"IHDR", struct.pack(">2I", *size) + KIND)
                putchunk(file, b"sRGB", b"\0")
                putchunk(file, b"acTL", struct.pack(">2I", count, 0))
            putchunk(file, b"fcTL", struct.pack(">5I2H2B", sequence, *size, 0, 0, *delay, 0, 0))
            data = _compressed(frame)
            if number == 0:
                putchunk(file, b"IDAT", data)
            else:
                putchunk(file, b"fdAT", struct.pack(">I", sequence + 1), data)
            sequence += 1 if number == 0 else 2
        putchunk(file, b"IEND", b"")


def _compressed(frame: Pixels) -> bytes:
    """Return what the image data of a frame's own PNG would be."""
    from PIL import Image
    from PIL.PngImagePlugin import getchunks

    return b"".join(data for kind, data, _checksum in getchunks(Image.fromarray(frame)) if kind == b"IDAT")
