"""Reading LUT files back: through OpenColorIO, or, where it reads no such files, as their format says.

A .cube of lutgen's own form is read here too. OpenColorIO 2.1 needs 28 ms to parse the text of 33³, ten times as long
as lutgen needs to bake and write it. So the text is read strictly: the head in one form, then exactly n³ rows of three
numbers with seven decimals and no more. The numbers must be those of the table that was baked, to the last digit.
OpenColorIO then loads a small file of the same head and ``EDGE``³ rows, chosen by the file's SHA-256, and applies it.
All rows have one form, so a program that reads some reads all. In each process OpenColorIO also loads and applies the
first file of each kind as a whole.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.bake.digits import DECIMALS
from lutgen.bake.formats import format_named, format_names
from lutgen.bake.lut import Lut
from lutgen.bindings import lut_processor, ocio, refuse_unlikely
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.bake.formats import Reader
    from lutgen.bake.manifest import HeldFile
    from lutgen.colorimetry import Array


class TableKind(NamedTuple):
    """How a file's table is indexed (a key of ``SPACES``) and whether it is clipped; ``size`` 0 is a matrix."""

    space: str
    size: int
    clipped: bool


def apply_lut(path: Path, code: Array) -> Array:
    """Send code values (n, 3) through a LUT file, tetrahedrally, as its readers do.

    Raises LutgenError: no file, none of a LUT's size, one that cannot be read, or one that gives NaN or infinity.
    """
    reader = _reader(path)
    if reader:
        refuse_unlikely(path)
        result = reader.apply(path, code)
    else:
        processor = lut_processor(path).getDefaultCPUProcessor()
        shown = np.ascontiguousarray(code, dtype=np.float32).copy()
        processor.applyRGB(shown)
        result = shown.astype(np.float64)
    if not np.isfinite(result).all():
        message = f"{path}: gives NaN or infinity for {int((~np.isfinite(result)).any(axis=1).sum())} colours."
        raise LutgenError(message)
    return result


def table_kind(path: Path, *, clipped: bool) -> TableKind:
    """Return how a LUT file's table is indexed. Raises LutgenError as :func:`apply_lut`."""
    reader = _reader(path)
    if reader:
        refuse_unlikely(path)
        return TableKind(*reader.table(path), clipped)
    return TableKind(*table_of_ocio(path), clipped)


def table_of_ocio(path: Path) -> tuple[str, int]:
    """Space and size of a table: in code values when the table comes first, shaped when a curve leads to it."""
    lib = ocio()
    steps = list(lut_processor(path).createGroupTransform())
    tables = [place for place, step in enumerate(steps) if isinstance(step, lib.Lut3DTransform)]
    if not tables:
        return "linear", 0
    size = steps[tables[0]].getGridSize()
    before = steps[: tables[0]]
    # A curve of two points is the straight line from 0 to 1.
    if all(isinstance(step, lib.Lut1DTransform) and step.getLength() == 2 for step in before):
        return "code", size
    return ("shaped" if isinstance(before[-1], lib.Lut1DTransform) else "linear"), size


def _reader(path: Path) -> Reader | None:
    """The reader of the format with this suffix; None for formats that OpenColorIO reads."""
    forms = map(format_named, format_names())
    return next((form.reader for form in forms if form.reader and path.suffix.lower() == form.suffix), None)


#: Points along an edge of the table that OpenColorIO loads, and colours that go through it.
EDGE, COLOURS = 5, 100

#: OpenColorIO computes in single precision: code values differ by no more.
SINGLE = 2e-6

_HEAD = re.compile(rb'((?:TITLE "[ !#-~]*"\n)?(?:# [^\r\n]*\n)*LUT_3D_SIZE )(\d{1,3})\n')

_SCALE = 10**DECIMALS


def is_read_here(lut: Lut, suffix: str) -> bool:
    """Whether a file of this table is of the form that is read here."""
    return lut.space == "code" and suffix == ".cube"


