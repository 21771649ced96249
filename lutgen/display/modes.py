"""Aging modes and luminance laws: what becomes of white's luminance (section 2.1 of the paper)."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.cells import is_comment, number
from lutgen.errors import LutgenError, pick_one, refuse_unknown
from lutgen.files import read_at_most

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.display.tips import Tips
    from lutgen.readings import Measurements

#: Section 3.1 of the paper: luminance is 67 % at 10 000 h and 40 % at 18 000 h.
PAPER_LAW = ((0.0, 1.0), (10_000.0, 0.67), (18_000.0, 0.40))

LAWS = ("paper", "measured")

#: A luminance table has a row of some bytes an hour.
MAX_BYTES = 4_000_000

#: No display is ten times as bright as when it was new: larger factors are percent.
_MAX_FACTOR = 10


@dataclass(frozen=True)
class LuminanceLaw:
    """White's luminance relative to hour 0, for ``chroma-luma``: piecewise linear, or as measured.

    ``table`` is () for the law ``measured``.
    """

    name: str
    table: tuple[tuple[float, float], ...] = ()

    def sentence(self) -> str:
        """Say what white's luminance goes by where no sensor holds it."""
        by = {
            "paper": "the paper's law, 67 % at 10 000 h and 40 % at 18 000 h",
            "measured": "as this display's readings",
        }
        return f"Luminance of chroma-luma: {by.get(self.name, f'the table {self.name}')}."

    def factor(self, hours: float, tips: Tips) -> float:
        """Return L(hours). Raises LutgenError outside the law's span."""
        if not self.table:
            return float(tips.at(hours)[0, 2] / tips.xyY[0, 0, 2])
        times, factors = np.array(self.table).T
        if not times[0] <= hours <= times[-1]:
            message = (
                f"hour {hours:.12g} is outside the span {times[0]:g}..{times[-1]:.12g} h of the luminance law "
                f"{self.name!r}. Use --luminance measured, or a table that reaches further."
            )
            raise LutgenError(message)
        return float(np.interp(hours, times, factors))


#: The law that the readings themselves ask for (:func:`law_of`).
UNSAID = LuminanceLaw("")


def law_of(readings: Measurements) -> LuminanceLaw:
    """Return the law of a display without ``--luminance``: as measured, or the paper's by ``# luminance_law: paper``.

    Raises LutgenError: the file names an unknown law.
    """
    stated = readings.metadata.get("luminance_law", "measured")
    refuse_unknown(f"luminance_law in {readings.file}", stated, LAWS)
    return luminance_law(stated)


def luminance_law(name: str) -> LuminanceLaw:
    """Return the law ``paper`` or ``measured``, or read a user's table (a .csv of hour,factor).

    Raises LutgenError: unknown name, or a table that does not begin with factor 1 at hour 0, whose hours do not
    increase, or whose factors are not above 0 and at most 10.
    """
    if name == "paper":
        return LuminanceLaw(name, PAPER_LAW)
    if name == "measured":
        return LuminanceLaw(name)
    if Path(name).suffix.lower() != ".csv":
        raise pick_one("luminance law", name, (*LAWS, "a .csv table of hour,factor"))
    return law_of_table(Path(name).name, _read_table(Path(name)), where=name)


def law_of_table(name: str, table: tuple[tuple[float, float], ...], *, where: str) -> LuminanceLaw:
    """Check a table of (hour, factor) and return its law: factor 1 at hour 0, else hour 0 would not be un-aged."""
    numbers = np.array(table, dtype=np.float64).reshape(-1, 2)
    good = (
        len(table) >= 2
        and np.isfinite(numbers).all()
        and numbers[0].tolist() == [0.0, 1.0]
        and (np.diff(numbers[:, 0]) > 0).all()
        and (numbers[:, 1] > 0).all()
        and (numbers[:, 1] <= _MAX_FACTOR).all()
    )
    if not good:
        message = (
            f"{where}: a luminance table needs at least two rows hour,factor, the first of them 0,1: hours increasing "
            f"from 0, factors relative to hour 0 (1 is the un-aged luminance, not 100), above 0 and at most "
            f"{_MAX_FACTOR}."
        )
        raise LutgenError(message)
    return LuminanceLaw(name, tuple((float(hour), float(factor)) for hour, factor in numbers))


def _read_table(path: Path) -> tuple[tuple[float, float], ...]:
    data = read_at_most(path, MAX_BYTES, what="the luminance table", none="luminance table")
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise LutgenError(f"{path}: cannot read the luminance table: {error}.") from None
    rows = [(at, line) for at, line in enumerate(lines, start=1) if line.strip() and not is_comment(line)]
    if rows and [cell.strip() for cell in rows[0][1].split(",")] == ["hour", "factor"]:
        rows = rows[1:]
    return tuple(_row(line, f"{path}, line {at}") for at, line in rows)


def _row(line: str, where: str) -> tuple[float, float]:
    try:
        cells = next(csv.reader([line], strict=True))
    except csv.Error as error:  # as of a cell of more than 128 kB
        raise LutgenError(f"{where}: is no row of a CSV: {error}. Write two numbers, hour,factor.") from None
    read = [number(cell) for cell in cells]
    if len(read) != 2 or read[0] is None or read[1] is None:
        message = (
            f"{where}: {line[:40]!r}: a luminance table has rows of two numbers, hour,factor, with decimal points."
        )
        raise LutgenError(message)
    return read[0], read[1]


def scale_luminance(xyY: Array, factor: float) -> Array:
    """Scale all four tips so that white's Y becomes ``factor``. Shape (4, 3) → (4, 3)."""
    return np.column_stack([xyY[:, :2], xyY[:, 2] * (factor / xyY[0, 2])])
