"""``Measurements``: the readings of one display, checked once and then frozen."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import Array, xyz_to_xyY
from lutgen.errors import LutgenError, listed
from lutgen.readings.conditions import COLUMNS, CONDITIONS, OF_COLUMN
from lutgen.readings.rest import RestOfSessions, is_tip, middle, rest_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from numpy.typing import ArrayLike, NDArray

#: The tips: white and the primaries at full drive, in the order of the paper's index i.
TIP_NAMES = ("white", "red", "green", "blue")

#: Optional column → value of a blank cell (NaN: unknown, or warm).
OPTIONAL = {name: column.blank for name, column in COLUMNS.items()}

#: Column → allowed range and description; a value outside the range is a typing error.
RANGES = {name: (column.low, column.high, column.meaning) for name, column in COLUMNS.items()} | {
    "hour": (0.0, 1e7, "operating hours, counted from the un-aged display at 0, never negative"),
    "order": (-1e12, 1e12, "a number that grows with the time of reading"),
    "XYZ": (-1e6, 1e6, "light in cd/m²"),
}

#: A largest code value between 1 and this is an error on the scale 0..1; a larger one means percent or 8-bit codes.
MUCH_ABOVE_1 = 1.1

#: Smallest luminance of white in cd/m². A smaller white means that XYZ are relative (Y = 1 for white).
MIN_WHITE_CD_M2 = 2.0

#: Possible luminance of white over that of red, green and blue together: limiters of OLED screens dim white, and a
#: white subpixel adds to it.
WHITE_OVER_PRIMARIES = (0.1, 5.0)


@dataclass(frozen=True)
class Measurements:
    """Readings of one display over its life.

    Attributes
    ----------
    hours, drive, xyz_cd_m2
        Operating hours, non-decreasing from 0, (n,); code values 0..1, (n, 3); CIE XYZ in cd/m², (n, 3).
    conditions
        Optional columns (position ``u``, ``v``, ``ambient_lx``, …) with more than one value, (n,) each.
    constants
        Optional column → value, for columns with the same value in every row.
    calibrations
        Hour → curves in the graphics card, (k, 4): input, red, green, blue; only known curves.
    session, note
        One text for each reading; empty: the file has none.
    order
        Numbers that grow with the time of reading, (n,); None: not known.
    lines
        Line number of each reading in the file, (n,).
    metadata
        The ``# key: value`` lines.
    remarks
        Remarks of the reader on its assumptions and on ignored columns.
    file, sha256
        Name of the file from the user, and the hash of its bytes.
    files
        File of each reading, if ``file`` names several files; otherwise empty.

    """

    hours: Array
    drive: Array
    xyz_cd_m2: Array
    lines: Array
    conditions: Mapping[str, Array] = field(default_factory=dict)
    session: tuple[str, ...] = ()
    note: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)
    file: str = "<memory>"
    sha256: str = ""
    order: Array | None = None
    constants: Mapping[str, float] = field(default_factory=dict)
    calibrations: Mapping[float, Array] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_rows(self)
        self._settle_shrouded()
        self._part_constants()
        check_tips(self)

    def _settle_shrouded(self) -> None:
        """Set the conditions that a shroud changes where a note says that it blocked the light; a remark says so."""
        blocked = is_shrouded(self)
        for name, value in ((name, each.shrouded) for name, each in COLUMNS.items() if each.shrouded is not None):
            changed = blocked & (self.column(name) != value)
            if changed.any():
                where, unit = self.places(np.flatnonzero(changed)), COLUMNS[name].unit
                remark = f"A shroud blocked the room's light at {where}: {value:g} {unit} there."
                conditions = {**self.conditions, name: np.where(changed, value, self.column(name))}
                object.__setattr__(self, "conditions", conditions)
                object.__setattr__(self, "remarks", (*self.remarks, remark))

    def _part_constants(self) -> None:
        """Move columns with the same value in every row from ``conditions`` to ``constants``."""
        fixed = {
            name: float(values[0])
            for name, values in self.conditions.items()
            if values.size and ((values == values[0]).all() or np.isnan(values).all())
        }
        known = {name: value for name, value in fixed.items() if not np.isnan(value)}
        varying = {name: values for name, values in self.conditions.items() if name not in fixed}
        constants = {name: value for name, value in self.constants.items() if name not in self.conditions}
        object.__setattr__(self, "conditions", varying)
        object.__setattr__(self, "constants", constants | known)

    @property
    def calibration(self) -> Array | None:
        """Curves in the graphics card at hour 0, (k, 4); None: not known."""
        return self.calibrations.get(0.0)

    def file_of(self, row: int) -> str:
        """Return the file of a reading."""
        return self.files[row] if self.files else self.file

    def places(self, rows: Iterable[int]) -> str:
        """Return the lines of readings: "lines 3, 4"; for several files "a.ti3, line 3; b.ti3, line 4"."""
        lines: dict[str, list[int]] = {}
        for row in rows:
            lines.setdefault(self.file_of(row), []).append(int(self.lines[row]))
        numbers = {file: ", ".join(map(str, sorted(each))) for file, each in lines.items()}
        texts = {file: f"line{'s' if len(lines[file]) > 1 else ''} {text}" for file, text in numbers.items()}
        return "; ".join(f"{Path(file).name}, {text}" if self.files else text for file, text in texts.items())

    def with_light(self, xyz_cd_m2: Array) -> Measurements:
        """Return the same readings with other XYZ, (n, 3) in cd/m², without checks; for simulations."""
        return _with(self, "xyz_cd_m2", xyz_cd_m2)

    def column(self, name: str) -> Array:
        """Return an optional column, (n,): from the conditions, the constants, or the value of a blank cell."""
        if name in self.conditions:
            return self.conditions[name]
        return np.full(self.hours.size, self.constants.get(name, OPTIONAL[name]))

    @cached_property
    def sessions(self) -> NDArray[np.intp]:
        """Session number of each reading, (n,); a session has one hour and one session name."""
        names = self.session or ("",) * self.hours.size
        number = np.unique(np.array(names), return_inverse=True)[1].reshape(-1)
        pairs = np.column_stack([self.hours, number])
        return np.asarray(np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1))

    @cached_property
    def rest(self) -> RestOfSessions:
        """The conditions under which the colour points of each reading's session were read."""
        # Constant columns also have an influence: a patch with a constant window below 1 has a surround.
        columns = {name: self.column(name) for name in COLUMNS if name in self.conditions or name in self.constants}
        return rest_of(self.sessions, self.hours, self.drive, is_capped(self), columns)

    @property
    def provenance(self) -> str:
        """One sentence with the file and its ``source`` line, which says whether the readings are simulated."""
        file, source = Path(self.file).name, self.metadata.get("source", "")
        if not source:
            return f"Readings: {file}, which does not say where they come from (no line `# source: …`)."
        return f"Readings: {file}. Source: {source}."

    def settled(self, name: str) -> Array:
        """Return a column, (n,), with every value that counts as rest replaced by the value at rest."""
        away = self.rest.away[OF_COLUMN[name].cell]
        return np.where(away, self.conditions[name], self.rest.values[name])

    def at_rest(self) -> NDArray[np.bool_]:
        """Return whether each reading has the conditions of the colour points of its session, (n,)."""
        return self.rest.reached(self.hours.size)

    def usual(self) -> dict[str, float]:
        """Return the rest of the campaign: column → median of the values at rest; only logged columns."""
        middles = {name: middle(at) for name, at in self.rest.values.items()}
        return {name: value for name, value in middles.items() if not np.isnan(value)}

    def above_rest(self, name: str) -> Array:
        """Return a column minus its value at rest in the reading's session, (n,); NaN: not logged."""
        return self.conditions[name] - self.rest.values[name]

    def tips(self) -> tuple[Array, Array]:
        """Return the hours with measured white and primaries, (N,), and their mean xyY in cd/m², (N, 4, 3).

        Replicates are averaged in XYZ. Hours without white or a primary are left out.
        """
        rest, tip = self.at_rest() & ~is_capped(self), is_tip(self.drive)
        hours, rows = [], []
        for hour in np.unique(self.hours):
            here = rest & (self.hours == hour)
            chosen = (here[:, np.newaxis] & tip).T
            if chosen.any():
                hours.append(hour)
                rows.append([self.xyz_cd_m2[rows_of].mean(axis=0) for rows_of in chosen])
        return np.array(hours), xyz_to_xyY(np.array(rows).reshape(-1, 4, 3))


