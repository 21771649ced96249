"""A design of one's own, as a CSV table: ``session,image,condition``, and if wanted ``reader`` and ``position``."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from lutgen.errors import LutgenError
from lutgen.study.csv_rows import Row, read_rows
from lutgen.study.design import MOST, Design, check_readings, condition_of, ordered
from lutgen.study.protocol import Condition, Trial

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

NEEDED, OPTIONAL = ("session", "image", "condition"), ("reader", "position")


class _Shown(NamedTuple):
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
    rows = [_shown(row, images) for row in read_rows(path, NEEDED, optional=OPTIONAL)[1]]
    named = {row.reader for row in rows if row.reader is not None}
    if named and readers is not None and readers != max(named):
        message = f"{path}: has readers up to {max(named)}, and --readers says {readers}. Leave --readers out."
        raise LutgenError(message)
    count = max(named, default=readers or 1)
    sessions = max(row.session for row in rows)
    if not named:
        check_readings(len(rows) * count, f"{path}: {len(rows)} rows × {count} readers")
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


def _session(path: Path, rows: Sequence[_Shown], reader: int, session: int, seed: int) -> list[Trial]:
    shown: dict[str, _Shown] = {}
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


def _shown(row: Row, images: Sequence[str]) -> _Shown:
    if row.cells["image"] not in images:
        raise row.error("image", f"is no image that was given. Given were: {_some(images)}.")
    try:
        condition = condition_of(row.cells["condition"])
    except LutgenError as error:
        raise row.refused("condition", error) from None
    return _Shown(
        row.line,
        row.whole("session", low=1, high=MOST),
        row.cells["image"],
        condition,
        row.whole("reader", low=1, high=MOST) if "reader" in row.cells else None,
        row.whole("position", low=1, high=len(images)) if "position" in row.cells else None,
    )


def _some(names: Sequence[str], most: int = 10) -> str:
    said = ", ".join(names[:most])
    return said if len(names) <= most else f"{said} and {len(names) - most} more"
