"""The page of ``lutgen study status``: how far each reader is in each session."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.report.parts import Table

if TYPE_CHECKING:
    from collections.abc import Iterator
    from datetime import datetime

    from lutgen.report.parts import Part
    from lutgen.study.progress import SessionProgress, StudyStatus


def study_status_page(status: StudyStatus) -> Iterator[Part]:
    """Yield a sentence and a table of one row for each reader and session, without any answer."""
    sessions = [session for reader in status.readers for session in reader.sessions]
    complete = sum(session.state == "complete" for session in sessions)
    yield f"{status.protocol.title}: {complete} of {len(sessions)} sessions are complete."
    yield ""
    headings = ("reader", "session", "state", "images", "began", "ended", "remarks")
    rows = [
        (
            reader.reader or f"place {reader.place}, free",
            str(session.session),
            session.state,
            f"{session.read} of {session.images}",
            _when(session.started),
            _when(session.ended),
            _remarks(session, begin),
        )
        for reader in status.readers
        for session, begin in zip(reader.sessions, reader.may_begin, strict=True)
    ]
    yield Table(headings, rows, words=range(len(headings)))


def _when(time: datetime | None) -> str:
    return f"{time:%Y-%m-%d %H:%M}" if time else ""


def _remarks(session: SessionProgress, begin: datetime | None) -> str:
    remarks = [f"may begin {_when(begin)} UTC"] if begin else []
    remarks += [f"resumed {session.resumed} ×"] if session.resumed else []
    remarks += [f"overridden: {reason}" for reason in dict.fromkeys(session.overrides)]
    return "; ".join(remarks)
