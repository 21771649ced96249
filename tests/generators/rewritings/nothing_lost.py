"""Rewritings that lose nothing: the order of rows, blanks and constants, digits, and the file itself."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.rewritings.rewriting import CannotRewrite, random_of, rewriting, rows_of_sessions
from tests.generators.table import BLANK, BOM, CONDITIONS, Table

if TYPE_CHECKING:
    from tests.generators.rewritings.rewriting import Rewriting

NOTHING_LOST: dict[str, Rewriting] = {}

#: Value of an optional column in every row of a campaign with constant conditions.
ALWAYS = {**BLANK, "warmup_min": 60.0, "temperature_c": 24.3}

#: Hours on the display's counter at the first session.
COUNTER = 2400.0


# Nothing lost: rows.


@rewriting(NOTHING_LOST)
def rows_shuffled_within_sessions(table: Table) -> Table:
    """Rows shuffled within each session."""
    random = random_of(table)
    return table.rows(np.concatenate([random.permutation(rows) for rows in rows_of_sessions(table)]))


@rewriting(NOTHING_LOST)
def sessions_shuffled(table: Table) -> Table:
    """Sessions shuffled, each in one piece."""
    sessions = rows_of_sessions(table)
    return table.rows(np.concatenate([sessions[i] for i in random_of(table).permutation(len(sessions))]))


@rewriting(NOTHING_LOST)
def all_rows_shuffled(table: Table) -> Table:
    """Rows shuffled over the whole file, without a column order."""
    if "order" in table.columns:
        raise CannotRewrite("the file has a column order")
    return table.rows(random_of(table).permutation(len(table)))


@rewriting(NOTHING_LOST)
def all_rows_shuffled_with_order(table: Table) -> Table:
    """Rows shuffled over the whole file, with a column order."""
    if "order" not in table.columns:
        raise CannotRewrite("the file has no column order")
    return table.rows(random_of(table).permutation(len(table)))


# Nothing lost: optional columns, and the values at rest.


def _constant(table: Table, name: str) -> bool:
    """Return whether a column is absent or has the same value in every row."""
    return len(set(np.nan_to_num(table.numbers(name), nan=-1.0))) == 1


def _one_session_an_hour(table: Table) -> bool:
    return len(set(table.session)) == len(rows_of_sessions(table)) == len(set(table.columns["hour"]))


@rewriting(NOTHING_LOST)
def resting_columns_absent(table: Table) -> Table:
    """Optional columns that never change absent."""
    idle = [name for name in CONDITIONS if name in table.columns and _constant(table, name)]
    if "session" in table.columns and _one_session_an_hour(table):
        idle.append("session")
    if not any(table.columns.get("note", ("here",))):
        idle.append("note")
    if not idle:
        raise CannotRewrite("no optional column is at rest in every row")
    return table.lacking(*idle)


@rewriting(NOTHING_LOST)
def resting_cells_blank(table: Table) -> Table:
    """Cells that hold what a blank means blank, and columns that never change."""
    # A blank means "warm" for minutes and "unknown" for temperatures, not a number, unless the column never changes.
    blank = {
        name: ["" if always or cell == "" or float(cell) == BLANK.get(name) else cell for cell in table.columns[name]]
        for name in CONDITIONS
        if name in table.columns
        for always in [_constant(table, name)]
    }
    if "session" in table.columns and _one_session_an_hour(table):
        blank["session"] = [""] * len(table)
    if all(list(table.columns[name]) == cells for name, cells in blank.items()):
        raise CannotRewrite("no cell holds what a blank means")
    return table.having(**blank)


@rewriting(NOTHING_LOST)
def resting_cells_filled(table: Table) -> Table:
    """Optional columns filled with their rest value in every row."""
    filled = {}
    for name, rest in ALWAYS.items():
        cells = table.columns.get(name, ("",) * len(table))
        if name in BLANK or not any(cells):
            filled[name] = [cell or f"{rest:g}" for cell in cells]
    named = table.columns.get("session", ("",) * len(table))
    sessions = [cell or f"session {hour}" for cell, hour in zip(named, table.columns["hour"], strict=True)]
    return table.having(**filled, session=sessions)


@rewriting(NOTHING_LOST)
def sessions_renamed(table: Table) -> Table:
    """Sessions with other names."""
    numbers = {name: number for number, name in enumerate(sorted(set(table.session), reverse=True), start=1)}
    return table.having(session=[f"visit {numbers[name]}" for name in table.session])


def _always(table: Table, **values: str) -> Table:
    changing = [name for name in values if not _constant(table, name)]
    if changing:
        raise CannotRewrite(f"{changing[0]} changes in this campaign")
    return table.having(**{name: [value] * len(table) for name, value in values.items()})


@rewriting(NOTHING_LOST)
def five_lux_everywhere(table: Table) -> Table:
    """Room light of 5 lx in every row."""
    return _always(table, ambient_lx="5")


@rewriting(NOTHING_LOST)
def an_hour_everywhere(table: Table) -> Table:
    """An hour since power-on in every row."""
    return _always(table, warmup_min="60")


@rewriting(NOTHING_LOST)
def same_temperature_everywhere(table: Table) -> Table:
    """A room of 24 °C in every row."""
    return _always(table, temperature_c="24")


@rewriting(NOTHING_LOST)
def same_window_everywhere(table: Table) -> Table:
    """A window of 90 % in every row."""
    if not _constant(table, "surround"):
        raise CannotRewrite("surround changes in this campaign")
    return _always(table, window="0.9")


# Nothing lost: numbers.


@rewriting(NOTHING_LOST)
def chromaticity_and_luminance(table: Table) -> Table:
    """Light as x,y,Y."""
    if "X" not in table.columns:
        raise CannotRewrite("the file has x,y,Y already")
    xyz = table.xyz
    if (xyz <= 0.0).any():
        row = int(np.argmax((xyz <= 0.0).any(axis=1)))
        raise CannotRewrite(f"row {row + 1} has X, Y or Z of 0 or less, and no chromaticity")
    x, y = (xyz[:, :2] / xyz.sum(axis=1, keepdims=True)).T
    # More digits than any meter gives, so that the conversion back recovers the last digit of X and Z.
    columns = {"x": [f"{value:.12g}" for value in x], "y": [f"{value:.12g}" for value in y], "Y": table.columns["Y"]}
    return table.lacking("X", "Y", "Z").having(**columns)


@rewriting(NOTHING_LOST)
def hours_of_a_counter(table: Table) -> Table:
    """Hours as the display's counter shows them, 2400 at the first session."""
    if "start_hour" in table.metadata:
        raise CannotRewrite("the file has a start_hour already")
    # A session name that looks like an hour is a name, so it does not change.
    hours = [f"{float(cell) + COUNTER:.10g}" for cell in table.columns["hour"]]
    return replace(table.having(hour=hours), head=(*table.head, f"# start_hour: {COUNTER:g}"))


