"""``Session``: the readings of one display by one run of a measuring program, checked once and then frozen.

A session need not be complete, as :class:`~lutgen.readings.table.Measurements` must be: it has a date at best and no
operating hours, may be relative, and may lack white, black or primaries. Whoever needs a missing patch says so.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings.campaign import Campaign
    from lutgen.readings.table import Measurements

#: Kinds of patches, by their drive: the tips, the middle of the cube, and mixtures.
KINDS = ("white", "black", "grey", "red", "green", "blue", "mixture")

#: A patch counts as full drive, as no drive, or as grey within this tolerance: files round at the fifth digit.
DRIVE_TOLERANCE = 1e-4

#: Readings of a session, at most: profiling charts have up to 10 000 patches.
MOST_READINGS = 100_000

#: Smallest XYZ (noise lies below 0), and largest XYZ in cd/m² and relative to white: no display is brighter.
LOWEST, HIGHEST_CD_M2, HIGHEST_RELATIVE = -1.0, 1e5, 10.0


@dataclass(frozen=True)
class Session:
    """The readings of one session, in the order of the file."""

    #: Code values 0..1, (n, 3).
    drive: Array
    #: CIE 1931 XYZ, (n, 3): in cd/m² where ``absolute``, else relative with Y = 1 for the display's white.
    xyz: Array
    #: Whether ``xyz`` is in cd/m².
    absolute: bool
    #: What the file calls each patch; "" where it does not.
    names: tuple[str, ...]
    #: The line of the file that each reading came from, (n,).
    lines: NDArray[np.int64]
    #: Name of the file's format, for people.
    form: str
    #: Positions on the screen, (n, 2) as shares from the left and the top; None: not known.
    positions: Array | None = None
    #: Other columns of conditions (``ambient_lx``, …) that the file has, each of shape (n,).
    conditions: Mapping[str, Array] = field(default_factory=dict)
    #: Numbers that grow with the time of reading, (n,); None: not known, and rows may be sorted.
    order: Array | None = None
    #: A note on each reading, "lens cap" for one; empty where the file has none.
    notes: tuple[str, ...] = ()
    #: Spectral radiance as the file gives it, (n, k), and nanometres, (k,); or None.
    spectra: Array | None = None
    wavelengths: Array | None = None
    #: The curves in the graphics card during the session, (k, 4): input, red, green and blue, 0..1; None: the file has
    #: none.
    calibration: Array | None = None
    #: Date and time of the session; None where the file has none, or one that cannot be right.
    created: datetime | None = None
    #: Their names; "" where the file does not say.
    instrument: str = ""
    display: str = ""
    #: Of a session that is not ``absolute``: what to write so that it is, a sentence.
    remedy: str = ""
    #: Sentences on what the reader had to decide, and on values that it did not accept.
    remarks: tuple[str, ...] = ()
    #: All other keywords of the file, and their values.
    metadata: Mapping[str, str] = field(default_factory=dict)
    #: The file as the user named it, and the hash of its bytes.
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
        self._refuse((self.drive < 0) | (self.drive > 1), "drive is outside 0..1 of its range")
        self._refuse(
            (self.xyz < LOWEST) | (self.xyz > highest), f"XYZ is outside {LOWEST:g} to {highest:g} {unit}, no light"
        )
        if self.calibration is not None:
            check_calibration(self.calibration, self.file)

    def _refuse(self, bad: NDArray[np.bool_], why: str) -> None:
        rows = bad.any(axis=1)
        if rows.any():
            raise LutgenError(
                f"{self.file}, line {int(self.lines[np.argmax(rows)])}: {why}. Correct the row, or delete it."
            )

    def without(self, rows: NDArray[np.int64]) -> Session:
        """Return the session without some of its readings."""
        kept = np.setdiff1d(np.arange(len(self.drive)), rows)
        arrays = {name: getattr(self, name) for name in ("drive", "xyz", "lines", "positions", "spectra", "order")}
        fields: dict[str, Any] = {name: values[kept] for name, values in arrays.items() if values is not None}
        fields["conditions"] = {name: values[kept] for name, values in self.conditions.items()}
        for name, texts in (("names", self.names), ("notes", self.notes)):
            fields[name] = tuple(texts[row] for row in kept) if texts else ()
        return replace(self, **fields)

    def campaign(self) -> Campaign:
        """Return the campaign of this session alone."""
        from lutgen.readings.campaign import campaign_of, entry_of

        return campaign_of([entry_of(self)], file=self.file)

    def measurements(self) -> Measurements:
        """Return the readings as those of a display at hour 0. Raises LutgenError as :meth:`Campaign.measurements`."""
        return self.campaign().measurements()

    def with_white(self, cd_m2: float, said: str) -> Session:
        """Return a relative session in cd/m², where white's luminance is known; ``said``: by whom, after a comma.

        Raises LutgenError: the session is in cd/m² already.
        """
        if self.absolute:
            raise LutgenError(f"{self.file}: is in cd/m², and white_cd_m2 is stated, {said}. Delete white_cd_m2.")
        remark = f"White is {cd_m2:g} cd/m², {said}; all other light is relative to it."
        return replace(self, xyz=self.xyz * cd_m2, absolute=True, remedy="", remarks=(*self.remarks, remark))

    @property
    def xyz_cd_m2(self) -> Array:
        """XYZ in cd/m², (n, 3). Raises LutgenError where the session is relative."""
        if not self.absolute:
            raise LutgenError(
                f"{self.file}: XYZ are relative to white, and the file does not say how bright white was. {self.remedy}"
            )
        return self.xyz

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """The kind of each reading, one of ``KINDS``; the ramp of a single channel has the name of the channel."""
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
        """Rows of the readings of these kinds nearest to the middle of the screen, in the order of the file."""
        chosen = np.isin(np.array(self.kinds), kinds)
        return np.flatnonzero(chosen & self.central)

    @cached_property
    def central(self) -> NDArray[np.bool_]:
        """Which readings were taken nearest to the middle of the screen, (n,): all where positions are not known."""
        if self.positions is None:
            return np.ones(len(self.drive), dtype=bool)
        away = np.hypot(*(self.positions - 0.5).T)
        return np.asarray(away <= away.min() + 1e-6)


def check_calibration(curves: Array, file: str) -> None:
    """Refuse calibration curves that no graphics card holds: not 0..1, or an input that does not rise from 0 to 1."""
    if len(curves) < 2 or not np.isfinite(curves).all() or curves.min() < -1e-3 or curves.max() > 1.0 + 1e-3:
        raise LutgenError(f"{file}: the calibration curves need two points or more, all between 0 and 1.")
    steps = curves[:, 0]
    if np.any(np.diff(steps) <= 0) or abs(steps[0]) > 1e-3 or abs(steps[-1] - 1.0) > 1e-3:
        raise LutgenError(
            f"{file}: RGB_I of the calibration curves must rise from 0 to 1: is a row missing, or out of order?"
        )