def remarked(readings: Measurements, *remarks: str) -> Measurements:
    """Return the same readings with further remarks, without checks."""
    return _with(readings, "remarks", (*readings.remarks, *remarks))


def _with(readings: Measurements, field_name: str, value: Any) -> Measurements:
    other = copy(readings)
    object.__setattr__(other, field_name, value)
    return other


def in_any_order(**columns: Any) -> Measurements:
    """Return ``Measurements`` from rows in any order; the keywords are the fields of ``Measurements``.

    The rows are sorted by hour, session and all other columns, so that the result does not depend on their order.
    """
    session = np.unique(np.array(columns["session"]), return_inverse=True)[1].reshape(-1)
    notes = np.unique(np.array(columns["note"]), return_inverse=True)[1].reshape(-1)
    conditions = [np.where(np.isnan(values), np.inf, values) for values in columns["conditions"].values()]
    light, drive = columns["xyz_cd_m2"].T[::-1], columns["drive"].T[::-1]
    place = np.lexsort([*light, notes, *conditions[::-1], *drive, session, columns["hours"]])
    return Measurements(
        **{name: _placed(values, place) if name in _BY_READING else values for name, values in columns.items()}
    )


#: Fields of ``Measurements`` with one entry for each reading.
_BY_READING = {"hours", "drive", "xyz_cd_m2", "lines", "conditions", "session", "note", "order", "files"}


