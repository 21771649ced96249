"""Strict parser for a .cube in lutgen's own form. OpenColorIO reads a sample of the file.

OpenColorIO 2.1 needs 28 ms to parse the text of 33³ rows, ten times as long as lutgen needs to bake and write them.
This module therefore parses the text: a head in one form, then exactly n³ rows of three numbers with seven decimals.
The numbers must equal the baked table to the last digit, so that a fault in any row is reported.

OpenColorIO reads a small file as a test: the same head with ``EDGE``³ rows, which the SHA-256 of the whole file
selects. All rows have the same grammar, so a program that reads some rows can read all rows. In each process,
OpenColorIO also loads and applies the complete first file of each kind. For each table this module accepts exactly one
text. A comparison of the numbers is therefore a comparison with lutgen's own text, without writing that text.
"""

import os
import re
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.digits import DECIMALS
from lutgen.bake.lut import Lut
from lutgen.bake.manifest import HeldFile
from lutgen.bake.readback import apply_lut
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError

#: Points along an edge of the sample table for OpenColorIO, and number of colours that are sent through it.
EDGE, COLOURS = 5, 100

#: Maximum difference of code values, since OpenColorIO computes in single precision.
SINGLE = 2e-6

_HEAD = re.compile(rb'((?:TITLE "[ !#-~]*"\n)?(?:# [^\r\n]*\n)*LUT_3D_SIZE )(\d{1,3})\n')

_SCALE = 10**DECIMALS

#: Number of rows that are read together, so that intermediate results stay in the processor's cache.
_ROWS = 8_000

_NO_ROWS = "its rows are not three numbers with seven decimals"
_OTHER_SIGNS = "its signs are not those that lutgen writes"


def is_read_here(lut: Lut, suffix: str) -> bool:
    """Whether this module can read a file of this table."""
    return lut.space == "code" and suffix == ".cube"


def refuse_difference(path: Path, shown: Array, read: Array) -> None:
    """Raise LutgenError unless OpenColorIO's code values ``shown`` equal this module's ``read``, (n, 3) each."""
    away = np.abs(shown - read).max()
    if not away <= SINGLE:
        raise LutgenError(
            f"{path}: OpenColorIO reads other code values, which differ by up to {away:.2g}. Build it again."
        )


def checked_table(file: HeldFile, baked: Lut, folder: Path) -> Lut:
    """Read a file strictly. Compare its numbers with the baked table, and a sample of it with OpenColorIO's result.

    The sample is written into the private folder ``folder``. Raises LutgenError: another form, or other numbers.
    """
    try:
        head, _, rows = _read(file)
        rows.refuse_difference(baked)
        _sample(file, head, rows, folder / f"{os.getpid()}.cube")
    except ValueError as error:
        raise LutgenError(f"{file.path}: {error}. Build it again.") from None
    return Lut("code", (rows.steps / _SCALE).astype(np.float32).astype(np.float64).reshape(baked.table.shape))


def is_text_of(file: HeldFile, head: bytes, baked: Lut) -> bool:
    """Whether a file consists, byte for byte, of ``head`` and the rows of the table ``baked``."""
    with suppress(ValueError):
        _, start, rows = _read(file)
        return file.data.startswith(head) and len(head) == start and rows.equal(baked)
    return False


class _Rows:
    """Rows of a table as characters, (n³, k), and as numbers in units of the last decimal, (n³, 3).

    Raises ValueError as :func:`whole_steps` does.
    """

    def __init__(self, text: NDArray[np.uint8]) -> None:
        self.text, self.steps = text, whole_steps(text)
        self._table: Array | None = None

    def equal(self, baked: Lut) -> bool:
        """Whether the numbers equal those of a table. The last equal table is cached."""
        if self._table is not baked.table:
            table = baked.table.reshape(-1, 3)
            if len(table) != len(self.steps):
                return False
            for top in range(0, len(table), _ROWS):
                if not np.array_equal(self.steps[top : top + _ROWS], np.rint(table[top : top + _ROWS] * _SCALE)):
                    return False
            self._table = baked.table
        return True

    def refuse_difference(self, baked: Lut) -> None:
        """Raise ValueError unless the numbers equal those of a table."""
        if not self.equal(baked):
            raise ValueError("its table is not the one that was baked")


