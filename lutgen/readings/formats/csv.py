"""Tables of readings (CSV) from people, scripts and spreadsheets: a header, then one row for each reading.

Required columns: ``R,G,B`` and ``X,Y,Z`` in cd/m² or ``x,y,Y``. A table with ``hour`` holds the life of a display: code
values are 0..1 and light is absolute. A table without ``hour`` holds one session: full drive is its largest value (1,
100, 255 or 1023) or the scale in ``# drive: percent``, and light may be relative to white. Optional columns: the
columns of conditions (``u,v,ambient_lx,…``), ``session``, ``order`` (a number that grows with the time of reading),
``note`` and the name of a patch. The order of rows has no meaning. Lines that begin with ``#`` are comments; ``# key:
value`` is metadata. lutgen subtracts the value of ``# start_hour: 2400`` from every hour. Commas, semicolons or tabs
separate fields.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lutgen.cells import BLANKS, has_decimal_comma, is_comment, metadata, number, separator_of
from lutgen.colorimetry import Array, xyY_to_xyz
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.readings.campaign import Campaign, alone, sessions_of
from lutgen.readings.formats import _csv_words as words
from lutgen.readings.formats._csv_doubts import on_spread, on_spreads, refuse_jumps, white_at_rest, white_like_relative
from lutgen.readings.formats._source import FULL_DRIVE, WHITE_CD_M2, FileText, date_of, full_drive, is_dark, whites
from lutgen.readings.session import MOST_READINGS, Session
from lutgen.readings.table import OPTIONAL, RANGES, Measurements, in_any_order, remarked

NAME = "CSV of readings"
SUFFIXES = (".csv", ".tsv")

#: First line in which spreadsheets state the separator of fields.
_SEPARATOR_LINE = re.compile(r"\ufeff?\"?sep=.\"?[,;\t]*", re.IGNORECASE)

#: Separators of fields, in words.
_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}

#: Words of a column's name that make it a time.
_TIMES = {
    *("h", "hr", "hrs", "hour", "hours", "time", "t", "age", "date", "dates"),
    *("day", "days", "week", "weeks", "month", "months", "year", "years"),
}

#: Smallest allowed y. The smallest y of a colour is 0.005, at the violet end of the spectrum; a far smaller y overflows
#: xY/y.
MIN_Y = 1e-4

_REMEDY = "Add the line # white_cd_m2: 120.0, with white's luminance; or name the columns X_cdm2, Y_cdm2, Z_cdm2."

#: A white below the first number, or equal to 1 or 100, counts as relative unless the header names the unit.
_LEAST_WHITE, _RELATIVE_WHITES = 2.0, (1.0, 100.0)


def claims(source: FileText) -> bool:
    """Whether the first line that is no comment is a header with R, G, B and at least three more fields."""
    head = next((line for line in source.text.splitlines() if line.strip() and not _is_ignored(line)), "")
    cells = [words.plain(cell) for cell in head.split(separator_of(head))]
    return len(cells) > 5 and {"R", "G", "B"} <= {*cells} and "BEGIN_DATA" not in source.text


def read(source: FileText) -> "CsvTable":
    """Read a table of readings. Raises LutgenError; the message names file, line and column."""
    comments: dict[str, str] = {}
    header: tuple[str, ...] = ()
    separator = ","
    cells: list[list[str]] = []
    lines: list[int] = []
    for at, line in enumerate(source.text.splitlines(), start=1):
        if is_comment(line):
            comments |= dict(filter(None, [metadata(line)]))
        elif _is_ignored(line):
            continue
        elif line.strip() and not header:
            separator = separator_of(line)
            header = tuple(source.row(line, at, separator))
            remarks = words.check_header(header, source.at(at))
        elif line.strip() and len(cells) == MOST_READINGS:
            raise LutgenError(f"{source.at(at)}: more than {MOST_READINGS} rows, which no table has. Split the file.")
        elif line.strip(BLANKS + separator):
            fields = source.row(line, at, separator)
            _check_fields(fields, header, source.at(at), separator)
            cells.append(fields)
            lines.append(at)
    words.states_unit(comments, source.file)
    if not cells:
        raise LutgenError(
            f"{source.file}: no readings. It needs a header such as hour,R,G,B,x,y,Y and one row a reading."
        )
    table = CsvTable(
        source,
        comments,
        header,
        tuple(map(words.plain, header)),
        cells,
        lines,
        (*remarks, *words.remarks_on_keys(comments)),
    )
    table.check_end()
    return table


@dataclass(frozen=True)
class CsvTable:
    """A table with checked header and number of fields; methods parse the values on demand."""

    #: Text and name of the file.
    source: FileText
    #: The ``# key: value`` lines.
    metadata: Mapping[str, str]
    #: Names of the columns as written, and normalised (see ``plain``).
    header: tuple[str, ...]
    columns: tuple[str, ...]
    #: Fields of each reading, and its line number in the file.
    cells: list[list[str]]
    lines: list[int]
    #: Remarks on ignored columns and keys.
    remarks: tuple[str, ...]

    def measurements(self) -> Measurements:
        """Return the table of a display's life; a table without hours counts as hour 0."""
        if "hour" not in self.columns:
            return alone(self._session()).measurements()
        if "white_cd_m2" in self.metadata:
            raise LutgenError(
                f"{self.source.file}: white_cd_m2 is for a table of one session; with hours, light must be in cd/m²."
            )
        values = self._values
        words.refuse_thousands(self._texts("hour"), self.lines, self.source.file)
        readings = in_any_order(
            hours=words.since_start(values["hour"], self.metadata, self.source.file),
            drive=np.column_stack([values["R"], values["G"], values["B"]]),
            xyz_cd_m2=self._xyz(),
            lines=np.array(self.lines, dtype=np.float64),
            conditions=self._conditions,
            session=self._texts("session"),
            note=self._texts("note"),
            order=self._order(),
            metadata=self.metadata,
            remarks=self.remarks,
            file=self.source.file,
            sha256=self.source.sha256,
        )
        refuse_jumps(readings)
        white = None if self._names_unit() else white_like_relative(readings)
        unit_remark = "" if white is None else self._unit_remark(white, hour=0.0)
        return remarked(readings, *filter(None, (unit_remark, *on_spreads(readings))))

    def campaign(self) -> Campaign:
        """Return the sessions; a session has one hour and one session name."""
        hours = self._numbers("hour") if "hour" in self.columns else np.zeros(len(self.cells))
        if len({*zip(hours.tolist(), self._texts("session"), strict=True)}) > 1 and "hour" in self.columns:
            return sessions_of(self.measurements())
        return alone(self._session())

    def _check_times(self) -> None:
        """Raise LutgenError if an unknown column seems to divide the readings of one session by time."""
        for at, name in enumerate(self.header):
            is_time = words.is_unknown(self.columns[at]) and bool(_TIMES & {*re.split("[^a-z]+", name.casefold())})
            times = {row[at] for row in self.cells}
            if is_time and 2 <= len(times) <= len(self.cells) / 2:
                raise LutgenError(
                    f"{self.source.file}: column {name[:40]!r} looks like times, and there is no column hour. "
                    "Call it hour if it holds operating hours; else add a column hour, or remove this column if all "
                    "readings are of one session."
                )

    def _session(self) -> Session:
        self._check_times()
        values = self._values
        self._check_ranges(*OPTIONAL, "order")
        drive = np.column_stack([values["R"], values["G"], values["B"]])
        drive = drive / self._full_drive(drive)
        xyz = self._xyz()
        white, unit_remark = self._white(drive, xyz)
        spread_remark = self._spread_remark(drive, xyz, unit=" cd/m²" if white is None else "")
        created, date_remark = date_of(self.metadata.get("date", ""))
        label = next((name for name in self.header if name.lower() in words.NAMES), "")
        session = Session(
            drive=drive,
            xyz=xyz if white is None else xyz / white,
            absolute=white is None,
            remedy="" if white is None else _REMEDY,
            names=self._texts(label, self.header),
            lines=np.array(self.lines, dtype=np.int64),
            form=NAME,
            conditions=self._conditions,
            order=self._order(),
            notes=self._texts("note"),
            created=created,
            instrument=self.metadata.get("instrument", ""),
            display=self.metadata.get("display", ""),
            remarks=tuple(filter(None, (unit_remark, spread_remark, date_remark, *self.remarks))),
            date_remark=date_remark,
            metadata=self.metadata,
            file=self.source.file,
            sha256=self.source.sha256,
        )
        luminance = self._stated_white()
        return session if luminance is None else session.with_white(luminance, "by the file itself")

    def _stated_white(self) -> float | None:
        """Return white's luminance from the metadata, or None. If stated, light is relative to white on any scale."""
        text = self.metadata.get("white_cd_m2")
        if text is None:
            return None
        value, (low, high) = number(text), WHITE_CD_M2
        if value is None or not low <= value <= high:
            raise LutgenError(
                f"{self.source.file}: white_cd_m2 is {text[:40]!r}; it is white's luminance, {low:g}..{high:g} cd/m²."
            )
        return value

    def _white(self, drive: Array, xyz: Array) -> tuple[float | None, str]:
        """Return Y of white if light is relative to white, otherwise None; and a remark."""
        absolute = self._names_unit()
        places = whites(drive)
        white = float(np.median(xyz[places, 1])) if places.size else float(xyz[:, 1].max())
        stated = "white_cd_m2" in self.metadata
        if stated and not places.size:
            raise LutgenError(f"{self.source.file}: states white_cd_m2, and has no reading of white. Add one.")
        relative = not absolute and (stated or white < _LEAST_WHITE or white in _RELATIVE_WHITES)
        if (relative or places.size) and white <= 0:
            raise LutgenError(
                f"{self.source.file}: white has Y = {white:g}: no light. Correct the row of R = G = B = full drive."
            )
        if relative:
            remark = f"White has Y = {white:g}: taken as relative, not as cd/m²: only ratios are known."
            return white, "" if stated else remark
        return None, "" if absolute else self._unit_remark(white if places.size else None)

    def _names_unit(self) -> bool:
        """Whether the header or the metadata name cd/m² as the unit of light."""
        named = any(words.plain(name) == "Y" and words.UNIT.search(name.strip(' "')) for name in self.header)
        return words.states_unit(self.metadata, self.source.file) or named

    def _unit_remark(self, white: float | None, hour: float | None = None) -> str:
        """Return the remark that light is assumed to be in cd/m²; ``white``: its Y; ``hour``: its hour, if any."""
        is_xyz = "X" in self.columns
        light, verb, they, them = ("X, Y and Z", "are", "they", "them") if is_xyz else ("Y", "is", "it", "it")
        had = "" if white is None else f", of which white has {white:.4g}"
        remedy = "add the line # white_cd_m2: and white's luminance"
        if hour is not None:
            had += f" at hour {hour:g}"
            remedy = f"multiply {them} by white's luminance at hour {hour:g} over 100"
        return (
            f"{light} {verb} taken as cd/m²{had}: the header names no unit ({light[0]}_cdm2). If {they} {verb} "
            f"relative, {remedy}."
        )

    def _spread_remark(self, drive: Array, xyz: Array, unit: str) -> str:
        """Return a remark on readings of white at rest that are far apart; "" if they are not."""
        rows = white_at_rest(drive, self._conditions, self._texts("note"))
        ask = "is an hour or a number mistyped" if "hour" in self.columns else "is a column hour missing"
        return on_spread(xyz[rows, 1], 0.0, unit=unit, ask=ask)

    def _full_drive(self, drive: Array) -> float:
        declared = self.metadata.get("drive")
        if declared is None:
            return full_drive(drive, self.source.file, self.lines)
        known = {name: full for full, name in FULL_DRIVE.items()}
        refuse_unknown(f"scale of drive in {self.source.file}", declared, known)
        top = float(drive.max(initial=0.0))
        if 0.0 < top <= 1.0 < known[declared]:
            raise LutgenError(
                f"{self.source.file}: drive is said to be {declared}, but reaches only {top:g}. Write # drive: 0..1."
            )
        return known[declared]

    def _xyz(self) -> Array:
        values = self._values
        if {"X", "Y", "Z"} <= values.keys():
            return np.column_stack([values["X"], values["Y"], values["Z"]])
        x, y, luminance = values["x"], values["y"], values["Y"]
        xyY, remedy = np.column_stack([x, y, luminance]), "give a dark reading as X,Y,Z, or remove its row"
        lit = ~is_dark(xyY)
        for bad, column, why in (
            (lit & (y < MIN_Y), "y", f"y must be above 0: XYZ = xY/y would be infinite, or negative; {remedy}"),
            (lit & (x < 0), "x", f"x must not be negative; {remedy}"),
            (lit & (x + y > 1), "x", "x + y must not be above 1: that is no colour"),
            (luminance > RANGES["XYZ"][1], "Y", "Y is more than a million cd/m², which no display gives"),
            (lit & (luminance <= 0), "Y", f"Y must be above 0 cd/m²; {remedy}"),
        ):
            if bad.any():
                row = int(np.argmax(bad))
                values_text = f"x = {x[row]:g}, y = {y[row]:g}, Y = {luminance[row]:g}"
                raise LutgenError(f"{self.source.at(self.lines[row])}, column {column}: {why} ({values_text}).")
        return xyY_to_xyz(xyY)

    def _order(self) -> Array | None:
        """Return the order of reading; None if a reading has no number."""
        self._check_ranges("order")
        order = self._values.get("order")
        return None if order is None or np.isnan(order).any() else order

    def _check_ranges(self, *names: str) -> None:
        for name in (name for name in names if name in self._values):
            low, high, meaning = RANGES[name]
            outside, span = (self._values[name] < low) | (self._values[name] > high), f"{low:g}..{high:g}"
            allowed = meaning if meaning.endswith(span) else f"{meaning}, {span}"
            self.source.refuse(outside, self.lines, f", column {name}: must be {allowed}.")

    @cached_property
    def _values(self) -> dict[str, Array]:
        """Column of numbers → values, (n,)."""
        return {name: self._numbers(name) for name in words.KNOWN if name in self.columns and name not in words.TEXT}

    @cached_property
    def _conditions(self) -> dict[str, Array]:
        return {name: self._values[name] for name in OPTIONAL if name in self._values}

    def _numbers(self, name: str) -> Array:
        place = self.columns.index(name)
        blank = OPTIONAL.get(name, np.nan) if name in {*OPTIONAL, "order"} else None
        numbers = [
            blank if row[place] == "" and blank is not None else self.source.number(row[place], at, f"column {name}")
            for row, at in zip(self.cells, self.lines, strict=True)
        ]
        return np.array(numbers, dtype=np.float64)

    def _texts(self, name: str, columns: tuple[str, ...] | None = None) -> tuple[str, ...]:
        columns = columns or self.columns
        if name not in columns:
            return ("",) * len(self.cells)
        place = columns.index(name)
        return tuple(row[place] for row in self.cells)

    def check_end(self) -> None:
        """Raise LutgenError if the file is truncated: no final line end, and fewer decimals than in all other rows."""
        if self.source.text.endswith(("\n", "\r")) or len(self.cells) < 3:
            return
        *before, last = [len(row[-1].rpartition(".")[2]) if "." in row[-1] else 0 for row in self.cells]
        if len(set(before)) == 1 and last < before[0]:
            raise LutgenError(
                f"{self.source.at(self.lines[-1])}: the file ends inside {self.header[-1]} = {self.cells[-1][-1]!r} "
                f"({before[0]} decimals everywhere else, no line end): is it cut off? Copy it again."
            )


