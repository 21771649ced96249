"""The paper's six steps, literally: one pixel at a time, in plain Python floats, without code of lutgen.

Avanaki et al., Proc. SPIE 9420 (2015), section 2.2, with the decisions of ``docs/explanation/model.md``: reference,
modes, luminance laws, averaged ties, and the selection ``continuous``. The code is slow on purpose; tests compare the
fast routines with it.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]  # rows
Law = tuple[tuple[float, float], ...]  # (hour, factor)

POINTS = "wrgb"
DRIVES: dict[str, Vector] = {"w": (1, 1, 1), "r": (1, 0, 0), "g": (0, 1, 0), "b": (0, 0, 1)}
SRGB_XY = {"w": (0.3127, 0.3290), "r": (0.64, 0.33), "g": (0.30, 0.60), "b": (0.15, 0.06)}
PAPER_LAW: Law = ((0.0, 1.0), (10_000.0, 0.67), (18_000.0, 0.40))
TIE = 1e-9


class Row(NamedTuple):
    """One reading: hour, drive, and x, y, Y in cd/m²."""

    hour: float
    drive: Vector
    xyY: Vector  # noqa: N815 - the CIE's own spelling


def rows_of_csv(text: str) -> list[Row]:
    """Read the plain form hour,R,G,B,x,y,Y."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert lines[0] == "hour,R,G,B,x,y,Y"
    rows = []
    for line in lines[1:]:
        hour, red, green, blue, x, y, luminance = (float(cell) for cell in line.split(","))
        rows.append(Row(hour, (red, green, blue), (x, y, luminance)))
    return rows


def tips_at(rows: list[Row], hours: float) -> dict[str, Vector]:
    """Return xyY of the four colour points; x, y and Y are each piecewise linear in time."""
    tips = {}
    for point, drive in DRIVES.items():
        history = sorted((row.hour, row.xyY) for row in rows if row.drive == drive)
        for (start, before), (end, after) in itertools.pairwise(history):
            if start <= hours <= end:
                tips[point] = _between(before, after, (hours - start) / (end - start))
    assert len(tips) == 4, f"hour {hours} is not measured"
    return tips


def _between(before: Vector, after: Vector, share: float) -> Vector:
    x, y, luminance = (a + (b - a) * share for a, b in zip(before, after, strict=True))
    return x, y, luminance


def referenced(rows: list[Row], hours: float, reference: str) -> dict[str, Vector]:
    """Return xyY with white's Y = 1 at hour 0: the change applied to sRGB's colour points, or the measured points."""
    fresh, now = tips_at(rows, 0.0), tips_at(rows, hours)
    result = {}
    for point in POINTS:
        (x_0, y_0, luminance_0), (x, y, luminance) = fresh[point], now[point]
        if reference == "absolute":
            result[point] = (x, y, luminance / fresh["w"][2])
        else:
            s_x, s_y = SRGB_XY[point]
            result[point] = (s_x + x - x_0, s_y + y - y_0, srgb_luminance(point) * luminance / luminance_0)
    return result


def srgb_luminance(point: str) -> float:
    """Return Y of an sRGB colour point, relative to white."""
    return 1.0 if point == "w" else srgb_matrix()[1]["rgb".index(point)]


def luminance_factor(rows: list[Row], hours: float, law: Law | None) -> float:
    """Return L(t): from a table, linear between its rows, or, if ``law`` is None, as measured."""
    if law is None:
        return tips_at(rows, hours)["w"][2] / tips_at(rows, 0.0)["w"][2]
    for (start, before), (end, after) in itertools.pairwise(law):
        if start <= hours <= end:
            return before + (after - before) * (hours - start) / (end - start)
    raise AssertionError(f"hour {hours} is outside the law")


def in_mode(rows: list[Row], *, mode: str, hours: float, reference: str, law: Law | None) -> dict[str, Vector]:
    """Return xyY of the colour points in an aging mode: white's Y is 1, or L(t) for ``chroma-luma``."""
    tips = referenced(rows, 0.0 if mode == "stable" else hours, reference)
    white = luminance_factor(rows, hours, law) if mode == "chroma-luma" else 1.0
    scale = white / tips["w"][2]
    return {point: (x, y, luminance * scale) for point, (x, y, luminance) in tips.items()}


def xyz_of(xyY: Vector) -> Vector:
    """Step 1."""
    x, y, luminance = xyY
    return x * luminance / y, luminance, (1 - x - y) * luminance / y


