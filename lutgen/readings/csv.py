"""The plain table of readings (CSV): a header, then one row a reading.

Required columns: ``hour``, ``R,G,B`` (code values 0..1) and ``X,Y,Z`` in cd/m² or ``x,y,Y``. Optional:
the columns of conditions (``u,v,ambient_lx,…``), ``session``, ``order`` (a number that grows with the time of reading)
and ``note``. The order of rows means nothing. Lines that begin with ``#`` are comments, ``# key: value`` is metadata;
``# start_hour: 2400`` is taken from every hour. Fields are separated by commas, or by semicolons, as Excel writes them
where the comma is no decimal point.
"""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.cells import BLANKS, is_comment, number
from lutgen.colorimetry import xyY_to_xyz
from lutgen.errors import LutgenError
from lutgen.readings.table import OPTIONAL, RANGES, Measurements, in_any_order

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

_TEXT = ("session", "note")
_KNOWN = ("hour", "R", "G", "B", "X", "Y", "Z", "x", "y", *OPTIONAL, "order", *_TEXT)
_METADATA = re.compile(r"#\s*([A-Za-z][\w -]*?)\s*:\s*(.*)")
_DECIMAL_COMMA = re.compile(r"\d,\d+;|;\s*\d+,\d")

#: No colour has a smaller y than the violet end of the spectrum, 0.005; far below, xY/y overflows.
MIN_Y = 1e-4


class _Rows(NamedTuple):
    columns: list[str]
    cells: list[list[str]]
    lines: list[int]
    metadata: dict[str, str]


def read(text: str, *, file: str, sha256: str) -> Measurements:
    """Read CSV ``text``; ``file`` is named in errors. Raises LutgenError naming file, line and column."""
    if _DECIMAL_COMMA.search(text):
        message = f"{file}: decimal commas. Write 0.3127 with a point, whether ',' or ';' stands between fields."
        raise LutgenError(message)
    rows = _split(text, file)
    _check_cut_off(text, rows, file)
    values = {name: _numbers(rows, name, file) for name in rows.columns if name not in _TEXT}
    if "X" in values:
        xyz = np.column_stack([values["X"], values["Y"], values["Z"]])
    else:
        _check_chromaticity(values, rows, file)
        xyz = xyY_to_xyz(np.column_stack([values["x"], values["y"], values["Y"]]))
    words = {name: _texts(rows, name) for name in _TEXT}
    return in_any_order(
        hours=_since_start(values["hour"], rows.metadata, file),
        drive=np.column_stack([values["R"], values["G"], values["B"]]),
        xyz_cd_m2=xyz,
        lines=np.array(rows.lines, dtype=np.float64),
        conditions={name: values[name] for name in OPTIONAL if name in values},
        session=words["session"],
        note=words["note"],
        order=_order(values, rows, file),
        metadata=rows.metadata,
        file=file,
        sha256=sha256,
    )


def _order(values: dict[str, Array], rows: _Rows, file: str) -> Array | None:
    """The order of reading; None where one reading lacks its place."""
    order = values.get("order")
    if order is None:
        return None
    low, high, meaning = RANGES["order"]
    outside = (order < low) | (order > high)
    if outside.any():
        message = (
            f"{file}, line {rows.lines[int(np.argmax(outside))]}, column order: must be {meaning}, {low:g}..{high:g}."
        )
        raise LutgenError(message)
    return None if np.isnan(order).any() else order


def _since_start(hours: Array, metadata: dict[str, str], file: str) -> Array:
    """Hours since the un-aged display: less the counter's ``# start_hour``, where the file states one."""
    text = metadata.get("start_hour")
    if text is None:
        return hours
    start = number(text)
    if start is None:
        message = f"{file}: start_hour is {text[:40]!r}; it is the counter's hour at the first session, such as 2400."
        raise LutgenError(message)
    if hours.min() != start:
        message = (
            f"{file}: start_hour is {start:g}, and the smallest hour is {hours.min():g}. They must be the same: aging "
            f"is told from the first session."
        )
        raise LutgenError(message)
    return hours - start


def _split(text: str, file: str) -> _Rows:
    separator = ","
    metadata: dict[str, str] = {}
    columns: list[str] = []
    cells: list[list[str]] = []
    lines: list[int] = []
    for at, line in enumerate(text.splitlines(), start=1):
        if is_comment(line):
            if match := _METADATA.match(line):
                metadata[match[1].strip().lower()] = match[2].strip()
        elif line.strip():
            if not columns and "," not in line and ";" in line:
                separator = ";"
            fields = _fields(line, f"{file}, line {at}", separator)
            if not columns:
                columns = _header(fields, f"{file}, line {at}")
            else:
                _check_width(fields, columns, f"{file}, line {at}")
                cells.append(fields)
                lines.append(at)
    if not cells:
        message = f"{file}: no readings. The file needs a header such as hour,R,G,B,x,y,Y and one row a reading."
        raise LutgenError(message)
    return _Rows(columns, cells, lines, metadata)


