"""A reading session as a state machine, independent of the browser: the next image, and the answer to each image.

First come the practice images, then the images of the session. Each image is answered exactly once. An answer is on
disk before the next image is shown. Each event is a row in the reader's file: started, resumed, shown, paused,
continued, warned, accepted, overridden, practised, answered, ended.

There are two clocks. The computer's clock dates the rows and measures the washout. It may be wrong: a clock that was
set back is detected, a clock that was set forward is not. The page's own clock, which nobody can set, measures the time
to score.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from lutgen.errors import LutgenError, reason_of
from lutgen.progress import Progress, unseen
from lutgen.study import answers
from lutgen.study.answer_file import AnswerFile, locked_place
from lutgen.study.protocol import Protocol, Render, read_protocol
from lutgen.study.statistics import UNAGED
from lutgen.version import __version__

#: Most pauses of an image, and most seconds of its pauses: a month.
MAX_PAUSES, MAX_PAUSED = 100_000, 30 * 86_400.0

#: Kind of row: an image was sent to the page.
SHOWN = "shown"


@dataclass(frozen=True)
class Task:
    """An image to read."""

    #: Number of the image, from 1, and the number of all images: of practice, or of the session.
    number: int
    of: int
    #: Whether it is a practice image.
    practice: bool
    #: Path in the study's folder, and hash of the file when the study was planned.
    file: str
    sha256: str


@dataclass(frozen=True)
class Decision:
    """A reader's answer to an image, and the times that the page measured."""

    #: Name of the protocol's category.
    category: str
    #: Ease of reading.
    ease: int
    #: Seconds from the first paint of the last showing to the choice of the confirmed category, without pauses.
    seconds: float
    #: Seconds to the first choice, which is earlier if the reader changed the category.
    first_choice_seconds: float
    #: Number and total length of pauses, in which the image was hidden, up to the confirmation.
    pauses: int
    paused_seconds: float
    #: Source of the time of the first paint: element-timing (the browser's own record) or animation-frame.
    paint: str


class PastError(LutgenError):
    """An answer to an image that is not the current image."""


class ReadingSession:
    """A running session of a reader."""

    def __init__(
        self, study: Path, protocol: Protocol, file: AnswerFile, session: int, clock: Callable[[], datetime]
    ) -> None:
        """Take the reader and the session that :func:`begin_reading` has checked."""
        self.study, self.protocol, self.session = study, protocol, session
        self.reader, self.place = str(file.entries[0].content["reader"]), int(file.entries[0].content["place"])
        self._file, self._clock = file, clock
        self.practice, self.images = tasks_of(protocol, self.place, session)
        #: Number of practice images, and of images of the session, that were read.
        self.practised = len(answers.answered(file.entries, session, answers.PRACTISED))
        self.read = len(answers.answered(file.entries, session))

    @property
    def left(self) -> int:
        """Number of images of the session that are not read yet."""
        return len(self.images) - self.read

    def task(self) -> Task | None:
        """Return the current image; None when all images are read."""
        return next(iter([*self.practice[self.practised :], *self.images[self.read :]]), None)

    def picture(self, task: Task) -> bytes:
        """Return an image's file. Raises LutgenError when the file has changed since the study was planned."""
        path = self.study / task.file
        try:
            data = path.read_bytes()
        except OSError as error:
            raise LutgenError(f"{path}: {reason_of(error)}. Restore the study's images from a copy.") from None
        if hashlib.sha256(data).hexdigest() != task.sha256:
            why = "has changed since the study was planned (its hash does not fit). Restore it from a copy."
            raise LutgenError(f"{path}: {why}")
        return data

    def showings(self, task: Task) -> int:
        """Return how often an image was shown, now included; more than 1 after a reload or a crash."""
        key = (SHOWN, task.practice, task.number)
        rows = [entry for entry in self._file.entries if entry.session == self.session]
        return sum((each.kind, each.content.get("practice"), each.content.get("position")) == key for each in rows)

    def show(self, task: Task) -> None:
        """Record, before an image is shown, that it is shown. Raises NotSavedError when the disk cannot be written."""
        self.note(SHOWN, {"practice": task.practice, "position": task.number, "sha256": task.sha256})

    def following(self) -> str:
        """Return a sentence on when the next session may begin; empty after the last session."""
        begin = answers.may_begin(self._file.entries, self.session + 1, self.protocol.washout_days)
        last = self.session == self.protocol.sessions
        return "" if last else f"Reading session {self.session + 1} may begin on {when(begin)}."

    def note(self, kind: str, content: Mapping[str, Any]) -> None:
        """Record an event. Raises NotSavedError when the disk cannot be written."""
        self._file.append(text_of(self._clock()), self.session, [(kind, content)])

    def answer(self, number: int, decision: Decision, *, practice: bool = False) -> None:
        """Record an answer on disk. Raises PastError, NotSavedError, or LutgenError for an invalid answer."""
        kind = answers.PRACTISED if practice else answers.ANSWERED
        self._check(decision)
        if number <= (self.practised if practice else self.read):
            before = answers.answered(self._file.entries, self.session, kind)[number - 1]
            if {**before, **asdict(decision)} != before:
                raise PastError(f"image {number} already has another answer. That answer stays: it cannot be changed.")
            return
        task = self.task()
        if task is None or (task.practice, task.number) != (practice, number) or not self.showings(task):
            why = "is not the one to be read now. Reload the page to go on with the right one."
            raise PastError(f"image {number} {why}")
        content = {"position": number, "showings": self.showings(task), **asdict(decision)}
        events: list[tuple[str, Mapping[str, Any]]] = [(kind, content)]
        if not practice and number == len(self.images):
            events.append((answers.ENDED, {"answers": number}))
        self._file.append(text_of(self._clock()), self.session, events)
        if practice:
            self.practised += 1
        else:
            self.read += 1

    def _check(self, decision: Decision) -> None:
        lowest, highest = self.protocol.ease
        names = [category.name for category in self.protocol.categories]
        times = {
            "seconds": (decision.seconds, answers.MAX_SECONDS),
            "first_choice_seconds": (decision.first_choice_seconds, answers.MAX_SECONDS),
            "pauses": (decision.pauses, MAX_PAUSES),
            "paused_seconds": (decision.paused_seconds, MAX_PAUSED),
        }
        if decision.category not in names:
            raise LutgenError(f"diagnosis {decision.category!r}: pick one of {', '.join(names)}.")
        if not lowest <= decision.ease <= highest:
            raise LutgenError(f"ease of reading {decision.ease}: give {lowest} to {highest}.")
        for name, (value, most) in times.items():
            if not 0 <= value <= most:
                raise LutgenError(f"{name} {str(value)[:12]}: give 0 to {most:g}.")