def three_point(tips: dict[str, Vector], left_out: str) -> Matrix:
    """Step 2: T'_i = [XYZ_j ...] · [drive_j ...]⁻¹ over the three j ≠ i, as columns."""
    others = [point for point in POINTS if point != left_out]
    light = _columns([xyz_of(tips[point]) for point in others])
    return _product(light, _inverse(_columns([DRIVES[point] for point in others])))


def averaged(tips: dict[str, Vector], point: str) -> Matrix:
    """Step 3: T_i = ⅓ Σ_{j≠i} T'_j."""
    return _mean([three_point(tips, other) for other in POINTS if other != point])


def to_linear(code: float) -> float:
    """Step 4."""
    return code / 12.92 if code <= 0.04045 else ((0.055 + code) / 1.055) ** 2.4


def nearest_points(linear: Vector) -> list[str]:
    """Step 5: the colour points that are nearest in linear light, all within ``TIE`` of the smallest distance."""
    distance = {point: math.dist(linear, drive) for point, drive in DRIVES.items()}
    return [point for point in POINTS if distance[point] <= min(distance.values()) + TIE]


def smallest_channel(linear: Vector) -> str:
    """The channel whose T' ``continuous`` uses."""
    return "rgb"[linear.index(min(linear))]


def to_code(linear: float) -> float:
    """Step 6, per channel: clip, then the sRGB curve."""
    linear = min(max(linear, 0.0), 1.0)
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


class Twin:
    """A display of one mode at one hour."""

    def __init__(
        self,
        rows: list[Row],
        *,
        mode: str,
        hours: float,
        reference: str = "relative",
        selection: str = "nearest",
        law: Law | None = PAPER_LAW,
    ) -> None:
        self.tips = in_mode(rows, mode=mode, hours=hours, reference=reference, law=law)
        self.selection = selection
        self.three_point = {point: three_point(self.tips, point) for point in POINTS}
        self.averaged = {point: averaged(self.tips, point) for point in POINTS}
        self._back = _inverse(srgb_matrix())

    def xyz(self, code: Vector) -> Vector:
        """Steps 4 and 5."""
        linear = (to_linear(code[0]), to_linear(code[1]), to_linear(code[2]))
        if self.selection == "continuous":
            return _times(self.three_point[smallest_channel(linear)], linear)
        return _times(_mean([self.averaged[point] for point in nearest_points(linear)]), linear)

    def linear(self, code: Vector) -> Vector:
        """Return linear sRGB of the aged colour, not clipped."""
        return _times(self._back, self.xyz(code))

    def code(self, code: Vector) -> Vector:
        """Return the code value with which an sRGB viewer shows the aged colour (all steps)."""
        red, green, blue = self.linear(code)
        return to_code(red), to_code(green), to_code(blue)


_SRGB: list[Matrix] = []


def srgb_matrix() -> Matrix:
    """Return linear sRGB → XYZ from its chromaticities: primaries are scaled to sum to the white with Y = 1."""
    if not _SRGB:
        white, *primaries = (xyz_of((x, y, 1.0)) for x, y in SRGB_XY.values())
        columns = _columns(primaries)
        red, green, blue = _times(_inverse(columns), white)
        _SRGB.append(_product(columns, ((red, 0, 0), (0, green, 0), (0, 0, blue))))
    return _SRGB[0]


def _columns(vectors: list[Vector]) -> Matrix:
    first, second, third = zip(*vectors, strict=True)
    return first, second, third


def _times(matrix: Matrix, vector: Vector) -> Vector:
    first, second, third = (row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2] for row in matrix)
    return first, second, third


def _product(left: Matrix, right: Matrix) -> Matrix:
    return _columns([_times(left, column) for column in _columns(list(right))])


def _mean(matrices: list[Matrix]) -> Matrix:
    rows = []
    for row in range(3):
        first, second, third = (sum(m[row][column] for m in matrices) / len(matrices) for column in range(3))
        rows.append((first, second, third))
    return rows[0], rows[1], rows[2]


def _inverse(matrix: Matrix) -> Matrix:
    """Invert a matrix by Cramer's rule."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return (
        ((e * i - f * h) / determinant, (c * h - b * i) / determinant, (b * f - c * e) / determinant),
        ((f * g - d * i) / determinant, (a * i - c * g) / determinant, (c * d - a * f) / determinant),
        ((d * h - e * g) / determinant, (b * g - a * h) / determinant, (a * e - b * d) / determinant),
    )
