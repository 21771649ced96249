"""Animated PNG (PNG Third Edition, https://www.w3.org/TR/png-3/), frame by frame, the same bytes on every run.

Programs that know no animation show the first frame.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from lutgen.appearance.png import KIND, SIGNATURE, chunk, packed

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from lutgen.report.drawing.grey_page import Pixels


def write_apng(frames: Iterable[Pixels], count: int, seconds: float, path: Path) -> None:
    """Write ``count`` frames, uint8 of one shape (h, w, 3), each shown for so many seconds, again and again."""
    delay = (max(round(1000 * seconds), 1), 1000)
    sequence = 0
    with path.open("wb") as file:
        file.write(SIGNATURE)
        for number, frame in enumerate(frames):
            size = (frame.shape[1], frame.shape[0])
            if number == 0:
                file.write(chunk(b"IHDR", struct.pack(">2I", *size) + KIND))
                file.write(chunk(b"sRGB", b"\0"))
                file.write(chunk(b"acTL", struct.pack(">2I", count, 0)))
            file.write(chunk(b"fcTL", struct.pack(">5I2H2B", sequence, *size, 0, 0, *delay, 0, 0)))
            data = packed(frame)
            file.write(chunk(b"IDAT", data) if number == 0 else chunk(b"fdAT", struct.pack(">I", sequence + 1) + data))
            sequence += 1 if number == 0 else 2
        file.write(chunk(b"IEND", b""))