def refuse_other(path: Path, shown: Array, read: Array) -> None:
    """Raise LutgenError unless OpenColorIO ``shown`` what was ``read`` here, code values of (n, 3) colours."""
    away = np.abs(shown - read).max()
    if not away <= SINGLE:
        raise LutgenError(
            f"{path}: OpenColorIO reads it otherwise, by up to {away:.2g} in code values. Build it again."
        )


def checked_table(file: HeldFile, baked: Lut, folder: Path) -> Lut:
    """Read a file strictly, and compare it with the table that was baked, and a sample of it with OpenColorIO.

    The sample is written into ``folder``, a private one.

    Raises LutgenError: the file has another form, holds another table, or OpenColorIO reads it otherwise.
    """
    try:
        head, text = _parts(file.data)
        steps = _same(whole_steps(text), baked)
        _sample(file, head, text, steps, folder / f"{os.getpid()}.cube")
    except ValueError as error:
        raise LutgenError(f"{file.path}: {error}. Build it again.") from None
    return Lut("code", (steps / _SCALE).astype(np.float32).astype(np.float64).reshape(baked.table.shape))


def _same(steps: NDArray[np.int32], baked: Lut) -> NDArray[np.int32]:
    """Return the numbers of the file; raises ValueError where they are not those that were baked."""
    if not np.array_equal(steps, np.rint(baked.table.reshape(-1, 3) * _SCALE)):
        raise ValueError("its table is not the one that was baked")
    return steps


def _parts(data: bytes) -> tuple[bytes, NDArray[np.uint8]]:
    """Return the head up to the size, and the rows as letters, (n³, letters); raises ValueError."""
    match = _HEAD.match(data)
    if match is None:
        raise ValueError("its head is not in the form that lutgen writes")
    rows, text = int(match[2]) ** 3, np.frombuffer(data, np.uint8, offset=match.end())
    if not rows or text.size % rows:
        raise ValueError(f"it has not {rows} rows of one length")
    return match[1], text.reshape(rows, -1)


def whole_steps(text: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Read rows of letters, (n, k), as numbers in units of the last decimal, (n, 3); raises ValueError."""
    rows, letters = text.shape
    width, signed = letters // 3, letters // 3 - DECIMALS - 3
    if letters % 3 or signed not in (0, 1):
        raise ValueError("its rows are not three numbers with seven decimals")
    columns = np.ascontiguousarray(text.reshape(rows * 3, width).T)
    ends = columns[-1].reshape(rows, 3)
    digits = np.delete(columns[signed:-1], 1, axis=0) - ord("0")
    minus = columns[0] == ord("-") if signed else np.zeros(1, bool)
    if not (
        (digits <= 9).all()
        and (columns[signed + 1] == ord(".")).all()
        and (ends == np.frombuffer(b"  \n", np.uint8)).all()
        and (not signed or (minus | (columns[0] == ord(" "))).all())
    ):
        raise ValueError("its rows are not three numbers with seven decimals")
    steps: NDArray[np.int32] = digits[0].astype(np.int32)
    for digit in digits[1:]:
        steps *= 10
        steps += digit
    if signed:
        np.negative(steps, out=steps, where=minus)
    return steps.reshape(rows, 3)


def _sample(file: HeldFile, head: bytes, text: NDArray[np.uint8], steps: NDArray[np.int32], part: Path) -> None:
    """Let OpenColorIO load some rows of a file behind its head; raises ValueError where it gives other colours."""
    random = np.random.default_rng(list(bytes.fromhex(file.sha256)))
    chosen = random.integers(0, len(text), EDGE**3)
    code = random.random((COLOURS, 3)).astype(np.float32).astype(np.float64)
    table = Lut("code", (steps[chosen] / _SCALE).reshape(EDGE, EDGE, EDGE, 3))
    part.write_bytes(b"%s%d\n%s" % (head, EDGE, text[chosen].tobytes()))
    away = np.abs(apply_lut(part, code) - table.apply(code)).max()
    if not away <= SINGLE:
        raise ValueError(f"OpenColorIO reads its numbers otherwise, by up to {away:.2g}")