_NUMBER = re.compile(r"([+-]?\d+)(\.\d*)?([eE][+-]?\d+)?")


def _longer(cell: str) -> str:
    match = _NUMBER.fullmatch(cell)
    return cell if match is None else f"{match[1]}{match[2] or '.'}000{match[3] or ''}"


@rewriting(NOTHING_LOST)
def zeros_appended(table: Table) -> Table:
    """Three zeros appended to the digits of every number."""
    text = ("session", "note", "order")
    return table.having(
        **{name: [_longer(cell) for cell in cells] for name, cells in table.columns.items() if name not in text}
    )


# Nothing lost: the file.


@rewriting(NOTHING_LOST)
def semicolons(table: Table) -> Table:
    """Semicolons between fields, with decimal points."""
    return replace(table, separator=";")


@rewriting(NOTHING_LOST)
def windows_line_ends(table: Table) -> Table:
    """Lines that end in CR LF."""
    return replace(table, newline="\r\n")


@rewriting(NOTHING_LOST)
def byte_order_mark(table: Table) -> Table:
    """A byte order mark before the first line."""
    return replace(table, bom=BOM)


@rewriting(NOTHING_LOST)
def as_excel_saves_it(table: Table) -> Table:
    """Semicolons, CR LF and a byte order mark, as Excel saves a table."""
    return replace(table, separator=";", newline="\r\n", bom=BOM)
