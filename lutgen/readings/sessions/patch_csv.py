"""A plain table of patches (CSV): drive and XYZ of each, one row a reading, as scripts and spreadsheets write it.

The header names columns R, G, B and X, Y, Z (or x, y, Y) in any order; ``X_cdm2`` says cd/m². The range of drive is
told by its largest value, which must be full drive, or by a comment ``# drive: percent``. A table of lutgen's with one
hour is read too.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from lutgen.cells import is_comment
from lutgen.colorimetry import xyY_to_xyz
from lutgen.errors import LutgenError, pick_one
from lutgen.readings.session import MOST_READINGS, Session
from lutgen.readings.sessions._source import (
    FULL_DRIVE,
    date_of,
    first_doubled,
    full_drive,
    number,
    separated,
    whites,
)

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.sessions._source import Source

NAME = "CSV of patches"

_METADATA = re.compile(r"#\s*([A-Za-z][\w -]*?)\s*:\s*(.*)")
_UNIT = re.compile(r"[_ ]?[(\[]?(?:cd[_ /]?m2|cd/m²|nits?)[)\]]?$", re.IGNORECASE)
_DRIVE = {"R": "R", "G": "G", "B": "B", "RED": "R", "GREEN": "G", "BLUE": "B", "RGB_R": "R", "RGB_G": "G", "RGB_B": "B"}
_NAMES = ("set", "name", "patch", "sample", "sample_id", "note")

#: Characters of a comment that are looked at.
_LONGEST_COMMENT = 1000

#: White below this, or just at 1 or 100, is no luminance in cd/m².
_LEAST_WHITE, _RELATIVE_WHITES = 2.0, (1.0, 100.0)


def claims(text: str) -> bool:
    """Whether the first line that is no comment is a header of such a table."""
    if "BEGIN_DATA" in text:
        return False
    head = next((line for line in text.splitlines() if line.strip() and not is_comment(line)), "")
    separator = _separator(head)
    cells = {_plain(cell)[0] for cell in head.split(separator)} if separator else set()
    return {"R", "G", "B"} <= cells


def read(source: Source) -> Session:
    """Read such a table. Raises LutgenError naming file, line and column."""
    metadata, columns, cells, lines = _split(source)
    units = dict(map(_plain, columns))
    names = [_plain(name)[0] for name in columns]
    values = {name: _column(source, names, cells, lines, name) for name in _colour_columns(source, names)}
    _check_one_hour(source, names, cells)
    drive = np.column_stack([_column(source, names, cells, lines, name) for name in "RGB"])
    drive = drive / _declared(source, metadata, drive)
    if "X" in values:
        xyz = np.column_stack([values[name] for name in "XYZ"])
    else:
        x, y = values["x"], values["y"]
        bad = (y < 1e-3) | (x < 0) | (x + y > 1)
        if bad.any():
            message = f"{source.at(lines[int(np.argmax(bad))])}: x and y are no chromaticity: above 0, x + y at most 1."
            raise LutgenError(message)
        xyz = xyY_to_xyz(np.column_stack([x, y, values["Y"]]))
    absolute = units.get("Y") is not None
    places = whites(drive)
    white = float(np.median(xyz[places, 1])) if places.size else float(xyz[:, 1].max())
    relative = not absolute and (white < _LEAST_WHITE or white in _RELATIVE_WHITES)
    if (relative or places.size) and white <= 0:
        message = f"{source.file}: white has Y = {white:g}: no light. Correct the row of R = G = B = full drive."
        raise LutgenError(message)
    label = next((n for n, name in enumerate(columns) if name.lower() in _NAMES), None)
    created, doubt = date_of(metadata.get("date", ""))
    remarks = [doubt] if doubt else []
    if relative:
        remarks.append(f"White has Y = {white:g}: taken as relative, not as cd/m². Good for ratios alone.")
    elif not absolute:
        remarks.append("X, Y and Z are taken as cd/m²; the header does not name a unit (X_cdm2).")
    return Session(
        drive=drive,
        xyz=xyz / white if relative else xyz,
        absolute=not relative,
        names=tuple(row[label] if label is not None else "" for row in cells),
        lines=np.array(lines, dtype=np.int64),
        form=NAME,
        created=created,
        instrument=metadata.get("instrument", ""),
        display=metadata.get("display", ""),
        remarks=tuple(remarks),
        metadata=metadata,
        file=source.file,
        sha256=source.sha256,
    )


def _separator(head: str) -> str | None:
    return next((mark for mark in (",", "\t", ";") if head.count(mark) >= 5), None)


def _plain(cell: str) -> tuple[str, str | None]:
    """Name of a column without its unit, drive in capitals, and the unit."""
    name = cell.strip().strip('"')
    bare = _UNIT.sub("", name)
    return _DRIVE.get(bare.upper() if len(bare) > 1 else bare, bare), None if bare == name else name[len(bare) :]


def _split(source: Source) -> tuple[dict[str, str], list[str], list[list[str]], list[int]]:
    metadata: dict[str, str] = {}
    columns: list[str] = []
    cells: list[list[str]] = []
    lines: list[int] = []
    separator = None
    for at, line in enumerate(source.text.splitlines(), start=1):
        if is_comment(line):
            if match := _METADATA.match(line[:_LONGEST_COMMENT]):
                metadata[match[1].strip().lower()] = match[2].strip()
        elif line.strip():
            separator = separator or _separator(line)
            fields = separated(line, separator or ",", source.at(at))
            if not columns:
                columns = fields
            elif len(fields) != len(columns):
                message = (
                    f"{source.at(at)}: {len(fields)} fields for {len(columns)} columns: is a value missing, a decimal "
                    "comma in it, or the file cut off?"
                )
                raise LutgenError(message)
            elif len(cells) == MOST_READINGS:
                message = f"{source.at(at)}: more than {MOST_READINGS} rows, which no session has. Split the file."
                raise LutgenError(message)
            else:
                cells.append(fields)
                lines.append(at)
    if not cells:
        message = f"{source.file}: holds no readings: a header, and no row below it. Give one row a reading."
        raise LutgenError(message)
    return metadata, columns, cells, lines


def _colour_columns(source: Source, names: list[str]) -> tuple[str, ...]:
    doubled = first_doubled([name for name in names if name])
    if doubled:
        message = f"{source.file}: column {doubled!r} appears twice in the header. Name each column once."
        raise LutgenError(message)
    for wanted in (("X", "Y", "Z"), ("x", "y", "Y")):
        if set(wanted) <= set(names):
            return wanted
    message = f"{source.file}: the header has R, G, B but neither X, Y, Z nor x, y, Y: {', '.join(names[:12])}."
    raise LutgenError(message)


def _column(source: Source, names: list[str], cells: list[list[str]], lines: list[int], name: str) -> Array:
    place = names.index(name)
    return np.array([number(row[place], source.at(at), f"column {name}") for row, at in zip(cells, lines, strict=True)])


def _declared(source: Source, metadata: dict[str, str], drive: Array) -> float:
    said = metadata.get("drive")
    if said is None:
        return full_drive(drive, source.file)
    known = {name: full for full, name in FULL_DRIVE.items()}
    if said not in known:
        raise pick_one(f"{source.file}: drive", said, known)
    top = float(drive.max(initial=0.0))
    if 0.0 < top <= 1.0 < known[said]:
        message = f"{source.file}: drive is said to be {said}, but reaches only {top:g}. Write # drive: 0..1."
        raise LutgenError(message)
    return known[said]


def _check_one_hour(source: Source, names: list[str], cells: list[list[str]]) -> None:
    if "hour" in names and len({row[names.index("hour")] for row in cells}) > 1:
        message = f"{source.file}: readings of several hours, not of one session. See them with lutgen show --display."
        raise LutgenError(message)
