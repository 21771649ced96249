"""Fixed-point text of large tables, computed as bytes: the ``%.7f`` of a whole array in half a millisecond."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import CHUNK

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Seven decimals reach the float32 floor near 1 (6e-8); six leave 5e-7.
DECIMALS = 7
_SCALE = 10**DECIMALS


@cache
def _pieces() -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.uint16]]:
    """Text of every ``d.dd``, ``dddd`` and ``d `` as machine words, so that one look-up writes several bytes."""
    head = b"".join(b"%d.%02d" % divmod(number, 100) for number in range(1000))
    middle = b"".join(b"%04d" % number for number in range(10_000))
    last = b"".join(b"%d " % number for number in range(10))
    return np.frombuffer(head, np.uint32), np.frombuffer(middle, np.uint32), np.frombuffer(last, np.uint16)


def rows_of_text(values: Array) -> memoryview:
    """Return ``values``, shape (n, k), as n lines of k numbers with seven decimals, separated by one space.

    Numbers must lie in (-10, 10): one digit before the point. When any is negative every number gets a column
    for its sign. Equals ``"%.7f"`` digit for digit, except where the eighth decimal is an exact half.

    Raises
    ------
    ValueError
        A number is NaN, infinite or too large: a fault of the caller, never of a user's input.

    """
    values = np.asarray(values, dtype=np.float64)
    smallest, largest = values.min(), values.max()
    # NaN is both, and fails the comparison too.
    if not (smallest > 1 / _SCALE - 10 and largest < 10 - 1 / _SCALE):
        message = "a table holds NaN, infinity or a number of 10 or more"
        raise ValueError(message)
    signed = int(smallest < -0.5 / _SCALE)
    width = DECIMALS + 3 + signed
    text = np.empty((values.size, width), dtype=np.uint8)
    raw = text.reshape(-1)
    head = np.ndarray(values.size, np.uint32, raw, signed, (width,))
    middle = np.ndarray(values.size, np.uint32, raw, signed + 4, (width,))
    last = np.ndarray(values.size, np.uint16, raw, signed + 8, (width,))
    heads, middles, lasts = _pieces()
    rows, columns = values.shape
    for start in range(0, rows, CHUNK // columns):
        scaled = values[start : start + CHUNK // columns].reshape(-1) * _SCALE
        np.rint(scaled, out=scaled)
        part = slice(start * columns, start * columns + scaled.size)
        if signed:
            text[part, 0] = np.where(scaled < 0, ord("-"), ord(" "))
            np.abs(scaled, out=scaled)
        # Of whole numbers below 2^27 half a unit keeps the product off the next whole number; processors multiply
        # several doubles at once, and divide integers one by one.
        high = ((scaled + 0.5) * 1e-5).astype(np.int32)
        low = scaled.astype(np.int32) - high * 100_000
        tens = ((low + 0.5) * 0.1).astype(np.int32)
        head[part], middle[part], last[part] = heads.take(high), middles.take(tens), lasts.take(low - tens * 10)
    text.reshape(len(values), -1)[:, -1] = ord("\n")
    return raw.data
