"""How far a reader's sessions are, as the rows of the reader's file tell."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from lutgen.study.answers import ANSWERED, ENDED, PRACTISED, answered

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.answer_file import Entry

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


def session_progress(entries: Sequence[Entry], session: int, images: int) -> SessionProgress:
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


def latest(entries: Sequence[Entry]) -> datetime:
    """Return the latest time in a reader's file: a clock that was set back does not shorten a wait."""
    return max(datetime.fromisoformat(entry.at) for entry in entries)


def may_begin(entries: Sequence[Entry], session: int, washout_days: float) -> datetime | None:
    """Return when a session may begin, after the washout; None where it need not wait."""
    if session == 1:
        return None
    before = [entry for entry in entries if entry.session == session - 1]
    return latest(before) + timedelta(days=washout_days)
