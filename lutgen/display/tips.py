"""White and primaries (the tips) over time, the two references, and the hours of ``--hours``.

The module also holds the luminance laws: white's luminance if no sensor holds it (section 2.1 of the paper).
"""

import csv
from dataclasses import dataclass
from decimal import Decimal
from math import isfinite
from pathlib import Path

import numpy as np

from lutgen.cells import BLANKS, is_comment, number
from lutgen.colorimetry import LINEAR_TO_XYZ, SRGB_XY, Array, xyY_to_xyz
from lutgen.errors import LutgenError, pick_one, refuse_unknown
from lutgen.files import read_at_most
from lutgen.names import REFERENCES
from lutgen.readings import TIP_NAMES, Measurements
from lutgen.time_law import between

#: Largest condition number of a matrix of colour points. Above it the points lie on a line within the noise of a meter.
MAX_CONDITION = 1e5

#: Ratio by which white may become brighter. Lamps settle and meters differ by a few percent; age only dims.
BRIGHTER = 1.1


@dataclass(frozen=True)
class Tips:
    """White and primaries over a display's life."""

    #: Measured times, increasing from 0, (N,); a single time describes the display at hour 0 without aging.
    hours: Array
    #: x, y and Y in cd/m² of white, red, green, blue, (N, 4, 3).
    xyY: Array  # noqa: N815 - the CIE's own spelling
    source: str = "<memory>"

    @classmethod
    def of(cls, measurements: Measurements) -> "Tips":
        """Return the tips of ``measurements``. Raises LutgenError: the primaries lie on a line."""
        return cls(*measurements.tips(), source=measurements.file)

    def __post_init__(self) -> None:
        xyz = np.swapaxes(xyY_to_xyz(self.xyY), -1, -2)
        for i, name in enumerate(TIP_NAMES):
            condition = np.linalg.cond(np.delete(xyz, i, axis=-1) / xyz[:, 1:2, :1])
            if (condition > MAX_CONDITION).any():
                hour = self.hours[np.argmax(condition)]
                others = ", ".join(other for other in TIP_NAMES if other != name)
                raise LutgenError(
                    f"{self.source}: hour {hour:g}: {others} lie on one line in the chromaticity diagram, so the "
                    f"matrix through them is singular. Check the x and y of these rows."
                )

    def brightened(self) -> str:
        """Return a sentence if white became brighter by more than age explains, which names the two hours; or ""."""
        white = self.xyY[:, 0, 2]
        rises = white / np.minimum.accumulate(white)
        last = int(np.argmax(rises))
        if rises[last] < BRIGHTER:
            return ""
        first = int(np.argmin(white[: last + 1]))
        return (
            f"{self.source}: white rose from {white[first]:.4g} cd/m² at {self.hours[first]:g} h to {white[last]:.4g} "
            f"at {self.hours[last]:g} h, which is not aging: a setting or an instrument changed. `lutgen "
            f"sessions explain` names the change; leave the sessions of other settings out."
        )

    def check_span(self, hours: float) -> None:
        """Raise LutgenError if ``hours`` is outside the measured span; lutgen does not extrapolate."""
        first, last = self.hours[0], self.hours[-1]
        if not first <= hours <= last:
            if self.hours.size == 1:
                raise LutgenError(
                    f"{self.source}: white and primaries were measured at one time only (hour 0), and hour "
                    f"{hours:.12g} is asked. Aging is a change: add the white, red, green and blue of a later hour, "
                    f"or take hour 0."
                )
            raise LutgenError(
                f"hour {hours:.12g} is outside the measured span {first:.12g}..{last:.12g} h of {self.source}. "
                f"Choose hours inside it: nothing is extrapolated. `lutgen trend` tells when a limit will be passed."
            )

    def spread(self, count: int) -> list[float]:
        """Return at most ``count`` measured times, evenly spread over the life, with the first and the last time."""
        goals = np.linspace(self.hours[0], self.hours[-1], count)
        return sorted({float(min(self.hours, key=lambda hour: abs(hour - goal))) for goal in goals})

    def at(self, hours: float) -> Array:
        """Return xyY at ``hours``, (4, 3); :mod:`lutgen.time_law` interpolates x, y and Y."""
        self.check_span(hours)
        if self.hours.size == 1:
            return np.asarray(self.xyY[0])
        return between(self.hours, self.xyY, hours)

    def referenced(self, hours: float, reference: str) -> Array:
        """Return xyY at ``hours``, (4, 3), relative to white's Y at hour 0; ``reference``: one of ``REFERENCES``."""
        now, fresh = self.at(hours), self.xyY[0]
        if reference == "absolute":
            return np.column_stack([now[:, :2], now[:, 2] / fresh[0, 2]])
        if reference != "relative":
            raise pick_one("reference", reference, REFERENCES)
        luminance = np.concatenate([[1.0], LINEAR_TO_XYZ[1]])
        moved = SRGB_XY + (now[:, :2] - fresh[:, :2])
        no_colour = (moved[:, 1] <= 0) | (moved.sum(axis=1) > 1)
        if no_colour.any():
            name = TIP_NAMES[int(np.argmax(no_colour))]
            raise LutgenError(
                f"{self.source}: by hour {hours:g} {name} has moved so far that, with the same shift, sRGB's {name} "
                f"lies outside all real colours. Check these rows, or use --reference absolute."
            )
        return np.column_stack([moved, luminance * (now[:, 2] / fresh[:, 2])])


