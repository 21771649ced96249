"""Who has read what, without anything that was answered."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from lutgen.study.answer_file import read_entries
from lutgen.study.answers import answer_files, whose
from lutgen.study.progress import SessionProgress, may_begin, session_progress
from lutgen.study.protocol import Protocol, read_protocol

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime
    from pathlib import Path

    from lutgen.study.answer_file import Entry


@dataclass(frozen=True)
class ReaderStatus:
    """A place.

    Attributes
    ----------
    place
        Its number, from 1.
    reader
        Who took it; None: nobody yet.
    sessions
        How far each is.
    may_begin
        When each may begin, after the washout; None: it need not wait, has begun, or the one before is not complete.

    """

    place: int
    reader: str | None
    sessions: tuple[SessionProgress, ...]
    may_begin: tuple[datetime | None, ...]


@dataclass(frozen=True)
class StudyStatus:
    """A study's protocol, and how far its readers are."""

    protocol: Protocol
    readers: tuple[ReaderStatus, ...]

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: ``lutgen/study/schema/status.json``."""
        readers = [
            {
                "place": each.place,
                "reader": each.reader,
                "sessions": [
                    _session_json(session, begin) for session, begin in zip(each.sessions, each.may_begin, strict=True)
                ],
            }
            for each in self.readers
        ]
        return {"schema": 1, "title": self.protocol.title, "protocol": self.protocol.sha256, "readers": readers}


def study_status(study: Path) -> StudyStatus:
    """Return how far the readers of a study are.

    Raises
    ------
    LutgenError
        The protocol or a file of answers cannot be read, or was altered.

    """
    protocol = read_protocol(study)
    paths = dict(answer_files(study))
    readers = []
    for place in range(1, protocol.readers + 1):
        entries = read_entries(paths[place], protocol.sha256) if place in paths else []
        sessions = tuple(
            session_progress(entries, session, len(protocol.session(place, session)))
            for session in range(1, protocol.sessions + 1)
        )
        begin = tuple(_may_begin(entries, sessions, each, protocol.washout_days) for each in sessions)
        readers.append(ReaderStatus(place, whose(entries, paths[place]) if entries else None, sessions, begin))
    return StudyStatus(protocol, tuple(readers))


def _may_begin(
    entries: Sequence[Entry], sessions: Sequence[SessionProgress], here: SessionProgress, washout_days: float
) -> datetime | None:
    if here.started or here.session == 1 or not sessions[here.session - 2].ended:
        return None
    return may_begin(entries, here.session, washout_days)


def _session_json(session: SessionProgress, begin: datetime | None) -> dict[str, Any]:
    times = {"started": session.started, "ended": session.ended, "may_begin": begin}
    written = {name: time and time.isoformat(timespec="seconds") for name, time in times.items()}
    return {**asdict(session), **written, "state": session.state, "overrides": list(session.overrides)}
