"""Input and output of a reader, and the rules that all readers share: the range of drive, dates, and white."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lutgen import cells
from lutgen.colorimetry import Array, xyY_to_xyz
from lutgen.errors import LutgenError
from lutgen.readings.campaign import Campaign
from lutgen.readings.session import DRIVE_TOLERANCE
from lutgen.readings.table import Measurements

#: Value of full drive in files → name of the scale.
FULL_DRIVE = {1.0: "0..1", 100.0: "percent", 255.0: "8-bit", 1023.0: "10-bit"}

#: Allowed range of a display's white, in cd/m².
WHITE_CD_M2 = (0.01, 1e5)

#: Largest X, Y and Z of a dark reading, as a share of the largest Y: there noise may give any x and y, also below 0.
DARK = 1e-4

#: A date outside these years is an error.
YEARS = range(1990, 2100)

#: First bytes of files that people may have next to their readings, and a text: the kind of the file, and the remedy.
_BINARY = (
    (b"PK\x03\x04", "a zipped file (a spreadsheet?). Save the table as CSV, or unpack it"),
    (b"%PDF", "a PDF report. Take the table of readings itself: .ti3, CGATS or CSV"),
    (b"\x1f\x8b", "a gzip file. Unpack it first"),
)

#: Largest number of characters of a date.
_LONGEST = 60

_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
#: "Tue May 26 13:21:48 2020", as C's asctime writes; "May 26, 2020".
_NAMED = re.compile(
    r"(?:[A-Za-z]{3,9},?\s+)??([A-Za-z]{3,9})\.?\s+(\d{1,2}),?\s+(?:(\d{1,2}):(\d{2})(?::(\d{2}))?\s+)?(\d{4})",
    re.ASCII,
)
_ISO = re.compile(
    r"(\d{4})-(\d{1,2})-(\d{1,2})(?:[T ](\d{1,2}):(\d{2})(?::(\d{2}))?)?(?:[.,]\d+)?(?:Z|[+-]\d\d:?\d\d)?", re.ASCII
)
#: 26.05.2020, 05/26/2020: the order is known only if one of the numbers cannot be a month.
_SLASHED = re.compile(
    r"(\d{1,2})[./-](\d{1,2})[./-](\d{4})(?:,?\s+(\d{1,2}):(\d{2})(?::(\d{2}))?(?:\s*[AP]M)?)?", re.ASCII
)


class Readable(Protocol):
    """Result of a reader of several sessions: the readings, as one checked table or as sessions."""

    def measurements(self) -> Measurements:
        """Return one table by operating hours. Raises LutgenError: the readings do not form a valid table."""

    def campaign(self) -> Campaign:
        """Return the sessions. Raises LutgenError: there are none."""


@dataclass(frozen=True)
class FileText:
    """A file: its text ("" for an ICC profile), its name from the user, and the hash of its bytes.

    ``data`` holds the bytes, for readers of binary formats; b"" for a text inside another file.
    """

    text: str
    file: str
    sha256: str
    data: bytes = b""

    def at(self, line: int) -> str:
        """Return file and line, for error messages."""
        return f"{self.file}, line {line}"

    def refuse(self, bad: NDArray[np.bool_], lines: Sequence[int], why: str) -> None:
        """Raise LutgenError for the first bad row, (n,), if there is one; ``lines``: line of each row."""
        if bad.any():
            raise LutgenError(f"{self.at(lines[int(np.argmax(bad))])}{why}")

    def number(self, cell: str, line: int, column: str) -> float:
        """Return the finite number in a cell. Raises LutgenError: no finite number; a hint names a decimal comma."""
        value = cells.number(cell)
        if value is None:
            hint = "; a decimal comma? Write 0.3127 with a point" if cells.has_decimal_comma(cell) else ""
            reason = f": {cell[:40]!r} is not a finite number{hint}" if cell.strip() else " is empty: give a value"
            raise LutgenError(f"{self.at(line)}, {column}{reason}.")
        return value

    def row(self, text: str, line: int, separator: str = ",") -> list[str]:
        """Split a line of a CSV file into cells. Raises LutgenError: the line is no CSV row."""
        try:
            return cells.split_row(text, separator)
        except csv.Error as error:
            # For example a cell of more than 128 kB.
            raise LutgenError(
                f"{self.at(line)}: is no row of a CSV: {error}. Write a number in each cell, and the note shorter."
            ) from None


def decoded(data: bytes, file: str) -> str:
    """Decode UTF-8, UTF-16 with a byte order mark, or otherwise Latin-1, in which every byte is a character.

    Raises LutgenError: the file is binary or empty.
    """
    for head, what in _BINARY:
        if data.startswith(head):
            raise LutgenError(f"{file}: is {what}.")
    if Path(file).suffix.lower() == ".chc":
        raise LutgenError(
            f"{file}: is HCFR's own binary file. Export the measures from HCFR, and name columns R,G,B,X,Y,Z."
        )
    try:
        text = data.decode("utf-16" if data[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise LutgenError(f"{file}: holds NUL bytes: a binary file? lutgen reads text: .ti3, CGATS or CSV.")
    if not text.strip():
        raise LutgenError(f"{file}: the file is empty. It needs a header line and one row a reading.")
    return text


def full_drive(drive: Array, file: str, lines: Sequence[int]) -> float:
    """Return full drive (1, 100, 255 or 1023) from the largest value of a file that does not state full drive.

    ``drive`` (n, 3), on the ``lines`` (n,) of the file. Raises LutgenError: the largest value is none of these.
    """
    top = float(drive.max(initial=0.0))
    for full in FULL_DRIVE:
        if abs(top - full) <= DRIVE_TOLERANCE * full:
            return full
    known = ", ".join(f"{full:g} ({name})" for full, name in FULL_DRIVE.items())
    row = int(drive.max(axis=1).argmax()) if len(drive) else 0
    rest = float(np.delete(drive, row, axis=0).max(initial=0.0)) if len(drive) else 0.0
    if any(abs(rest - full) <= DRIVE_TOLERANCE * full for full in FULL_DRIVE):
        raise LutgenError(
            f"{file}, line {lines[row]}: a drive of {top:g}, but full drive is {rest:g} in all other lines. Correct it."
        )
    raise LutgenError(
        f"{file}: the largest drive is {top:g}, and full drive is one of {known}; the file does not say which. "
        "Add the reading of white, or convert drive to 0..1."
    )


def is_dark(xyY: Array) -> NDArray[np.bool_]:
    """Whether readings, (n, 3), have so little light that x and y are noise; False where y or Y is 0: X is unknown."""
    known = (xyY[:, 1:] != 0).all(axis=1)
    xyz = xyY_to_xyz(np.where(known[:, np.newaxis], xyY, 1.0))
    return np.asarray(known & (np.abs(xyz) <= DARK * xyY[:, 2].max(initial=0.0)).all(axis=1))


def whites(drive: Array) -> NDArray[np.intp]:
    """Return the rows with full drive of all channels, for drive 0..1."""
    return np.flatnonzero((drive >= 1.0 - DRIVE_TOLERANCE).all(axis=1))


def date_of(text: str) -> tuple[datetime | None, str]:
    """Parse a date. The second result is a sentence about an unreadable or implausible date, or ""."""
    if not text.strip():
        return None, ""
    text = text[:_LONGEST]
    try:
        date = _date(" ".join(text.split()))
    except ValueError as error:
        return None, f"Its date, {text[:40]!r}, is no date: {error}."
    if date is None:
        return None, f"Its date, {text[:40]!r}, is unknown or ambiguous; write it as 2020-05-26."
    if date.year not in YEARS:
        return None, f"Its date, {text[:40]!r}, is not plausible: displays have been measured since {YEARS[0]}."
    return date, ""


def _date(text: str) -> datetime | None:
    if match := _ISO.fullmatch(text):
        return datetime(*(int(part or 0) for part in match.groups()))  # type: ignore[arg-type]  # noqa: DTZ001 - local time
    if match := _NAMED.fullmatch(text):
        month, day, *clock, year = match.groups()
        if month[:3].lower() not in _MONTHS:
            return None
        place = _MONTHS.index(month[:3].lower()) + 1
        return datetime(int(year), place, int(day), *(int(part or 0) for part in clock))  # type: ignore[arg-type]  # noqa: DTZ001 - local
    if match := _SLASHED.fullmatch(text):
        one, two, year = (int(part) for part in match.groups()[:3])
        if one <= 12 and two <= 12 and one != two:
            return None
        day, month_number = (one, two) if one > 12 else (two, one)
        return datetime(year, month_number, day)  # noqa: DTZ001 - local time
    return None
