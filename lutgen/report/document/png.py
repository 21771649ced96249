"""Small PNG files in memory, the same bytes on every run: ISO/IEC 15948, 8 bits, RGB, RGBA or a palette."""

from __future__ import annotations

import zlib
from struct import pack
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Colour types of the header.
_RGB, _PALETTE, _RGBA = 2, 3, 6


def png(pixels: NDArray[np.uint8], palette: NDArray[np.uint8] | None = None) -> bytes:
    """Encode RGB or RGBA (h, w, 3 or 4), or with a ``palette`` (n, 3) its indices (h, w); colours are sRGB."""
    height, width = pixels.shape[:2]
    kind = _PALETTE if palette is not None else {3: _RGB, 4: _RGBA}[pixels.shape[2]]
    # Indices are no amounts: differences of them compress no better.
    rows = pixels.reshape(height, -1)
    lines = _unfiltered(rows) if palette is not None else _filtered(rows, pixels.shape[2])
    chunks = [
        (b"IHDR", pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)),
        (b"sRGB", b"\0"),
        *([(b"PLTE", palette.tobytes())] if palette is not None else []),
        (b"IDAT", zlib.compress(lines, 9)),
        (b"IEND", b""),
    ]
    return _SIGNATURE + b"".join(
        pack(">I", len(data)) + name + data + pack(">I", zlib.crc32(name + data)) for name, data in chunks
    )


def _unfiltered(rows: NDArray[np.uint8]) -> bytes:
    return np.pad(rows, ((0, 0), (1, 0))).tobytes()


def _filtered(rows: NDArray[np.uint8], step: int) -> bytes:
    """Filter each row in the way that leaves the smallest differences (the specification's own rule, 12.7)."""
    here = rows.astype(np.int16)
    left = np.pad(here, ((0, 0), (step, 0)))[:, :-step]
    above = np.pad(here, ((1, 0), (0, 0)))[:-1]
    corner = np.pad(above, ((0, 0), (step, 0)))[:, :-step]
    guesses: list[Any] = [0, left, above, (left + above) // 2, _paeth(left, above, corner)]
    found = np.stack([(here - guess).astype(np.uint8) for guess in guesses])
    best = np.abs(found.view(np.int8).astype(np.int16)).sum(axis=2, dtype=np.int64).argmin(axis=0)
    chosen = found[best, np.arange(len(rows))]
    return np.concatenate([best[:, np.newaxis].astype(np.uint8), chosen], axis=1).tobytes()


def _paeth(left: Any, above: Any, corner: Any) -> Any:
    guess = left + above - corner
    far = [np.abs(guess - each) for each in (left, above, corner)]
    upper = np.where(far[1] <= far[2], above, corner)
    return np.where((far[0] <= far[1]) & (far[0] <= far[2]), left, upper)
