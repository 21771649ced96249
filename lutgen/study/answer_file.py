"""A reader's file: an append-only SQLite file. Each row holds a hash of its content and of the previous row's hash.

The chain of hashes detects and names a row that was changed, moved, inserted or removed by hand. Rows removed at the
end are detected by SQLite's count of all rows ever written (AUTOINCREMENT), and by the row that ends a session, which
states the session's number of answers. Since there is no secret key, two changes are not detected: somebody computes
every hash again and resets this count, or replaces the file by an older copy.
"""

import hashlib
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lutgen.documents import canonical_json
from lutgen.errors import LutgenError, reason_of

SCHEMA = 1

#: Kind of the first row, which names the file's reader.
OPENED = "opened"

_TABLE = """
CREATE TABLE log (row INTEGER PRIMARY KEY AUTOINCREMENT, at TEXT NOT NULL, session INTEGER NOT NULL, kind TEXT NOT NULL,
                  content TEXT NOT NULL, hash TEXT NOT NULL);
CREATE TRIGGER never_changed BEFORE UPDATE ON log BEGIN SELECT RAISE(ABORT, 'rows are never changed'); END;
CREATE TRIGGER never_removed BEFORE DELETE ON log BEGIN SELECT RAISE(ABORT, 'rows are never removed'); END;
"""

#: Seconds to wait for a file to which another process is writing.
_PATIENCE = 5.0


class NotSavedError(LutgenError):
    """A row could not be written to disk. No part of the row was written."""


@dataclass(frozen=True)
class AnswerRow:
    """A row of a reader's file."""

    #: Number of the row, from 1 without gaps.
    row: int
    #: Time of writing: UTC by the computer's clock, ISO 8601. It is never used for the time to score.
    at: str
    #: Session of the row; 0 for the first row.
    session: int
    #: Kind of event, and its content.
    kind: str
    content: Mapping[str, Any]
    #: SHA-256 of the previous row's hash (the protocol's hash for the first row) and of the fields above.
    hash: str


class AnswerFile:
    """A reader's file that is open for appending."""

    def __init__(self, path: Path, anchor: str, *, first: tuple[str, Mapping[str, Any]]) -> None:
        """Open the file, or create it with a ``first`` row. Raises LutgenError: unreadable, damaged, altered."""
        self.path = path
        self._anchor = anchor
        self.entries: list[AnswerRow] = []
        with _explained(path):
            # Created here, since SQLite would create a file that the group may read.
            os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
            self._connection = sqlite3.connect(path, timeout=_PATIENCE, isolation_level=None, check_same_thread=False)
        try:
            with _explained(path):
                # EXTRA: an answer and the removal of the journal are on disk before the next image is shown.
                self._connection.execute("PRAGMA synchronous = EXTRA")
                self._connection.execute("BEGIN IMMEDIATE")
                if _is_new(self._connection, path):
                    for statement in _TABLE.split(";\n"):
                        self._connection.execute(statement)
                    at, content = first
                    self._insert(self._chained(at, 0, [(OPENED, content)]))
                self._connection.execute("COMMIT")
            self.entries = _verified(self._connection, path, anchor)
        except BaseException:
            self._connection.close()
            raise

    def append(self, at: str, session: int, events: Sequence[tuple[str, Mapping[str, Any]]]) -> None:
        """Write all rows, or none, to the disk. Raises NotSavedError: the disk is full or not writable."""
        new = self._chained(at, session, events)
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            self._insert(new)
            self._connection.execute("COMMIT")
        except sqlite3.Error as error:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            message = f"{self.path}: cannot be written ({error}): nothing was saved. Free disk space, then try again."
            raise NotSavedError(message) from None
        self.entries = [*self.entries, *new]

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _chained(self, at: str, session: int, events: Sequence[tuple[str, Mapping[str, Any]]]) -> list[AnswerRow]:
        chain = list(self.entries)
        for row, (kind, content) in enumerate(events, start=len(chain) + 1):
            before = chain[-1].hash if chain else self._anchor
            claim = _hash(before, row, at, session, kind, canonical_json(content))
            chain.append(AnswerRow(row, at, session, kind, content, claim))
        return chain[len(self.entries) :]

    def _insert(self, new: Sequence[AnswerRow]) -> None:
        rows = [(each.row, each.at, each.session, each.kind, canonical_json(each.content), each.hash) for each in new]
        self._connection.executemany("INSERT INTO log VALUES (?, ?, ?, ?, ?, ?)", rows)


