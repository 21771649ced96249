"""How far the readers of a study are, as the rows of their files tell, without anything that was answered."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

from lutgen.study.answer_file import read_entries
from lutgen.study.answers import ANSWERED, ENDED, PRACTISED, answer_files, answered, whose
from lutgen.study.protocol import Protocol, read_protocol

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from lutgen.study.answer_file import AnswerRow

#: Kinds of rows on the course of a session.
STARTED, RESUMED, OVERRIDDEN = "started", "resumed", "overridden"


@dataclass(frozen=True)
class SessionProgress:
    """A session of a reader.

    Attributes
    ----------
    session
        Its number, from 1.
    images, read, practised
        How many images it has, how many of them were read, how many were practised on before.
    started, ended
        When, by the computer's clock; None: not yet.
    resumed
        How often it went on after the program had ended.
    overrides
        Reasons given for beginning against the protocol or the clock.

    """

    session: int
    images: int
    read: int
    practised: int
    started: datetime | None
    ended: datetime | None
    resumed: int
    overrides: tuple[str, ...]

    @property
    def state(self) -> str:
        """``not begun``, ``begun`` or ``complete``."""
        return "complete" if self.ended else "begun" if self.started else "not begun"


def session_progress(entries: Sequence[AnswerRow], session: int, images: int) -> SessionProgress:
    """Return how far a session is."""
    here = [entry for entry in entries if entry.session == session]
    times = {entry.kind: datetime.fromisoformat(entry.at) for entry in here if entry.kind in (STARTED, ENDED)}
    return SessionProgress(
        session=session,
        images=images,
        read=len(answered(entries, session, ANSWERED)),
        practised=len(answered(entries, session, PRACTISED)),
        started=times.get(STARTED),
        ended=times.get(ENDED),
        resumed=sum(entry.kind == RESUMED for entry in here),
        overrides=tuple(str(entry.content["reason"]) for entry in here if entry.kind == OVERRIDDEN),
    )


def latest(entries: Sequence[AnswerRow]) -> datetime:
    """Return the latest time in a reader's file: a clock that was set back does not shorten a wait."""
    return max(datetime.fromisoformat(entry.at) for entry in entries)


def may_begin(entries: Sequence[AnswerRow], session: int, washout_days: float) -> datetime | None:
    """Return when a session may begin, after the washout; None where it need not wait."""
    if session == 1:
        return None
    before = [entry for entry in entries if entry.session == session - 1]
    return latest(before) + timedelta(days=washout_days)


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
        begin = tuple(_earliest(entries, sessions, each, protocol.washout_days) for each in sessions)
        readers.append(ReaderStatus(place, whose(entries, paths[place]) if entries else None, sessions, begin))
    return StudyStatus(protocol, tuple(readers))


def _earliest(
    entries: Sequence[AnswerRow], sessions: Sequence[SessionProgress], here: SessionProgress, washout_days: float
) -> datetime | None:
    if here.started or here.session == 1 or not sessions[here.session - 2].ended:
        return None
    return may_begin(entries, here.session, washout_days)


def _session_json(session: SessionProgress, begin: datetime | None) -> dict[str, Any]:
    times = {"started": session.started, "ended": session.ended, "may_begin": begin}
    written = {name: time and time.isoformat(timespec="seconds") for name, time in times.items()}
    return {**asdict(session), **written, "state": session.state, "overrides": list(session.overrides)}
