"""Whether a reader's session may be read now: place, order, washout, clock, and the images as they were planned."""

from __future__ import annotations

from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from lutgen import __version__
from lutgen.errors import LutgenError
from lutgen.study.answer_file import AnswerFile, held
from lutgen.study.answers import reader_name, take_place
from lutgen.study.progress import OVERRIDDEN, RESUMED, STARTED, latest, may_begin, session_progress
from lutgen.study.protocol import Protocol, read_protocol
from lutgen.study.reading import Reading, Task, picture_of, text_of, when

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

#: What a clock may be back without having been set: a network's time corrects it by less.
CLOCK_SLACK = timedelta(seconds=2)

#: Letters of a reason, at most.
LONGEST_REASON = 500


@contextmanager
def begin_reading(
    study: Path,
    *,
    reader: str,
    session: int,
    override: str | None = None,
    clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Reading]:
    """Begin a reader's session, or go on with it, and hold it until the end of the block.

    Parameters
    ----------
    study
        Folder of the study.
    reader
        Name; a new one takes the next free place.
    session
        From 1; each after the one before, and after the washout.
    override
        A reason to begin before the washout is over, or with a clock that was set back. Recorded when it was needed.
    clock
        Gives the time now, UTC.
    progress
        Told how many of the images were compared with the protocol.

    Raises
    ------
    LutgenError
        The session may not be read now, or not by this reader; the study's files are not as they were planned.

    """
    protocol = read_protocol(study)
    name, why = reader_name(reader), _reason(override)
    if not 1 <= session <= protocol.sessions:
        raise LutgenError(f"--session {session}: the study has sessions 1 to {protocol.sessions}. Pick one of these.")
    file = take_place(study, protocol, name, session=session, at=text_of(clock()))
    try:
        with held(file.path):
            began = Reading(study, protocol, file, session, clock)
            _check_pictures(study, [*began.practice, *began.images], progress)
            _begin(began, file, clock(), why)
            yield began
    finally:
        file.close()


def _begin(began: Reading, file: AnswerFile, now: datetime, why: str | None) -> None:
    protocol, session = began.protocol, began.session
    here = session_progress(file.entries, session, len(began.images))
    if here.ended:
        following = f" Next is --session {session + 1}." if session < protocol.sessions else ""
        message = f"--session {session}: is complete, {here.read} of {here.images} images are read.{following}"
        raise LutgenError(message)
    if here.started:
        file.append(text_of(now), session, [(RESUMED, {"read": here.read})])
        return
    if session > 1 and not session_progress(file.entries, session - 1, 0).ended:
        message = f"--session {session}: session {session - 1} is not complete. Read --session {session - 1} first."
        raise LutgenError(message)
    overridden = [(OVERRIDDEN, {"what": what, "reason": why}) for what in _forbidden(protocol, file, session, now, why)]
    file.append(text_of(now), session, [*overridden, (STARTED, {"images": here.images, "version": __version__})])


def _forbidden(protocol: Protocol, file: AnswerFile, session: int, now: datetime, why: str | None) -> list[str]:
    """Return what speaks against beginning now. Raises LutgenError where there is something and no reason is given."""
    found = {}
    last = latest(file.entries)
    if now < last - CLOCK_SLACK:
        found["clock"] = f"the clock says {when(now)}, but {when(last)} was recorded before: it was set back. Set it"
    begin = may_begin(file.entries, session, protocol.washout_days)
    if begin and now < begin:
        found["washout"] = (
            f"it may begin on {when(begin)}, {protocol.washout_days:g} days after session {session - 1} ended. Wait"
        )
    if found and not why:
        message = f"--session {session}: {next(iter(found.values()))}, or give --override REASON, which is recorded."
        raise LutgenError(message)
    return list(found)


def _check_pictures(study: Path, tasks: list[Task], progress: Callable[[int, int], None] | None) -> None:
    for done, task in enumerate(tasks, start=1):
        picture_of(study, task)
        if progress:
            progress(done, len(tasks))


def _reason(text: str | None) -> str | None:
    if text is None:
        return None
    reason = text.strip()
    if reason.isprintable() and 1 <= len(reason) <= LONGEST_REASON:
        return reason
    raise LutgenError(f"--override {text[:80]!a}: give a reason of 1 to {LONGEST_REASON} visible letters.")
