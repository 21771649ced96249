"""``Measurements``: the readings of one display, checked once and then frozen."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_xyY
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from lutgen.colorimetry import Array

#: The tips: white and the primaries at full drive, in the order of the paper's index i.
TIP_NAMES = ("white", "red", "green", "blue")
TIP_DRIVES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])

#: Optional columns and the value that is meant when a column is absent (NaN: unknown, or warm).
OPTIONAL = {
    "u": 0.5,
    "v": 0.5,
    "ambient_lx": 0.0,
    "warmup_min": np.nan,
    "temperature_c": np.nan,
    "window": 1.0,
    "surround": 0.0,
}

#: Smallest and largest value of each column, and what it is: beyond them lies a slip, not a measurement.
RANGES = {
    "u": (0.0, 1.0, "the position from the left, 0..1"),
    "v": (0.0, 1.0, "the position from the top, 0..1"),
    "ambient_lx": (0.0, 200_000.0, "the room's light in lux, from 0 on"),
    "warmup_min": (0.0, 1e6, "minutes since power-on, from 0 on"),
    "temperature_c": (-50.0, 150.0, "degrees Celsius"),
    "window": (1e-6, 1.0, "the share of the screen that the patch covers, above 0 and up to 1"),
    "surround": (0.0, 1.0, "the code value around the patch, 0..1"),
    "hour": (0.0, 1e7, "operating hours, counted from the un-aged display at 0, never negative"),
    "XYZ": (-1e6, 1e6, "light in cd/m²"),
}

#: White below this is no display's luminance in cd/m²: the values are then relative (Y = 1 for white).
MIN_WHITE_CD_M2 = 2.0


#: Temperatures of one hour that differ by less are the same room; some 0.3 % of luminance a kelvin.
FEW_KELVINS = 3.0


@dataclass(frozen=True)
class Measurements:
    """Readings of one display over its life.

    Attributes
    ----------
    hours, drive, xyz_cd_m2
        One entry a reading, shapes (n,), (n, 3) and (n, 3): operating hours, non-decreasing from 0; code
        values 0..1; CIE XYZ in cd/m².
    conditions
        The optional columns (position ``u``, ``v``, ``ambient_lx``, …), each of shape (n,).
    session, note
        One text a reading; empty where the file has none.
    lines
        The line of the file that each reading came from, shape (n,).
    metadata
        The ``# key: value`` lines.
    file, sha256
        Where the readings came from, as the user named it, and the hash of those bytes.

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

    def __post_init__(self) -> None:
        """Refuse what no display does: values out of range, unsorted hours, tips that are missing or swapped."""
        check_rows(self)
        check_tips(self)

    @property
    def provenance(self) -> str:
        """One sentence: the file, and its ``source`` line, in which readings that nobody took say so."""
        file, source = Path(self.file).name, self.metadata.get("source", "")
        if not source:
            return f"Readings: {file}, which does not say where they come from (no line `# source: …`)."
        return f"Readings: {file}. Source: {source}."

    def at_rest(self) -> NDArray[np.bool_]:
        """Readings under the reference conditions: centre, dark room, full screen, as warm as that hour got."""
        condition = self.conditions
        rest = np.ones(self.hours.size, dtype=bool)
        for name in ("u", "v", "ambient_lx", "window"):
            if name in condition:
                rest &= np.abs(condition[name] - OPTIONAL[name]) < 0.02
        if "warmup_min" in condition:
            minutes = np.nan_to_num(condition["warmup_min"], nan=np.inf)
            for hour in np.unique(self.hours):
                here = self.hours == hour
                rest &= ~here | (minutes >= minutes[here].max())
        if "temperature_c" in condition:
            rest &= ~(np.abs(self.warmer()) > FEW_KELVINS)
        return rest

    def warmer(self) -> Array:
        """Temperature of each reading less the median of its hour, in kelvins, (n,); NaN where it was not logged."""
        temperature = self.conditions["temperature_c"]
        warmer = np.full(self.hours.size, np.nan)
        known = ~np.isnan(temperature)
        for hour in np.unique(self.hours[known]):
            here = (self.hours == hour) & known
            warmer[here] = temperature[here] - np.median(temperature[here])
        return warmer

    def tips(self) -> tuple[Array, Array]:
        """Return the hours at which the tips were measured, (N,), and their mean xyY in cd/m², (N, 4, 3).

        Replicates are averaged as light (XYZ). Hours at which no tip was measured are left out.
        """
        rest = self.at_rest()
        hours, rows = [], []
        for hour in np.unique(self.hours):
            here = rest & (self.hours == hour)
            is_tip = here & (self.drive[:, np.newaxis] == TIP_DRIVES).all(axis=-1).T
            if is_tip.any():
                hours.append(hour)
                rows.append([self.xyz_cd_m2[rows_of].mean(axis=0) for rows_of in is_tip])
        return np.array(hours), xyz_to_xyY(np.array(rows).reshape(-1, 4, 3))


def is_capped(readings: Measurements) -> NDArray[np.bool_]:
    """Readings with the lens capped, which their note says: (n,)."""
    notes = readings.note or ("",) * readings.hours.size
    return np.array(["lens cap" in note.lower() or note.lower().strip() == "cap" for note in notes])