def read_entries(path: Path, anchor: str) -> list[AnswerRow]:
    """Return the verified rows of a reader's file; may be empty. Raises LutgenError: unreadable, damaged, altered."""
    with _explained(path):
        # Not mode=ro: the journal of a killed process must be rolled back before rows are read.
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True, timeout=_PATIENCE)
    with closing(connection):
        with _explained(path):
            new = _is_new(connection, path)
        return [] if new else _verified(connection, path, anchor)


@contextmanager
def locked_place(path: Path) -> Iterator[None]:
    """Lock a reader's place in the ``with`` block. Raises LutgenError: another process holds the lock."""
    lock = path.with_name(f".{path.stem}.lock")
    with _explained(lock):
        connection = sqlite3.connect(lock, timeout=0, isolation_level=None, check_same_thread=False)
    with closing(connection):
        try:
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError:
            raise LutgenError(
                "this reader's session is running already, in another lutgen study run. Go on there, or end that one "
                "with Ctrl-C."
            ) from None
        yield


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = reason_of(error)
        raise LutgenError(f"{path}: cannot be opened: {reason}. Check the study's folder and its rights.") from None
    except sqlite3.Error as error:
        message = f"{path}: cannot be used as a file of answers ({error}). Make room, or restore it from a copy."
        raise LutgenError(message) from None


def _is_new(connection: sqlite3.Connection, path: Path) -> bool:
    """Return whether the file is empty: table and first row are written together."""
    connection.execute("SELECT 1 FROM sqlite_master").fetchone()  # rolls back a killed process's changes
    return path.stat().st_size == 0


def _verified(connection: sqlite3.Connection, path: Path, anchor: str) -> list[AnswerRow]:
    with _explained(path):
        (sound,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        if sound != "ok":
            raise sqlite3.DatabaseError(sound)
        rows = connection.execute("SELECT row, at, session, kind, content, hash FROM log ORDER BY row").fetchall()
        (written,) = connection.execute("SELECT max(seq) FROM sqlite_sequence WHERE name = 'log'").fetchone()
    if not rows:
        raise LutgenError(f"{path}: was altered: all its rows are missing. Restore the file from a copy.")
    entries: list[AnswerRow] = []
    before = anchor
    for number, (row, at, session, kind, content, claimed) in enumerate(rows, start=1):
        name = f"row {row} ({kind}, session {session})"
        if row != number:
            message = f"{path}: was altered: row {number} is missing before {name}. Restore the file from a copy."
            raise LutgenError(message)
        if claimed != _hash(before, row, at, session, kind, content):
            why = "does not belong to this study's protocol, or was altered" if row == 1 else "was altered by hand"
            raise LutgenError(f"{path}: {name} {why} (its hash does not fit). Restore the file from a copy.")
        entries.append(AnswerRow(row, at, session, kind, json.loads(content), claimed))
        before = claimed
    if written != len(entries):
        message = f"{path}: was altered: row {len(entries) + 1} is missing, after {name}. Restore the file from a copy."
        raise LutgenError(message)
    return entries


def _hash(before: str, *row: object) -> str:
    # repr: a value that lutgen never writes, such as bytes, gives a hash that differs.
    text = json.dumps([before, *row], ensure_ascii=True, separators=(",", ":"), default=repr)
    return hashlib.sha256(text.encode()).hexdigest()
