"""Fixed-point text of large tables, computed as bytes: ``%.7f`` of a whole array in half a millisecond."""

from functools import cache
from io import BytesIO
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array

#: Seven decimals reach the float32 resolution near 1 (6e-8). Six decimals leave an error of 5e-7.
DECIMALS = 7
_SCALE = 10**DECIMALS

#: Number of rows that are written together: a table of 33³. The numbers of a column and their text, 2 MB, fit in the
#: processor's cache.
_ROWS = 36_000

#: The sum of this constant and a double below 2^32 has the nearest integer (ties to even) in its last bits. A double of
#: this size has no bits for fractions, and the last 32 bits of the constant are zero.
_WHOLE = 1.5 * 2.0**52


@cache
def _pieces() -> tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.uint32]]:
    """Return the text of every ``d.ddd`` and of every ``dddd`` in eight-byte words, and of ``dddd`` in four bytes.

    The text ``d.ddd`` takes five bytes of its word. The text ``dddd`` and a space take five bytes of their word.
    """
    first = b"".join(b"%d.%03d   " % divmod(number, 1000) for number in range(10_000))
    last = b"".join(b"%04d    " % number for number in range(10_000))
    inner = np.frombuffer(last, np.uint64)
    return np.frombuffer(first, np.uint64), inner, inner.view(np.uint32)[::2].copy()


def rows_of_text(values: Array, *, head: bytes = b"") -> bytes:
    """Return ``values``, shape (n, k), as n lines of k numbers with seven decimals, separated by one space.

    Numbers must lie in (-10, 10), with one digit before the point. If any number is negative, every number gets a
    column for the sign. The text equals ``"%.7f"`` digit for digit, except when the remainder after the seventh decimal
    is an exact half. ``head`` is put before the lines.

    Raises ValueError: a number is NaN, infinite or too large. This is a fault of the caller, never of a user's input.
    """
    values = np.asarray(values, dtype=np.float64)
    smallest, largest = values.min(), values.max()
    # With a NaN, both the minimum and the maximum are NaN, and the comparison is false.
    if not (smallest > 1 / _SCALE - 10 and largest < 10 - 1 / _SCALE):
        raise ValueError("a table holds NaN, infinity or a number of 10 or more")
    signed = int(smallest < -0.5 / _SCALE)
    # BytesIO returns its bytes without a copy. A copy of a large table would cost as much time as its text.
    file = BytesIO(head)
    file.seek(len(head) + values.size * (DECIMALS + 3 + signed) - 1)
    file.write(b"\n")
    with file.getbuffer() as buffer:
        _put_rows(np.frombuffer(buffer, np.uint8)[len(head) :].reshape(len(values), -1), values)
    return file.getvalue()


def _put_rows(text: NDArray[np.uint8], values: Array) -> None:
    """Write ``values`` as :func:`rows_of_text` defines into ``text``, lines of bytes, (n, k · width)."""
    width = text.shape[1] // values.shape[1]
    signed = width - DECIMALS - 3
    text[:, -1] = ord("\n")
    first, last, at_end = _pieces()
    for top, column in product(range(0, len(values), _ROWS), range(values.shape[1])):
        here, lines, start = values[top : top + _ROWS, column], text[top : top + _ROWS], column * width + signed
        steps = (np.abs(here) if signed else here) * _SCALE
        steps += _WHOLE
        whole = steps.view(np.int64).astype(np.uint32)
        if signed:
            lines[:, start - 1] = np.where((here < 0) & (whole > 0), ord("-"), ord(" "))
        high = whole // 10_000
        whole -= high * 10_000
        # Each write of eight bytes covers three bytes too many. A later write replaces them: first that of the last
        # four digits, then that of the number to the right.
        _words(lines, start, first)[:] = first.take(high)
        low = at_end if column == values.shape[1] - 1 else last
        _words(lines, start + 5, low)[:] = low.take(whole)


def _words(lines: NDArray[np.uint8], start: int, like: NDArray[Any]) -> NDArray[Any]:
    """Return a view of the bytes from offset ``start`` of each line as one word of the type of ``like``, (n,)."""
    return np.ndarray(len(lines), like.dtype, lines, start, lines.strides[:1])
