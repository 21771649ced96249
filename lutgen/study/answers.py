"""Answers of a study: one file for each place, ``STUDY/answers/reader-1.sqlite``.

A place is a reader's number in the protocol. A reader takes the next free place at the first session, and keeps it. The
reader's name is stored in the file, and never becomes part of a path.

The same rows give the progress of the readers, without their answers.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError, reason_of
from lutgen.study.answer_file import SCHEMA, AnswerFile, AnswerRow, read_entries
from lutgen.study.protocol import ANSWERS, Protocol, read_protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


#: Kinds of rows: an image of the session was read, a practice image was read, the session is complete.
ANSWERED, PRACTISED, ENDED = "answered", "practised", "ended"

#: Most letters of a reader's name.
LONGEST_NAME = 64

_PLACE = re.compile(r"reader-([1-9][0-9]*)\.sqlite")


def reader_name(text: str) -> str:
    """Return a name in NFC, without extra blanks. Raises LutgenError: empty, too long, or invisible characters."""
    name = re.sub(" +", " ", unicodedata.normalize("NFC", text)).strip(" ")
    if name.isprintable() and 1 <= len(name) <= LONGEST_NAME:
        return name
    raise LutgenError(f"--reader {text[:80]!a}: give a name of 1 to {LONGEST_NAME} letters that can all be seen.")


def take_place(study: Path, protocol: Protocol, name: str, *, session: int, at: str) -> AnswerFile:
    """Open the file of a reader; a new name takes the next free place. Raises LutgenError: none is free."""
    for place in range(1, protocol.readers + 1):
        path = study / ANSWERS / f"reader-{place}.sqlite"
        entries = read_entries(path, protocol.sha256) if path.exists() else []
        if entries and not _same(whose(entries, path), name):
            continue
        if not entries and session != 1:
            message = f"--session {session}: no reader {name!r} has read session 1. Check the name, or begin with it."
            raise LutgenError(message)
        try:
            path.parent.mkdir(mode=0o700, exist_ok=True)
        except OSError as error:
            message = f"{path.parent}: cannot be made: {reason_of(error)}. Check the study's folder and its rights."
            raise LutgenError(message) from None
        first = {"schema": SCHEMA, "reader": name, "place": place, "protocol": protocol.sha256}
        file = AnswerFile(path, protocol.sha256, first=(at, first))
        if _same(whose(file.entries, path), name):
            return file
        file.close()  # another process has just taken this place for another reader
    raise LutgenError(
        f"--reader {name!r}: the study is planned for {protocol.readers} reader(s), and all places are taken by other "
        "names. Check the name."
    )


def read_answers(study: Path) -> tuple[Answer, ...]:
    """Return all answers of a study except practice, by place, session and position.

    The answers of incomplete sessions are included. Every file is verified.

    Raises
    ------
    LutgenError
        The protocol or a file of answers cannot be read, or was altered. The message names the file and the row.

    """
    protocol = read_protocol(study)
    answers: list[Answer] = []
    for place, path in answer_files(study):
        entries = read_entries(path, protocol.sha256)
        if entries:
            answers += _answers(entries, place, path, protocol)
    return tuple(answers)


def answer_files(study: Path) -> list[tuple[int, Path]]:
    """Return the places that have a file, with their files."""
    folder = study / ANSWERS
    names = [(_PLACE.fullmatch(path.name), path) for path in folder.iterdir()] if folder.is_dir() else []
    return sorted((int(name[1]), path) for name, path in names if name)


def whose(entries: Sequence[AnswerRow], path: Path) -> str:
    """Return the reader's name in a file. Raises LutgenError if the file has the name of another place."""
    first = entries[0].content
    if path.name != f"reader-{first['place']}.sqlite":
        raise LutgenError(f"{path}: is a copy of reader-{first['place']}.sqlite, under another name. Remove it.")
    return str(first["reader"])


def answered(entries: Sequence[AnswerRow], session: int, kind: str = ANSWERED) -> list[Mapping[str, Any]]:
    """Return the content of the rows of one kind in a session, in the order of the rows."""
    return [entry.content for entry in entries if (entry.session, entry.kind) == (session, kind)]


def _same(name: str, other: str) -> bool:
    return name.casefold() == other.casefold()


def _answers(entries: Sequence[AnswerRow], place: int, path: Path, protocol: Protocol) -> list[Answer]:
    reader = whose(entries, path)
    categories = {category.name: category.positive for category in protocol.categories}
    trials = {(trial.session, trial.position): trial for trial in protocol.trials if trial.reader == place}
    answers: list[Answer] = []
    for entry in entries:
        content = entry.content
        if entry.kind == ENDED and content["answers"] != len(answered(entries, entry.session)):
            message = f"{path}: row {entry.row} ends session {entry.session} with another number of answers than there"
            raise LutgenError(f"{message} are. Restore the file from a copy.")
        if entry.kind != ANSWERED:
            continue
        trial = trials.get((entry.session, content["position"]))
        if trial is None or content["category"] not in categories:
            message = f"{path}: row {entry.row} answers what the protocol does not ask. Restore the file from a copy."
            raise LutgenError(message)
        given = (content["seconds"], content["ease"], content["category"], categories[content["category"]])
        answers.append(Answer(reader, entry.session, trial.position, trial.image, trial.condition, *given))
    return sorted(answers, key=lambda answer: (answer.session, answer.position))