#: Largest number of hours in one request. More hours count as a typing error: with 1 MB for each LUT they need 10 GB.
MAX_HOURS = 10_000

#: Hours above this are not rounded; the check of the measured span refuses them.
_ENDLESS = 10**9

#: Value for hours larger than any double.
_BEYOND = Decimal("1e309")

_ALLOWED = "Write 0..18000 (every measured time), 0..18000:500 (a step) or 0,5000,10000 (a list)"


def parse_hours(text: str | None, tips: Tips) -> list[float]:
    """Return the hours of ``text``, increasing, without repetition; without ``text`` every measured time.

    ``0..18000`` is every measured time in the span and both ends, ``0..18000:500`` a step from the start, and
    ``0,5000,10000`` a list.

    Raises LutgenError: another form, a reversed span, a step of 0 or less, too many hours, or hours outside the
    measured span.
    """
    if text is None:
        return [float(hour) for hour in tips.hours]
    if ".." not in text:
        return _checked({_number(part, text) for part in text.split(",")}, tips)
    span, colon, step = text.partition(":")
    first_text, _, last_text = span.partition("..")
    first, last = _number(first_text, text), _number(last_text, text)
    if first > last:
        raise LutgenError(f"--hours {text}: the span runs backwards. Write {last_text}..{first_text}.")
    tips.check_span(float(first))
    tips.check_span(float(last))
    if colon:
        return _checked(_steps(first, last, step, text), tips)
    measured = {Decimal(repr(float(hour))) for hour in tips.hours if first <= hour <= last}
    return _checked(measured | {first, last}, tips)


def _steps(first: Decimal, last: Decimal, given: str, text: str) -> set[Decimal]:
    step = _number(given, text)
    if step <= 0:
        raise LutgenError(
            f"--hours {text}: a step of {given} does not advance. Give one from 0.000001 on, such as 500."
        )
    count = int((last - first) / step) + 1
    if count > MAX_HOURS:
        raise LutgenError(f"--hours {text}: that is {count} hours, more than {MAX_HOURS}. Give a larger step.")
    return {first + i * step for i in range(count)}


def _checked(hours: set[Decimal], tips: Tips) -> list[float]:
    if len(hours) > MAX_HOURS:
        raise LutgenError(f"--hours asks for {len(hours)} hours, more than {MAX_HOURS}. Give fewer.")
    for hour in sorted(hours):
        tips.check_span(float(hour))
    return [float(hour) for hour in sorted(hours)]


def _number(part: str, text: str) -> Decimal:
    part = part.strip(BLANKS)
    hours = number(part, non_finite=True)
    # A point without a digit before it is an error: `0...5` is not the span 0 to 0.5.
    if hours is None or part.lstrip("+-").startswith("."):
        raise LutgenError(f"--hours {text}: {part!r} is not a number of hours. {_ALLOWED}.")
    is_word = part.lstrip("+-")[0].isalpha()  # nan, inf
    if is_word or hours < 0:
        raise LutgenError(f"--hours {text}: {part!r} is not a finite number of hours from 0 on. {_ALLOWED}.")
    exact = Decimal(repr(hours)) if isfinite(hours) else _BEYOND
    # Folder names have six decimals, so finer hours could collide. Six decimals are 0.0036 s.
    return exact if exact > _ENDLESS else round(exact, 6)


