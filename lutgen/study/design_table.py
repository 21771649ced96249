"""A design of one's own, as a CSV table: ``session,image,condition``, and if wanted ``reader`` and ``position``."""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, NamedTuple

from lutgen.errors import LutgenError, pick_one
from lutgen.files import read_at_most
from lutgen.study.design import MOST, Design, condition_of, ordered
from lutgen.study.protocol import Condition, Trial

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

NEEDED, OPTIONAL = ("session", "image", "condition"), ("reader", "position")

#: A row is some tens of bytes, and nobody reads a million images.
MAX_BYTES = 64_000_000

_WHOLE = re.compile(r"\d{1,9}", re.ASCII)


class _Row(NamedTuple):
    """A line of the table; ``reader`` is None where it is meant for every reader."""

    line: int
    session: int
    image: str
    condition: Condition
    reader: int | None
    position: int | None


def read_design(path: Path, images: Sequence[str], *, readers: int | None, seed: int) -> Design:
    """Read a table.

    Without ``reader`` every reader gets all rows; without ``position`` each reader's sessions are put into an order
    drawn as for a balanced design. Lines that are empty or begin with # say nothing.

    Parameters
    ----------
    images
        Names of the images that were given.
    readers
        How many, where the table does not say it; 1 for None.

    Raises
    ------
    LutgenError
        Not such a table, with the line; a session or reader that is left out; an image twice in a session.

    """
    rows = _rows(path, images)
    named = {row.reader for row in rows if row.reader is not None}
    if named and readers is not None and readers != max(named):
        message = f"{path}: has readers up to {max(named)}, and --readers says {readers}. Leave --readers out."
        raise LutgenError(message)
    count = max(named, default=readers or 1)
    sessions = max(row.session for row in rows)
    trials: list[Trial] = []
    for reader in range(1, count + 1):
        for session in range(1, sessions + 1):
            here = [row for row in rows if row.session == session and row.reader in (None, reader)]
            if not here:
                message = (
                    f"{path}: reader {reader} reads nothing in session {session}. Number readers and sessions from 1, "
                    "and give every reader every session."
                )
                raise LutgenError(message)
            trials += _session(path, here, reader, session, seed)
    read = {row.image for row in rows}
    conditions = {row.condition.name: row.condition for row in rows}
    return Design(tuple(conditions.values()), tuple(trials), tuple(image for image in images if image not in read))


def _session(path: Path, rows: Sequence[_Row], reader: int, session: int, seed: int) -> list[Trial]:
    shown: dict[str, _Row] = {}
    for row in rows:
        if row.image in shown:
            message = (
                f"{path}, line {row.line}: image {row.image} is in session {session} already (line "
                f"{shown[row.image].line}). Show each image once a session."
            )
            raise LutgenError(message)
        shown[row.image] = row
    if rows[0].position is None:
        return ordered({image: row.condition.name for image, row in shown.items()}, reader, session, seed)
    in_order = sorted(rows, key=lambda row: row.position or 0)
    for position, row in enumerate(in_order, 1):
        if row.position != position:
            message = (
                f"{path}, line {row.line}: position {row.position} where {position} is next for reader {reader} in "
                f"session {session}. Number a session's positions 1 to {len(rows)}, each once."
            )
            raise LutgenError(message)
    return [Trial(reader, session, position, row.image, row.condition.name) for position, row in enumerate(in_order, 1)]


def _rows(path: Path, images: Sequence[str]) -> list[_Row]:
    lines = [(number, cells) for number, cells in _cells(path) if cells]
    if not lines:
        raise LutgenError(f"{path}: is empty. A design has a line {','.join(NEEDED)} and a row an image and session.")
    (number, head), *rest = lines
    _check_head(path, number, head)
    if not rest:
        raise LutgenError(f"{path}: has no row below its head. Give a row an image and session.")
    rows = []
    for line, cells in rest:
        if len(cells) != len(head):
            message = f"{path}, line {line}: has {len(cells)} cells where the head has {len(head)}."
            raise LutgenError(message)
        rows.append(_row(path, line, dict(zip(head, cells, strict=True)), images))
    return rows


def _cells(path: Path) -> list[tuple[int, list[str]]]:
    try:
        text = read_at_most(path, MAX_BYTES, what="the design", none="design").decode("utf-8-sig")
        lines = enumerate(text.splitlines(), 1)
        rows = [(line, next(csv.reader([row], strict=True))) for line, row in lines if row.strip() and row[0] != "#"]
    except (UnicodeDecodeError, csv.Error) as error:
        raise LutgenError(f"{path}: is no table of comma-separated UTF-8 text ({error}).") from None
    return [(line, [cell.strip() for cell in cells]) for line, cells in rows]


def _check_head(path: Path, line: int, head: Sequence[str]) -> None:
    where = f"{path}, line {line}"
    for name in head:
        if name not in (*NEEDED, *OPTIONAL):
            raise LutgenError(f"{where}: {pick_one('column', name, (*NEEDED, *OPTIONAL))}")
        if head.count(name) > 1:
            raise LutgenError(f"{where}: column {name} stands there twice. Leave one out.")
    missing = [name for name in NEEDED if name not in head]
    if missing:
        raise LutgenError(f"{where}: column {missing[0]} is missing. A design needs {', '.join(NEEDED)}.")


def _row(path: Path, line: int, cells: Mapping[str, str], images: Sequence[str]) -> _Row:
    where = f"{path}, line {line}"
    if cells["image"] not in images:
        message = f"{where}: no image called {cells['image']!r} was given. Given were: {_some(images)}."
        raise LutgenError(message)
    try:
        condition = condition_of(cells["condition"])
    except LutgenError as error:
        raise LutgenError(f"{where}: {error}") from None
    return _Row(
        line,
        _number(where, "session", cells["session"], MOST),
        cells["image"],
        condition,
        _number(where, "reader", cells["reader"], MOST) if "reader" in cells else None,
        _number(where, "position", cells["position"], len(images)) if "position" in cells else None,
    )


def _number(where: str, column: str, text: str, most: int) -> int:
    if _WHOLE.fullmatch(text) and 1 <= int(text) <= most:
        return int(text)
    raise LutgenError(f"{where}: {column} {text!r} is no whole number from 1 to {most}.")


def _some(names: Sequence[str], most: int = 10) -> str:
    said = ", ".join(names[:most])
    return said if len(names) <= most else f"{said} and {len(names) - most} more"
