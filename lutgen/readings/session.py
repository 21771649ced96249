"""``Session``: the readings of one display by one run of a measuring program, checked once and then frozen.

A session may be incomplete, unlike :class:`~lutgen.readings.table.Measurements`: a session has no operating hours and
possibly no date, may be relative to white, and may lack white, black or primaries. Code that needs a missing patch
raises an error.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError
from lutgen.readings.conditions.position import PLACE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Tolerance of drive for full drive, zero drive, grey, and readings of one patch. Files round at the fifth digit.
DRIVE_TOLERANCE = 1e-4

#: Largest number of readings of a session. Profiling charts have up to 10 000 patches.
MOST_READINGS = 100_000

#: Smallest allowed XYZ (below 0 because of noise), and largest allowed XYZ in cd/m² and relative to white.
LOWEST, HIGHEST_CD_M2, HIGHEST_RELATIVE = -1.0, 1e5, 10.0


@dataclass(frozen=True)
class Session:
    """The readings of one session, in the order of the file."""

    #: Code values 0..1, (n, 3).
    drive: Array
    #: CIE 1931 XYZ, (n, 3): in cd/m² if ``absolute``, otherwise relative with Y = 1 for white.
    xyz: Array
    #: Whether ``xyz`` is in cd/m².
    absolute: bool
    #: Name of each patch in the file; "": no name.
    names: tuple[str, ...]
    #: Line number of each reading in the file, (n,).
    lines: NDArray[np.int64]
    #: Name of the file's format, for people.
    form: str
    #: Columns of conditions in the file (``u``, ``v``, ``ambient_lx``, …), (n,) each.
    conditions: Mapping[str, Array] = field(default_factory=dict)
    #: Numbers that grow with the time of reading, (n,); None: not known; the rows may be sorted.
    order: Array | None = None
    #: A note on each reading, such as "lens cap"; empty: the file has no notes.
    notes: tuple[str, ...] = ()
    #: Spectral radiance in the unit of the file, (n, k), and wavelengths in nm, (k,); or None.
    spectra: Array | None = None
    wavelengths: Array | None = None
    #: Curves in the graphics card during the session, (k, 4): input, red, green and blue, 0..1; None: not in the file.
    calibration: Array | None = None
    #: Date and time of the session; None: missing or implausible.
    created: datetime | None = None
    #: Names of the instrument and the display; "": not in the file.
    instrument: str = ""
    display: str = ""
    #: Sentence for a session that is not ``absolute``: how the user can make it absolute.
    remedy: str = ""
    #: Remarks of the reader on its assumptions and on values that it did not accept.
    remarks: tuple[str, ...] = ()
    #: The remark, among ``remarks``, that says why the date in the file was not accepted; "": accepted, or no date.
    date_remark: str = ""
    #: Keywords of the file and their values.
    metadata: Mapping[str, str] = field(default_factory=dict)
    #: Name of the file from the user, and the hash of its bytes.
    file: str = "<memory>"
    sha256: str = ""

    def __post_init__(self) -> None:
        if not len(self.drive):
            raise LutgenError(
                f"{self.file}: holds no readings. A session has a row of R, G, B and X, Y, Z for every patch."
            )
        if len(self.drive) > MOST_READINGS:
            raise LutgenError(
                f"{self.file}: {len(self.drive)} readings; a session has at most {MOST_READINGS}. Split the file."
            )
        highest = HIGHEST_CD_M2 if self.absolute else HIGHEST_RELATIVE
        unit = "cd/m²" if self.absolute else "times white"
        self._refuse(~np.isfinite(np.hstack([self.drive, self.xyz])), "a value is not a finite number")
        self._refuse((self.drive < 0) | (self.drive > 1), "drive is outside 0..1 of full drive")
        span = f"{LOWEST:g} to {highest:g} {unit}"
        self._refuse((self.xyz < LOWEST) | (self.xyz > highest), f"XYZ is outside {span}: no display gives this light")
        if self.calibration is not None:
            check_calibration(self.calibration, self.file)

    def _refuse(self, bad: NDArray[np.bool_], why: str) -> None:
        rows = bad.any(axis=1)
        if rows.any():
            raise LutgenError(
                f"{self.file}, line {int(self.lines[np.argmax(rows)])}: {why}. Correct the row, or delete it."
            )

    def without(self, rows: NDArray[np.int64]) -> Session:
        """Return the session without these rows."""
        kept = np.setdiff1d(np.arange(len(self.drive)), rows)
        arrays = {name: getattr(self, name) for name in ("drive", "xyz", "lines", "spectra", "order")}
        fields: dict[str, Any] = {name: values[kept] for name, values in arrays.items() if values is not None}
        fields["conditions"] = {name: values[kept] for name, values in self.conditions.items()}
        for name, texts in (("names", self.names), ("notes", self.notes)):
            fields[name] = tuple(texts[row] for row in kept) if texts else ()
        return replace(self, **fields)

    def with_white(self, cd_m2: float, source: str) -> Session:
        """Return a relative session in cd/m²; white has ``cd_m2``. ``source``: origin of ``cd_m2``, for messages.

        Raises LutgenError: the session is already in cd/m².
        """
        if self.absolute:
            raise LutgenError(f"{self.file}: is in cd/m², and white_cd_m2 is stated, {source}. Delete white_cd_m2.")
        remark = f"White is {cd_m2:g} cd/m², {source}; all other light is relative to it."
        return replace(self, xyz=self.xyz * cd_m2, absolute=True, remedy="", remarks=(*self.remarks, remark))

    def dated_elsewhere(self) -> Session:
        """Return the session without the remark on its date, which nobody needs if a campaign states the time."""
        return replace(self, remarks=tuple(each for each in self.remarks if each != self.date_remark), date_remark="")

    @property
    def xyz_cd_m2(self) -> Array:
        """XYZ in cd/m², (n, 3). Raises LutgenError: the session is relative."""
        if not self.absolute:
            raise LutgenError(
                f"{self.file}: XYZ are relative to white, and the file does not say how bright white was. {self.remedy}"
            )
        return self.xyz

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each reading: white, black, grey, mixture; or red, green, blue for all levels of a single channel."""
        low, high = self.drive <= DRIVE_TOLERANCE, self.drive >= 1.0 - DRIVE_TOLERANCE
        grey = np.ptp(self.drive, axis=1) <= DRIVE_TOLERANCE
        kinds = np.full(len(self.drive), "mixture", dtype="<U7")
        for channel, name in enumerate(("red", "green", "blue")):
            others = np.delete(low, channel, axis=1)
            kinds[others.all(axis=1)] = name
        kinds[grey] = "grey"
        kinds[low.all(axis=1)] = "black"
        kinds[high.all(axis=1)] = "white"
        return tuple(kinds.tolist())

    def rows(self, *kinds: str) -> NDArray[np.int64]:
        """Return the rows of these kinds nearest to the centre of the screen, in the order of the file."""
        chosen = np.isin(np.array(self.kinds), kinds)
        return np.flatnonzero(chosen & self.central)

    @cached_property
    def positions(self) -> Array | None:
        """Positions on the screen as shares from the left and the top, (n, 2); None: not known."""
        if not {*PLACE} & self.conditions.keys():
            return None
        centre = np.full(len(self.drive), 0.5)
        return np.column_stack([self.conditions.get(name, centre) for name in PLACE])

    @cached_property
    def central(self) -> NDArray[np.bool_]:
        """Whether each reading is nearest to the centre of the screen, (n,); True if positions are unknown."""
        if self.positions is None:
            return np.ones(len(self.drive), dtype=bool)
        away = np.hypot(*(self.positions - 0.5).T)
        return np.asarray(away <= away.min() + 1e-6)


def check_calibration(curves: Array, file: str) -> None:
    """Raise LutgenError if calibration curves are outside 0..1, or their input does not rise from 0 to 1."""
    if len(curves) < 2 or not np.isfinite(curves).all() or curves.min() < -1e-3 or curves.max() > 1.0 + 1e-3:
        raise LutgenError(f"{file}: the calibration curves need two points or more, all between 0 and 1.")
    steps = curves[:, 0]
    if np.any(np.diff(steps) <= 0) or abs(steps[0]) > 1e-3 or abs(steps[-1] - 1.0) > 1e-3:
        raise LutgenError(
            f"{file}: RGB_I of the calibration curves must rise from 0 to 1: is a row missing, or out of order?"
        )
