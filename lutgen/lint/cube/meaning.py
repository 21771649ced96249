"""Our own reading of a ``.cube``: the colours that its author meant, with which each reader is compared."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.lint.cube.scan import CubeScan

#: Irregularities with which a table has no defined colours.
MEANINGLESS = {"nan", "infinite", "overflow", "columns", "text", "NUL"}


def read_as_meant(scan: CubeScan, code: Array) -> Array | None:
    """Return the colours (n, 3) that a file means for code values (n, 3), interpolated trilinearly.

    The file was scanned with ``keep``. None where its colours are not defined. A domain counts wherever in the header
    it stands, and a 1D part is applied before the table.
    """
    if MEANINGLESS & set(scan.oddities) or len(scan.named("LUT_3D_SIZE")) > 1 or not (scan.size or scan.size_1d):
        return None
    shown: Array | None = code
    if scan.size_1d:
        shown = _through_curves(scan, code)
    if scan.size and shown is not None:
        shown = _through_table(scan, shown)
    return shown


def _through_curves(scan: CubeScan, code: Array) -> Array | None:
    place = _place(scan, code, "LUT_1D_INPUT_RANGE")
    surplus = scan.table.rows and not scan.size
    if place is None or surplus or len(scan.shaper) != scan.size_1d or scan.size_1d < 2:
        return None
    index = np.linspace(0, 1, scan.size_1d)
    return np.column_stack([np.interp(place[:, i], index, scan.shaper[:, i]) for i in range(3)])


def _through_table(scan: CubeScan, code: Array) -> Array | None:
    place = _place(scan, code, "LUT_3D_INPUT_RANGE")
    table = scan.table.table
    if place is None or table is None or len(table) != scan.size**3:
        return None
    return trilinear(table.reshape(scan.size, scan.size, scan.size, 3), place)


def _place(scan: CubeScan, code: Array, keyword: str) -> Array | None:
    """Return the position of code values in the input range of a part, 0..1; None where the range is empty."""
    low, high = _range(scan, keyword)
    return np.clip((code - low) / (high - low), 0, 1) if (high > low).all() else None


def trilinear(table: Array, place: Array) -> Array:
    """Interpolate a table, indexed [blue, green, red], at positions (n, 3) in 0..1, as a sum over eight corners."""
    size = len(table)
    scaled = place * (size - 1)
    cell = np.clip(np.floor(scaled).astype(int), 0, max(size - 2, 0))
    share = scaled - cell
    result = np.zeros_like(place)
    for corner in product((0, 1), repeat=3):
        red, green, blue = np.minimum(cell + corner, size - 1).T
        weight = np.where(corner, share, 1.0 - share).prod(axis=1)
        result += weight[:, np.newaxis] * table[blue, green, red]
    return result


def _range(scan: CubeScan, keyword: str) -> tuple[Array, Array]:
    """Return the input of the first and of the last row of a part, each (3,)."""
    low, high = np.zeros(3), np.ones(3)
    if keyword == "LUT_3D_INPUT_RANGE" or not scan.size:
        low, high = scan.domain
    for entry in scan.named(keyword):
        ends = entry.numbers(2)
        if ends is not None:
            low, high = np.full(3, ends[0]), np.full(3, ends[1])
    return low, high