#: The rows that this process has read last. The files of ``stable`` have equal rows at all hours.
_LAST: list[_Rows] = []


@lru_cache(maxsize=1)
def _read(file: HeldFile) -> tuple[bytes, int, _Rows]:
    """Return the head before the size, the rows' offset and the rows. Raises ValueError: the file has another form."""
    match = _HEAD.match(file.data)
    if match is None:
        raise ValueError("its head is not in the form that lutgen writes")
    size, letters = int(match[2]) ** 3, np.frombuffer(file.data, np.uint8, offset=match.end())
    if not size or letters.size % size:
        raise ValueError(f"it does not have {size} rows of equal length")
    text = letters.reshape(size, -1)
    if not (_LAST and np.array_equal(text, _LAST[0].text)):
        _LAST[:] = [_Rows(text)]
    return match[1], match.end(), _LAST[0]


def whole_steps(text: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Read rows of characters, (n, k), as numbers in units of the last decimal, (n, 3).

    Only lutgen's own text is accepted: columns for signs exist only if a number is negative, and there is no negative
    zero.

    Raises ValueError: the text has another form.
    """
    rows, letters = text.shape
    signed = letters // 3 - DECIMALS - 3
    if letters % 3 or signed not in (0, 1):
        raise ValueError(_NO_ROWS)
    # Contiguous columns, as in a table.
    steps = np.empty((rows, 3), np.int32, order="F")
    for top in range(0, rows, _ROWS):
        steps[top : top + _ROWS] = _steps_of(text[top : top + _ROWS], signed)
    if signed and not (steps < 0).any():
        raise ValueError(_OTHER_SIGNS)
    return steps


def _steps_of(text: NDArray[np.uint8], signed: int) -> NDArray[np.int32]:
    rows, letters = text.shape
    columns = np.ascontiguousarray(text.reshape(rows * 3, letters // 3).T)
    ends = columns[-1].reshape(rows, 3)
    digits = np.delete(columns[signed:-1], 1, axis=0) - ord("0")
    minus = columns[0] == ord("-") if signed else np.zeros(1, bool)
    if not (
        digits.max() <= 9
        and (columns[signed + 1] == ord(".")).all()
        and (ends == np.frombuffer(b"  \n", np.uint8)).all()
        and (not signed or (minus | (columns[0] == ord(" "))).all())
    ):
        raise ValueError(_NO_ROWS)
    # Join the eight digits in pairs. Each step uses the smallest sufficient type of integer.
    twos = digits[0::2] * np.uint8(10) + digits[1::2]
    fours = twos[0::2] * np.uint16(100) + twos[1::2]
    steps: NDArray[np.int32] = fours[0] * np.int32(10_000) + fours[1]
    if signed:
        np.negative(steps, out=steps, where=minus)
        if (steps[minus] == 0).any():
            raise ValueError(_OTHER_SIGNS)
    return steps.reshape(rows, 3)


def _sample(file: HeldFile, head: bytes, rows: _Rows, part: Path) -> None:
    """Let OpenColorIO load a sample of the rows after the head. Raises ValueError when it gives other colours."""
    random = np.random.default_rng(list(bytes.fromhex(file.sha256)))
    chosen = random.integers(0, len(rows.text), EDGE**3)
    code = random.random((COLOURS, 3)).astype(np.float32).astype(np.float64)
    table = Lut("code", (rows.steps[chosen] / _SCALE).reshape(EDGE, EDGE, EDGE, 3))
    part.write_bytes(b"%s%d\n%s" % (head, EDGE, rows.text[chosen].tobytes()))
    away = np.abs(apply_lut(part, code) - table.apply(code)).max()
    if not away <= SINGLE:
        raise ValueError(f"OpenColorIO reads other code values, which differ by up to {away:.2g}")