def _placed(values: Any, place: NDArray[np.intp]) -> Any:
    if values is None:
        return None
    if isinstance(values, dict):
        return {name: column[place] for name, column in values.items()}
    return values[place] if isinstance(values, np.ndarray) else tuple(values[row] for row in place)


def is_capped(readings: Measurements) -> NDArray[np.bool_]:
    """Return whether the note of each reading says that the lens was capped, (n,)."""
    return _noted(readings, says_cap)


def says_cap(note: str) -> bool:
    """Whether a note says that the lens was capped."""
    return "lens cap" in note.lower() or note.lower().strip() == "cap"


def is_shrouded(readings: Measurements) -> NDArray[np.bool_]:
    """Return whether the note of each reading says that a shroud blocked the room's light, (n,)."""
    return _noted(readings, says_shroud)


def says_shroud(note: str) -> bool:
    """Whether a note says that a shroud blocked the room's light."""
    return "shroud" in note.lower()


def _noted(readings: Measurements, says: Callable[[str], bool]) -> NDArray[np.bool_]:
    """Return whether the note of each reading satisfies ``says``, (n,); test each distinct note once."""
    if not readings.note:
        return np.zeros(readings.hours.size, dtype=bool)
    known = {note: says(note) for note in set(readings.note)}
    return np.array([known[note] for note in readings.note])


def check_rows(readings: Measurements) -> None:
    """Check the values of every reading, and that the hours do not decrease."""
    hours, drive, xyz = readings.hours, readings.drive, readings.xyz_cd_m2
    for name, values in (("hour", hours), ("drive", drive), ("XYZ", xyz)):
        _refuse(readings, ~np.isfinite(values.reshape(hours.size, -1)).all(axis=1), f"{name} is not a finite number")
    order = [("order", readings.order)] if readings.order is not None else []
    for name, values in (("hour", hours), ("XYZ", xyz), *order, *readings.conditions.items()):
        low, high, meaning = RANGES[name]
        outside = ((values < low) | (values > high)).reshape(hours.size, -1)
        if outside.any():
            row = _first(readings, outside.any(axis=1))
            value = values.reshape(hours.size, -1)[row][outside[row]][0]
            raise LutgenError(
                f"{_where(readings, row)}: {name} must be {meaning}; this value, {value:.13g}, is out of range: "
                f"{low:.13g} to {high:.13g} are allowed."
            )
    top = float(drive.max(initial=0.0))
    if 1 < top < MUCH_ABOVE_1:
        hint = f"drive values are code values 0..1; {top:g} is just above 1, as 256 of 255 would be"
        _refuse(readings, (drive == top).any(axis=1), hint)
    scale = "percent: divide by 100" if 1 < top <= 100 else "8-bit drive: divide by 255"
    hint = f"drive values are code values 0..1; the largest here is {top:g}, so these look like {scale}"
    _refuse(readings, (drive > 1).any(axis=1), hint)
    _refuse(readings, (drive < 0).any(axis=1), "drive values are code values 0..1, this one is negative")
    backwards = np.concatenate([[False], np.diff(hours) < 0])
    _refuse(readings, backwards, "the hour is smaller than on the row before; sort the rows by hour")
    if hours[0] != 0:
        row = int(np.argmin(np.where(hours == hours[0], readings.lines, np.inf)))
        raise LutgenError(
            f"{_where(readings, row)}: the first hour is {hours[0]:g}, but aging is measured from the un-aged display "
            f"at hour 0. Add its readings, or subtract {hours[0]:g} from every hour: in a .csv a line "
            f"'# start_hour: {hours[0]:g}' does that."
        )