def tasks_of(protocol: Protocol, place: int, session: int) -> tuple[list[Task], list[Task]]:
    """Return a session's practice images and its images to read. Raises LutgenError: no such session or image."""
    trials = protocol.session(place, session)
    if not trials:
        raise LutgenError(f"the protocol has no images for place {place} in session {session}. Plan the study again.")
    try:
        practice = [protocol.render(image.name, UNAGED) for image in protocol.practice]
        images = [protocol.render(trial.image, trial.condition) for trial in trials]
    except KeyError as error:
        raise LutgenError(f"the protocol has no picture of {error}. Plan the study again.") from None

    def numbered(renders: list[Render], *, practice: bool) -> list[Task]:
        return [
            Task(number, len(renders), practice, render.file, render.sha256)
            for number, render in enumerate(renders, start=1)
        ]

    return numbered(practice, practice=True), numbered(images, practice=False)


def when(time: datetime) -> str:
    """Return a time as text to display."""
    return f"{time:%Y-%m-%d %H:%M} UTC"


def text_of(time: datetime) -> str:
    """Return a time as text for a reader's file."""
    return time.astimezone(UTC).isoformat(timespec="milliseconds")


#: Most letters of a reason.
LONGEST_REASON = 500


@contextmanager
def begin_reading(
    study: Path,
    *,
    reader: str,
    session: int,
    override: str | None = None,
    clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    progress: Progress = unseen,
) -> Iterator[ReadingSession]:
    """Begin or resume a reader's session for the ``with`` block. Raises LutgenError: it may not begin now."""
    protocol = read_protocol(study)
    name, why = answers.reader_name(reader), None if override is None else override.strip()
    if override is not None and why is not None and not (why.isprintable() and 1 <= len(why) <= LONGEST_REASON):
        raise LutgenError(f"--override {override[:80]!a}: give a reason of 1 to {LONGEST_REASON} visible letters.")
    if not 1 <= session <= protocol.sessions:
        raise LutgenError(f"--session {session}: the study has sessions 1 to {protocol.sessions}. Pick one of these.")
    file = answers.take_place(study, protocol, name, session=session, at=text_of(clock()))
    try:
        with locked_place(file.path):
            reading = ReadingSession(study, protocol, file, session, clock)
            tasks = [*reading.practice, *reading.images]
            for done, task in enumerate(tasks, start=1):
                reading.picture(task)
                progress(done, len(tasks))
            _begin(reading, file, clock(), why)
            yield reading
    finally:
        file.close()


def _begin(reading: ReadingSession, file: AnswerFile, now: datetime, why: str | None) -> None:
    protocol, session = reading.protocol, reading.session
    state = answers.session_progress(file.entries, session, len(reading.images))
    if state.ended:
        following = f" Next is --session {session + 1}." if session < protocol.sessions else ""
        message = f"--session {session}: is complete, {state.read} of {state.images} images are read."
        raise LutgenError(f"{message}{following}")
    if state.started:
        file.append(text_of(now), session, [(answers.RESUMED, {"read": state.read})])
        return
    if session > 1 and not answers.session_progress(file.entries, session - 1, 0).ended:
        message = f"--session {session}: session {session - 1} is not complete. Read --session {session - 1} first."
        raise LutgenError(message)
    broken = _forbidden(protocol, file, session, now, why)
    events: list[tuple[str, Mapping[str, Any]]] = [
        (answers.OVERRIDDEN, {"what": rule, "reason": why}) for rule in broken
    ]
    events.append((answers.STARTED, {"images": state.images, "version": __version__}))
    file.append(text_of(now), session, events)


def _forbidden(protocol: Protocol, file: AnswerFile, session: int, now: datetime, why: str | None) -> list[str]:
    """Return the rules that a start now breaks. Raises LutgenError if it breaks a rule without a reason ``why``."""
    reasons = {}
    last = answers.latest(file.entries)
    # Network time may set the clock back by less than this.
    if now < last - timedelta(seconds=2):
        reasons["clock"] = f"the clock says {when(now)}, but {when(last)} was recorded before: it was set back. Set it"
    begin = answers.may_begin(file.entries, session, protocol.washout_days) if session > 1 else now
    if now < begin:
        days = f"{protocol.washout_days:g} days"
        reasons["washout"] = f"it may begin on {when(begin)}, {days} after session {session - 1} ended. Wait"
    if reasons and not why:
        message = f"--session {session}: {next(iter(reasons.values()))}, or give --override REASON, which is recorded."
        raise LutgenError(message)
    return list(reasons)