#: Section 3.1 of the paper: luminance is 67 % at 10 000 h and 40 % at 18 000 h.
PAPER_LAW = ((0.0, 1.0), (10_000.0, 0.67), (18_000.0, 0.40))

LAWS = ("paper", "measured")

#: Largest size of a luminance table, which has a row of some bytes for each hour.
MAX_BYTES = 4_000_000

#: Largest factor of a luminance table. Larger factors are percent.
_MAX_FACTOR = 10


@dataclass(frozen=True)
class LuminanceLaw:
    """White's luminance relative to hour 0, for ``chroma-luma``: a piecewise linear table, or as measured.

    ``table``: rows of (hour, factor); () for the law ``measured``.
    """

    name: str
    table: tuple[tuple[float, float], ...] = ()

    def sentence(self) -> str:
        """Return a sentence on the law of white's luminance."""
        by = {
            "paper": "the paper's law, 67 % at 10 000 h and 40 % at 18 000 h",
            "measured": "as this display's readings",
        }
        return f"Luminance of chroma-luma: {by.get(self.name, f'the table {self.name}')}."

    def factor(self, hours: float, tips: Tips) -> float:
        """Return white's luminance relative to hour 0. Raises LutgenError: ``hours`` outside the law's span."""
        if not self.table:
            return float(tips.at(hours)[0, 2] / tips.xyY[0, 0, 2])
        times, factors = np.array(self.table).T
        if not times[0] <= hours <= times[-1]:
            raise LutgenError(
                f"hour {hours:.12g} is outside the span {times[0]:g}..{times[-1]:.12g} h of the luminance law "
                f"{self.name!r}. Use --luminance measured, or a table that reaches further."
            )
        return float(np.interp(hours, times, factors))


#: Placeholder for the law that the readings state (:func:`law_of`).
UNSTATED = LuminanceLaw("")


def law_of(readings: Measurements) -> LuminanceLaw:
    """Return the law that the readings state (``# luminance_law: paper``); default: ``measured``.

    Raises LutgenError: the file names an unknown law.
    """
    stated = readings.metadata.get("luminance_law", "measured")
    refuse_unknown(f"luminance_law in {readings.file}", stated, LAWS)
    return luminance_law(stated)


def luminance_law(name: str) -> LuminanceLaw:
    """Return the law ``paper`` or ``measured``, or read a user's table (a .csv of hour,factor).

    Raises LutgenError: unknown name, or an invalid table: the first row is not factor 1 at hour 0, hours do not
    increase, or a factor is not above 0 and at most 10.
    """
    if name == "paper":
        return LuminanceLaw(name, PAPER_LAW)
    if name == "measured":
        return LuminanceLaw(name)
    if Path(name).suffix.lower() != ".csv":
        raise pick_one("luminance law", name, (*LAWS, "a .csv table of hour,factor"))
    return law_of_table(Path(name).name, _read_table(Path(name)), where=name)


def law_of_table(name: str, table: tuple[tuple[float, float], ...], *, where: str) -> LuminanceLaw:
    """Return the law of a table of (hour, factor). Raises LutgenError: an invalid table; see :func:`luminance_law`."""
    numbers = np.array(table, dtype=np.float64).reshape(-1, 2)
    hours, factors = numbers.T
    good = len(table) >= 2 and np.isfinite(numbers).all() and numbers[0].tolist() == [0.0, 1.0]
    if not good or not ((np.diff(hours) > 0).all() and (factors > 0).all() and (factors <= _MAX_FACTOR).all()):
        raise LutgenError(
            f"{where}: a luminance table needs at least two rows hour,factor, the first of them 0,1: hours increasing "
            f"from 0, factors relative to hour 0 (1 is the un-aged luminance, not 100), above 0 and at most "
            f"{_MAX_FACTOR}."
        )
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
    except csv.Error as error:  # for example a cell of more than 128 kB
        raise LutgenError(f"{where}: is no row of a CSV: {error}. Write two numbers, hour,factor.") from None
    values = [number(cell) for cell in cells]
    if len(values) != 2 or values[0] is None or values[1] is None:
        raise LutgenError(
            f"{where}: {line[:40]!r}: a luminance table has rows of two numbers, hour,factor, with decimal points."
        )
    return values[0], values[1]


def scale_luminance(xyY: Array, factor: float) -> Array:
    """Scale all four tips so that white's Y becomes ``factor``. Shape (4, 3) → (4, 3)."""
    return np.column_stack([xyY[:, :2], xyY[:, 2] * (factor / xyY[0, 2])])