def check_tips(readings: Measurements) -> None:
    """Check the tips of every hour with tips: complete, positive, plausible, and no hour occurs twice."""
    rest = readings.at_rest() & ~is_capped(readings)
    tip = is_tip(readings.drive)
    x, y, z = readings.xyz_cd_m2.T
    # Noise may bring the Z of red slightly below 0; a value below −1 % of Y is an error.
    dark = (y <= 0) | (np.minimum(x, z) < -0.01 * y)
    why = "negative: X, Y and Z of white or a primary at full drive must be above 0"
    _refuse(readings, tip.any(axis=1) & ~is_capped(readings) & dark, why)
    counts = {}
    for hour in np.unique(readings.hours):
        here = rest & (readings.hours == hour)
        count = tip[here].sum(axis=0)
        missing = [name for name, n in zip(TIP_NAMES, count, strict=True) if n == 0]
        if missing and (hour == 0 or count.any()):
            raise LutgenError(
                f"{readings.file}: no reading of {listed(missing)} at full drive at hour {hour:g}"
                f"{_under(readings)}. The model needs white, red, green and blue at hour 0, and later all four or none."
            )
        counts[float(hour)] = int(here.sum()), count
        if count.any():
            means = [readings.xyz_cd_m2[here & tip[:, i]].mean(axis=0) for i in range(4)]
            _check_plausible(readings, float(hour), xyz_to_xyY(np.array(means)))
    _check_repeated_hour(readings, counts)


def _under(readings: Measurements) -> str:
    """Return, in parentheses, the conditions that the four colour points must share; "" if no condition varies."""
    names = [each.name for each in CONDITIONS if any(column.name in readings.conditions for column in each.columns)]
    return f" (all four under the same {', '.join(names)})" if names else ""


def _check_plausible(readings: Measurements, hour: float, xyY: Array) -> None:
    where = f"{readings.file}: hour {hour:g}"
    if xyY[0, 2] < MIN_WHITE_CD_M2:
        raise LutgenError(
            f"{where}: white has Y = {xyY[0, 2]:g}; Y must be absolute luminance in cd/m², not relative to white."
        )
    ratio, (low, high) = xyY[0, 2] / xyY[1:, 2].sum(), WHITE_OVER_PRIMARIES
    if not low <= ratio <= high:
        raise LutgenError(
            f"{where}: white has Y = {xyY[0, 2]:g} and red, green and blue together {xyY[1:, 2].sum():g}. On a "
            f"display white is {low:g} to {high:g} times as bright as the three together; is a number mistyped?"
        )
    red, green, blue = xyY[1:]
    if not _are_primaries(red, green, blue) and any(_are_primaries(*order) for order in permutations(xyY[1:])):
        or_xy = ", or x and y (X and Y)" if _are_primaries(*xyY[1:, [1, 0]]) else ""
        raise LutgenError(
            f"{where}: red, green and blue have each other's colours; are the R, G, B columns swapped{or_xy}?"
        )
    swapped = np.column_stack([1.0 - xyY[1:, 0] - xyY[1:, 1], xyY[1:, 1]])
    if not _are_primaries(red, green, blue) and _are_primaries(*swapped):
        raise LutgenError(
            f"{where}: red has x = {red[0]:.3f} and blue x = {blue[0]:.3f}, which no display has; are X and Z swapped?"
        )


def _are_primaries(red: Array, green: Array, blue: Array) -> bool:
    """Whether red has the largest x, green the largest y and blue the smallest y, as on every display."""
    reddest = red[0] > max(green[0], blue[0])
    return bool(reddest and green[1] > max(red[1], blue[1]) and blue[1] < min(red[1], green[1]))


def _check_repeated_hour(readings: Measurements, counts: dict[float, tuple[int, Array]]) -> None:
    """Raise LutgenError if one hour has two sets of colour points and all other hours one: a mistyped hour."""
    tips_only = all(n == count.sum() for n, count in counts.values())
    twice = [hour for hour, (_, count) in counts.items() if (count == 2).all()]
    once = [hour for hour, (_, count) in counts.items() if (count == 1).all()]
    if tips_only and len(twice) == 1 and len(once) == len(counts) - 1 and once:
        raise LutgenError(
            f"{readings.file}: hour {twice[0]:g} appears twice, the others once. Correct or delete one of the two; "
            f"if these are replicates, read replicates at every hour."
        )


def _refuse(readings: Measurements, bad: ArrayLike, why: str) -> None:
    if np.any(bad):
        raise LutgenError(f"{_where(readings, _first(readings, bad))}: {why}.")


def _first(readings: Measurements, bad: ArrayLike) -> int:
    """Return the first of the bad readings in the order of the file."""
    wrong = np.flatnonzero(bad)
    return int(wrong[0] if readings.files else wrong[np.argmin(readings.lines[wrong])])


def _where(readings: Measurements, row: int) -> str:
    return f"{readings.file_of(row)}, line {int(readings.lines[row])}"
