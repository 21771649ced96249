"""Rewritings that lose information, such as replicates, digits or sessions."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.rewritings.rewriting import CannotRewrite, random_of, rewriting, rows_of_each, rows_of_sessions
from tests.generators.table import CONDITIONS, Table, is_colour_point

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.rewritings.rewriting import Rewriting

SOMETHING_LOST: dict[str, Rewriting] = {}


def _replicates(table: Table) -> list[NDArray[np.intp]]:
    """Return groups of rows that differ only in noise, and in temperature by its drift."""
    apart = ["hour", "R", "G", "B", *(name for name in CONDITIONS if name != "temperature_c")]
    values = [np.nan_to_num(table.numbers(name), nan=-1.0) for name in apart]
    if "temperature_c" in table.columns:
        warm = table.numbers("temperature_c")
        values.append(np.round((np.nan_to_num(warm, nan=np.nanmedian(warm)) - np.nanmedian(warm)) / 6.0))
    notes = table.columns.get("note", ("",) * len(table))
    return rows_of_each(zip(*(column.tolist() for column in values), table.session, notes, strict=True))


def _middle(table: Table) -> NDArray[np.intp]:
    """Return the rows of the middle session among the sessions that have colour points."""
    point = is_colour_point(table.drive) & table.at_rest()
    sessions = [rows for rows in rows_of_sessions(table) if point[rows].any()]
    if len(sessions) < 3:
        raise CannotRewrite("there is no session between the first and the last")
    return sessions[len(sessions) // 2]


def _dealt(table: Table) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the middle session's rows as two halves; replicates go alternately to either half."""
    middle = set(_middle(table).tolist())
    halves: tuple[list[int], list[int]] = ([], [])
    for rows in _replicates(table):
        for row in rows:
            if row in middle:
                halves[len(halves[0]) > len(halves[1])].append(int(row))
    return np.sort(halves[0]), np.sort(halves[1])


@rewriting(SOMETHING_LOST)
def a_session_in_two(table: Table) -> Table:
    """A session split in two names."""
    names = list(table.session)
    for row in _dealt(table)[1]:
        names[row] += " continued"
    return table.having(session=names)


@rewriting(SOMETHING_LOST)
def a_session_in_two_hours(table: Table) -> Table:
    """A session split in two names an hour apart."""
    later = _dealt(table)[1]
    drive, rest = table.drive, table.at_rest()
    points = {tuple(row) for row in drive[later][rest[later] & is_colour_point(drive[later])]}
    if len(points) < 4:
        raise CannotRewrite("the colour points are not repeated in the session: one half would lack them")
    names, hours = list(table.session), list(table.columns["hour"])
    for row in later:
        names[row] += " continued"
        hours[row] = f"{float(hours[row]) + 1.0:.10g}"
    split = table.having(session=names, hour=hours)
    return split.rows(np.argsort(split.numbers("hour"), kind="stable"))


@rewriting(SOMETHING_LOST)
def different_mixtures(table: Table) -> Table:
    """Different mixtures in each session: half of them, drawn anew."""
    random, drive = random_of(table), table.drive
    equal = (drive[:, 0] == drive[:, 1]) & (drive[:, 1] == drive[:, 2])
    lit = (drive > 0.0).sum(axis=1)
    alike = np.array([len(set(row[row > 0.0])) == 1 for row in drive])
    mixture = ~equal & (lit > 1) & ~alike
    keep = np.ones(len(table), dtype=bool)
    for rows in rows_of_sessions(table):
        colours = rows_of_each(map(tuple, drive[rows[mixture[rows]]]))
        mixed = rows[mixture[rows]]
        for chosen in random.permutation(len(colours))[: len(colours) // 2]:
            keep[mixed[colours[chosen]]] = False
    if keep.all():
        raise CannotRewrite("the campaign has no mixtures")
    return table.rows(np.flatnonzero(keep))


@rewriting(SOMETHING_LOST)
def replicates_averaged(table: Table) -> Table:
    """Every replicate averaged away but the colour points'."""
    point, xyz = is_colour_point(table.drive), table.xyz
    light = [[f"{value:.8g}" for value in row] for row in xyz]
    keep: list[int] = []
    for rows in _replicates(table):
        if len(rows) == 1 or point[rows[0]]:
            keep += rows.tolist()
        else:
            keep.append(int(rows[0]))
            light[rows[0]] = [f"{value:.8g}" for value in xyz[rows].mean(axis=0)]
    if len(keep) == len(table):
        raise CannotRewrite("nothing but the colour points has replicates")
    columns = dict(zip("XYZ", zip(*light, strict=True), strict=True))
    return table.lacking("x", "y").having(**columns).rows(sorted(keep))


@rewriting(SOMETHING_LOST)
def four_significant_digits(table: Table) -> Table:
    """Four significant digits of X, Y, Z."""
    columns = {name: [f"{float(cell):.4g}" for cell in table.columns[name]] for name in "XYZ" if name in table.columns}
    columns |= {name: [f"{float(cell):.4f}" for cell in table.columns[name]] for name in "xy" if name in table.columns}
    return table.having(**columns)


@rewriting(SOMETHING_LOST)
def irregular_hours(table: Table) -> Table:
    """Irregular hours, and one session with half the patches."""
    random, sessions = random_of(table), rows_of_sessions(table)
    if len(sessions) < 5:
        raise CannotRewrite("fewer than five sessions: two of them cannot go")
    gone = {int(each) for each in random.choice(np.arange(1, len(sessions) - 1), 2, replace=False)}
    remaining = [rows for i, rows in enumerate(sessions) if i not in gone]
    halved = int(random.integers(1, len(remaining) - 1))
    point, same = is_colour_point(table.drive), _replicates(table)
    patches = [rows for rows in same if not point[rows[0]] and np.isin(rows, remaining[halved]).all()]
    out = {row for i in random.permutation(len(patches))[: len(patches) // 2] for row in patches[i].tolist()}
    return table.rows(row for rows in remaining for row in rows.tolist() if row not in out)


@rewriting(SOMETHING_LOST)
def metadata_absent(table: Table) -> Table:
    """Metadata lines absent."""
    head = tuple(line for line in table.head if "simulated" in line.lower())[:1]
    if len(head) == len(table.head):
        raise CannotRewrite("the file has no metadata")
    return replace(table, head=head)


@rewriting(SOMETHING_LOST)
def order_absent(table: Table) -> Table:
    """Order of reading absent."""
    if "order" not in table.columns:
        raise CannotRewrite("the file has no column order")
    return table.lacking("order")