#: Longest possible time to read an image, in seconds: a day.
MAX_SECONDS = 86_400.0


@dataclass(frozen=True)
class Answer:
    """A reader's answer to one image."""

    #: The reader's name, as given when the session was run.
    reader: str
    #: Number of the session, and of the image in the session, both from 1.
    session: int
    position: int
    #: Names of the protocol's image and condition.
    image: str
    condition: str
    #: Time to score: from the first paint of the image to the decision, without pauses.
    seconds: float
    #: Ease of reading, on the protocol's scale; larger is easier.
    ease: int
    #: Name of the protocol's category: the diagnosis.
    category: str
    #: Whether this category is positive.
    positive: bool


def sensible(answers: Sequence[Answer]) -> tuple[tuple[Answer, ...], list[str]]:
    """Return answers with a possible time, and a sentence on each other answer. Raises LutgenError: none is left."""
    possible = tuple(answer for answer in answers if 0 <= answer.seconds <= MAX_SECONDS)
    left_out = [
        f"Left out: {answer.reader}, session {answer.session}, image {answer.position} ({answer.image}): "
        f"{str(answer.seconds)[:12]} seconds is no possible time to score."
        for answer in answers
        if not 0 <= answer.seconds <= MAX_SECONDS
    ]
    if left_out and not possible:
        raise LutgenError(f"no answer has a possible time to score. {left_out[0]}")
    return possible, left_out


#: Kinds of rows on the progress of a session.
STARTED, RESUMED, OVERRIDDEN = "started", "resumed", "overridden"


@dataclass(frozen=True)
class SessionProgress:
    """The progress of one session of a reader."""

    #: Its number, from 1.
    session: int
    #: Number of images, of images read, and of practice images read.
    images: int
    read: int
    practised: int
    #: Start and end by the computer's clock; None: not yet.
    started: datetime | None
    ended: datetime | None
    #: How often the session was resumed after the program had ended.
    resumed: int
    #: Reasons for a start against the protocol or the clock.
    overrides: tuple[str, ...]
    #: When it may begin, after the washout; None: at once, begun, or the previous session is not complete.
    may_begin: datetime | None = None

    @property
    def state(self) -> str:
        """``not begun``, ``begun`` or ``complete``."""
        return "complete" if self.ended else "begun" if self.started else "not begun"


def session_progress(entries: Sequence[AnswerRow], session: int, images: int) -> SessionProgress:
    """Return the progress of a session."""
    rows = [entry for entry in entries if entry.session == session]
    times = {entry.kind: datetime.fromisoformat(entry.at) for entry in rows if entry.kind in (STARTED, ENDED)}
    return SessionProgress(
        session=session,
        images=images,
        read=len(answered(entries, session, ANSWERED)),
        practised=len(answered(entries, session, PRACTISED)),
        started=times.get(STARTED),
        ended=times.get(ENDED),
        resumed=sum(entry.kind == RESUMED for entry in rows),
        overrides=tuple(str(entry.content["reason"]) for entry in rows if entry.kind == OVERRIDDEN),
    )


def latest(entries: Sequence[AnswerRow]) -> datetime:
    """Return the latest time in a reader's file, so that a clock that was set back does not shorten a wait."""
    return max(datetime.fromisoformat(entry.at) for entry in entries)


def may_begin(entries: Sequence[AnswerRow], session: int, washout_days: float) -> datetime:
    """Return the time when a session after the first may begin, after the washout."""
    before = [entry for entry in entries if entry.session == session - 1]
    return latest(before) + timedelta(days=washout_days)


@dataclass(frozen=True)
class ReaderStatus:
    """A reader's place in the study, and the progress of its sessions."""

    #: Its number, from 1.
    place: int
    #: The reader's name; None: the place is free.
    reader: str | None
    sessions: tuple[SessionProgress, ...]


@dataclass(frozen=True)
class StudyStatus:
    """A study's protocol, and the progress of its readers."""

    protocol: Protocol
    readers: tuple[ReaderStatus, ...]

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: ``lutgen/study/schema/status.json``."""
        readers = [
            {"place": each.place, "reader": each.reader, "sessions": [*map(_session_json, each.sessions)]}
            for each in self.readers
        ]
        return {"schema": 1, "title": self.protocol.title, "protocol": self.protocol.sha256, "readers": readers}


def study_status(study: Path) -> StudyStatus:
    """Return the progress of a study's readers. Raises LutgenError: a file cannot be read, or was altered."""
    protocol = read_protocol(study)
    paths = dict(answer_files(study))
    readers = []
    for place in range(1, protocol.readers + 1):
        entries = read_entries(paths[place], protocol.sha256) if place in paths else []
        sessions: list[SessionProgress] = []
        for number in range(1, protocol.sessions + 1):
            session = session_progress(entries, number, len(protocol.session(place, number)))
            if sessions and sessions[-1].ended and not session.started:
                session = replace(session, may_begin=may_begin(entries, number, protocol.washout_days))
            sessions.append(session)
        readers.append(ReaderStatus(place, whose(entries, paths[place]) if entries else None, tuple(sessions)))
    return StudyStatus(protocol, tuple(readers))


def _session_json(session: SessionProgress) -> dict[str, Any]:
    times = {"started": session.started, "ended": session.ended, "may_begin": session.may_begin}
    written = {name: time and time.isoformat(timespec="seconds") for name, time in times.items()}
    return {**asdict(session), **written, "state": session.state, "overrides": list(session.overrides)}