def _is_ignored(line: str) -> bool:
    """Whether a line is a comment, or states the separator, which lutgen reads from the header."""
    return is_comment(line) or bool(_SEPARATOR_LINE.fullmatch(line.strip()))


def _check_fields(fields: list[str], header: tuple[str, ...], where: str, separator: str) -> None:
    """Raise LutgenError if a row has more or fewer fields than the header, decimal commas, or a word for a number."""
    if separator == ";" and any(has_decimal_comma(field) for field in fields):
        raise LutgenError(f"{where}: decimal commas. Write 0.3127 with a point, whatever stands between fields.")
    word, column = fields[0], words.plain(header[0])
    if word[:1].isalpha() and (column in {*words.KNOWN} - {*words.TEXT} or not any(fields[1:])):
        raise LutgenError(
            f"{where}, column {column[:40]}: {word[:40]!r} is not a finite number. Remove rows that hold no reading."
        )
    if len(fields) == len(header):
        return
    other = separator_of(fields[0])
    if len(fields) == 1 and other != separator and fields[0].count(other) == len(header) - 1:
        raise LutgenError(
            f"{where}: {_SEPARATORS[other]} separate its fields, and {_SEPARATORS[separator]} those of the header. "
            "Write the same separator in all lines."
        )
    hint = "a decimal comma? Write 0.3127" if len(fields) > len(header) else "is the file cut off, or a value missing?"
    count = f"{len(fields)} field{'s' if len(fields) != 1 else ''}"
    raise LutgenError(f"{where}: {count} for {len(header)} columns; {hint}")
