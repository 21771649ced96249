"""Fixed-point text of large tables, computed as bytes: the ``%.7f`` of a whole array in half a millisecond."""

from __future__ import annotations

from functools import cache
from io import BytesIO
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Seven decimals reach the float32 floor near 1 (6e-8); six leave 5e-7.
DECIMALS = 7
_SCALE = 10**DECIMALS

#: Rows that are written together, a table of 33³: numbers of a column and their text, 2 MB, stay near the processor.
_ROWS = 36_000

#: Added to a double below 2^32, the sum is the whole number that is nearest to it (of two the even one), in the last
#: bits: a double of this size has no bits for fractions, and 32 zeros behind its own.
_WHOLE = 1.5 * 2.0**52


@cache
def _pieces() -> tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.uint32]]:
    """Text of every ``d.ddd``, and of every ``dddd`` and a space, five bytes of eight; then of every ``dddd`` alone."""
    first = b"".join(b"%d.%03d   " % divmod(number, 1000) for number in range(10_000))
    last = b"".join(b"%04d    " % number for number in range(10_000))
    inner = np.frombuffer(last, np.uint64)
    return np.frombuffer(first, np.uint64), inner, inner.view(np.uint32)[::2].copy()


def rows_of_text(values: Array, *, head: bytes = b"") -> bytes:
    """Return ``values``, shape (n, k), as n lines of k numbers with seven decimals, separated by one space.

    Numbers must lie in (-10, 10): one digit before the point. When any is negative every number gets a column for its
    sign. Equals ``"%.7f"`` digit for digit, except where the eighth decimal is an exact half. ``head`` stands before
    the lines.

    Raises ValueError: a number is NaN, infinite or too large: a fault of the caller, never of a user's input.
    """
    values = np.asarray(values, dtype=np.float64)
    smallest, largest = values.min(), values.max()
    # NaN is both, and fails the comparison too.
    if not (smallest > 1 / _SCALE - 10 and largest < 10 - 1 / _SCALE):
        raise ValueError("a table holds NaN, infinity or a number of 10 or more")
    signed = int(smallest < -0.5 / _SCALE)
    # It gives its bytes away without a copy, which would cost a large table as much again as its text.
    file = BytesIO(head)
    file.seek(len(head) + values.size * (DECIMALS + 3 + signed) - 1)
    file.write(b"\n")
    with file.getbuffer() as buffer:
        _put_rows(np.frombuffer(buffer, np.uint8)[len(head) :].reshape(len(values), -1), values)
    return file.getvalue()


def _put_rows(text: NDArray[np.uint8], values: Array) -> None:
    """Write ``values`` as :func:`rows_of_text` says into lines of letters, (n, k · width)."""
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
        # Eight bytes reach over what is written after them: the last four digits, then the number to the right.
        _words(lines, start, first)[:] = first.take(high)
        low = at_end if column == values.shape[1] - 1 else last
        _words(lines, start + 5, low)[:] = low.take(whole)


def _words(lines: NDArray[np.uint8], start: int, like: NDArray[Any]) -> NDArray[Any]:
    """Return a view of what begins at one place of each line as words of a type, (n,)."""
    return np.ndarray(len(lines), like.dtype, lines, start, lines.strides[:1])