def _fields(line: str, where: str, separator: str) -> list[str]:
    try:
        return [cell.strip(BLANKS) for cell in next(csv.reader([line], delimiter=separator))]
    except csv.Error as error:
        # As of a cell of more than 128 kB.
        message = f"{where}: is no row of a CSV: {error}. Write a number in each cell, and the note shorter."
        raise LutgenError(message) from None


def _header(fields: list[str], where: str) -> list[str]:
    unknown = [name for name in fields if name not in _KNOWN]
    if unknown:
        message = f"{where}: unknown column {unknown[0]!r} in the header. Pick one of: {', '.join(_KNOWN)}."
        raise LutgenError(message)
    doubled = [name for name in fields if fields.count(name) > 1]
    if doubled:
        message = f"{where}: column {doubled[0]!r} appears twice in the header. Name each column once."
        raise LutgenError(message)
    missing = [name for name in ("hour", "R", "G", "B") if name not in fields]
    if not missing and not {"X", "Y", "Z"} <= set(fields) and not {"x", "y", "Y"} <= set(fields):
        missing = ["X,Y,Z or x,y,Y"]
    if missing:
        message = f"{where}: the header lacks {', '.join(missing)}. Required: hour,R,G,B and X,Y,Z in cd/m² or x,y,Y."
        raise LutgenError(message)
    if {"X", "Z"} <= set(fields) and {"x", "y"} & set(fields):
        message = f"{where}: the header has both X,Y,Z and x,y. Keep one of them: they could contradict each other."
        raise LutgenError(message)
    return fields


def _check_width(fields: list[str], columns: list[str], where: str) -> None:
    if len(fields) > len(columns):
        message = f"{where}: {len(fields)} fields for {len(columns)} columns; a decimal comma? Write 0.3127."
        raise LutgenError(message)
    if len(fields) < len(columns):
        message = f"{where}: {len(fields)} fields for {len(columns)} columns; is the file cut off, or a value missing?"
        raise LutgenError(message)


def _check_cut_off(text: str, rows: _Rows, file: str) -> None:
    """A file that ends inside its last number: no line end, and fewer decimals than all the rows before."""
    if text.endswith(("\n", "\r")) or len(rows.cells) < 3:
        return
    *before, last = [len(cells[-1].rpartition(".")[2]) if "." in cells[-1] else 0 for cells in rows.cells]
    if len(set(before)) == 1 and last < before[0]:
        message = (
            f"{file}, line {rows.lines[-1]}: the file ends inside {rows.columns[-1]} = {rows.cells[-1][-1]!r} "
            f"({before[0]} decimals everywhere else, no line end): is it cut off? Copy it again."
        )
        raise LutgenError(message)


def _numbers(rows: _Rows, name: str, file: str) -> Array:
    place = rows.columns.index(name)
    values = np.empty(len(rows.cells))
    for row, cells in enumerate(rows.cells):
        cell = cells[place]
        if cell == "" and name in {*OPTIONAL, "order"}:
            values[row] = OPTIONAL.get(name, np.nan)
            continue
        value = number(cell)
        if value is None:
            hint = "; a decimal comma? Write 0.3127 with a point" if re.fullmatch(r"-?\d+,\d+", cell) else ""
            message = f"{file}, line {rows.lines[row]}, column {name}: {cell[:40]!r} is not a finite number{hint}."
            raise LutgenError(message)
        values[row] = value
    return values


def _check_chromaticity(values: dict[str, Array], rows: _Rows, file: str) -> None:
    x, y, luminance = values["x"], values["y"], values["Y"]
    for bad, column, why in (
        (y < MIN_Y, "y", "y must be above 0: XYZ = xY/y would be infinite"),
        (x < 0, "x", "x must not be negative"),
        (x + y > 1, "x", "x + y must not be above 1: that is no colour"),
        (luminance > RANGES["XYZ"][1], "Y", "Y is more than a million cd/m², which no display gives"),
        (luminance <= 0, "Y", "Y must be above 0 cd/m²; a dark reading has no chromaticity, give it as X,Y,Z"),
    ):
        if bad.any():
            row = int(np.argmax(bad))
            given = f"x = {x[row]:g}, y = {y[row]:g}, Y = {luminance[row]:g}"
            message = f"{file}, line {rows.lines[row]}, column {column}: {why} ({given})."
            raise LutgenError(message)


def _texts(rows: _Rows, name: str) -> tuple[str, ...]:
    if name not in rows.columns:
        return ("",) * len(rows.cells)
    place = rows.columns.index(name)
    return tuple(cells[place] for cells in rows.cells)