def is_shrouded(readings: Measurements) -> NDArray[np.bool_]:
    """Readings that a shroud kept from the room's light, which their note says: (n,)."""
    notes = readings.note or ("",) * readings.hours.size
    return np.array(["shroud" in note.lower() for note in notes])


def check_rows(readings: Measurements) -> None:
    """Check every reading by itself, and that hours do not run backwards."""
    hours, drive, xyz = readings.hours, readings.drive, readings.xyz_cd_m2
    for name, values in (("hour", hours), ("drive", drive), ("XYZ", xyz)):
        _refuse(readings, ~np.isfinite(values.reshape(hours.size, -1)).all(axis=1), f"{name} is not a finite number")
    for name, values in (("hour", hours), ("XYZ", xyz), *readings.conditions.items()):
        low, high, meaning = RANGES[name]
        outside = ((values < low) | (values > high)).reshape(hours.size, -1).any(axis=1)
        _refuse(readings, outside, f"{name} must be {meaning}; this value is out of range")
    top = float(drive.max(initial=0.0))
    scale = "100: these look like percent, divide by 100" if 1 < top <= 100 else "255: 8-bit drive, divide by 255"
    hint = f"drive values are code values 0..1, the largest here is {top:g} (of {scale})"
    _refuse(readings, (drive > 1).any(axis=1), hint)
    _refuse(readings, (drive < 0).any(axis=1), "drive values are code values 0..1, this one is negative")
    backwards = np.concatenate([[False], np.diff(hours) < 0])
    _refuse(readings, backwards, "the hour is smaller than on the row before; sort the rows by hour")
    if hours[0] != 0:
        message = (
            f"{_where(readings, 0)}: the first hour is {hours[0]:g}, but aging is told from the un-aged display at "
            f"hour 0. Add its readings, or subtract {hours[0]:g} from every hour."
        )
        raise LutgenError(message)


def check_tips(readings: Measurements) -> None:
    """Check the tips of every hour that has any: complete, positive, plausible, and not the same hour twice."""
    rest = readings.at_rest()
    is_tip = (readings.drive[:, np.newaxis] == TIP_DRIVES).all(axis=-1)
    x, y, z = readings.xyz_cd_m2.T
    # Noise may push a red's Z a little below 0; a whole percent of Y is a slip.
    dark = (y <= 0) | (np.minimum(x, z) < -0.01 * y)
    _refuse(
        readings, is_tip.any(axis=1) & dark, "negative: X, Y and Z of white or a primary at full drive must be above 0"
    )
    counts = {}
    for hour in np.unique(readings.hours):
        here = rest & (readings.hours == hour)
        count = is_tip[here].sum(axis=0)
        missing = [name for name, n in zip(TIP_NAMES, count, strict=True) if n == 0]
        if missing and (hour == 0 or count.any()):
            message = (
                f"{readings.file}: no reading of {' and '.join(missing)} at full drive at hour {hour:g} "
                f"(centre, dark, full screen). The model needs white, red, green and blue at every hour it starts from."
            )
            raise LutgenError(message)
        counts[float(hour)] = int(here.sum()), count
        means = [readings.xyz_cd_m2[here & is_tip[:, i]].mean(axis=0) for i in range(4)] if count.any() else []
        if means:
            _check_plausible(readings, float(hour), xyz_to_xyY(np.array(means)))
    _check_repeated_hour(readings, counts)


def _check_plausible(readings: Measurements, hour: float, xyY: Array) -> None:
    where = f"{readings.file}: hour {hour:g}"
    if xyY[0, 2] < MIN_WHITE_CD_M2:
        message = f"{where}: white has Y = {xyY[0, 2]:g}; Y must be absolute luminance in cd/m², not relative to white."
        raise LutgenError(message)
    red, green, blue = xyY[1:]
    if not _are_primaries(red, green, blue) and any(_are_primaries(*order) for order in permutations(xyY[1:])):
        message = f"{where}: red, green and blue have each other's colours; are the R, G, B columns swapped?"
        raise LutgenError(message)


def _are_primaries(red: Array, green: Array, blue: Array) -> bool:
    """Whether red has the largest x, green the largest y and blue the smallest y: so on every display."""
    reddest = red[0] > max(green[0], blue[0])
    return bool(reddest and green[1] > max(red[1], blue[1]) and blue[1] < min(red[1], green[1]))


def _check_repeated_hour(readings: Measurements, counts: dict[float, tuple[int, Array]]) -> None:
    """In a file of single tips, one hour with exactly two sets is the same hour typed twice, not replicates."""
    tips_only = all(n == count.sum() for n, count in counts.values())
    twice = [hour for hour, (_, count) in counts.items() if (count == 2).all()]
    once = [hour for hour, (_, count) in counts.items() if (count == 1).all()]
    if tips_only and len(twice) == 1 and len(once) == len(counts) - 1 and once:
        message = (
            f"{readings.file}: hour {twice[0]:g} appears twice, the others once. Correct or delete one of the two; "
            f"replicates, if they are meant, are taken at every hour."
        )
        raise LutgenError(message)


def _refuse(readings: Measurements, bad: ArrayLike, why: str) -> None:
    if np.any(bad):
        first = int(np.argmax(bad))
        message = f"{_where(readings, first)}: {why}."
        raise LutgenError(message)


def _where(readings: Measurements, row: int) -> str:
    return f"{readings.file}, line {int(readings.lines[row])}"
