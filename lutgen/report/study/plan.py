"""The pages of ``lutgen study plan`` and ``lutgen study status``: the design, and how far each reader is."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.report.parts import Headline, Table
from lutgen.report.study.power import SEVERAL, detectable_part
from lutgen.study.design import UNAGED
from lutgen.study.protocol import PROTOCOL

if TYPE_CHECKING:
    from collections.abc import Iterator
    from datetime import datetime

    from lutgen.report.parts import Part
    from lutgen.study.plan import Planned
    from lutgen.study.progress import SessionProgress, StudyStatus

#: Names that a sentence lists; it counts the others.
LISTED = 8


def plan_page(planned: Planned) -> Iterator[Part]:
    """Yield what ``lutgen study plan`` prints."""
    protocol, power = planned.protocol, planned.power
    yield Headline(headline(planned))
    yield condition_table(planned)
    yield ""
    yield from _sessions(planned)
    if protocol.practice:
        yield f"Practice, un-aged and not analysed: {_listed([each.name for each in protocol.practice])}."
    if planned.left_out:
        yield f"Read by nobody: {_counted(len(planned.left_out), 'image')} given ({_listed(planned.left_out)})."
    if planned.rounded:
        yield f"Of 16 bits a channel, of which readers see the nearest 8: {_listed(planned.rounded)}."
    yield from planned.remarks
    if power is not None:
        yield ""
        yield from detectable_part(power, agreement=protocol.sessions > 1)
        yield "lutgen study power says what that rests on, and how sure the paper could be."
        if power.readers > 1:
            yield SEVERAL
    yield ""
    yield (
        f"{PROTOCOL} is frozen (SHA-256 {protocol.sha256[:16]}…). It alone says which picture is which: it is the "
        "coordinator's, not the readers'."
    )


def headline(planned: Planned) -> str:
    """Count images, readers, sessions and pictures of the plan."""
    protocol = planned.protocol
    counts = (
        _counted(len(protocol.images), "image"),
        _counted(protocol.readers, "reader"),
        _counted(protocol.sessions, "session"),
        f"{_counted(len(protocol.renders), 'picture')} rendered",
    )
    return f"{planned.study}: {', '.join(counts)}."


def condition_table(planned: Planned) -> Table:
    """Tabulate the conditions: images of each in session 1, and the largest error of its LUT."""
    rows = []
    for each in planned.protocol.conditions:
        lut = planned.protocol.model["luts"].get(each.name)
        count = planned.per_condition.get(each.name)
        row = (
            each.name,
            "–" if each == UNAGED else spaced(each.hours),
            "later sessions" if count is None else str(count),
            "no LUT: pixels as they are" if lut is None else _lut_error(lut),
        )
        rows.append(row)
    return Table(("condition", "hours", "images a reader", "ΔE2000 of the LUT, worst"), rows)


def _lut_error(lut: dict[str, float]) -> str:
    return f"{lut['worst_smooth_delta_e_2000']:.4f} ({lut['worst_delta_e_2000']:.2f} where the model jumps)"


def _sessions(planned: Planned) -> Iterator[str]:
    protocol = planned.protocol
    for number in range(1, protocol.sessions + 1):
        trials = [trial for trial in protocol.trials if trial.session == number]
        images = sorted(Counter(trial.reader for trial in trials).values())
        count = _counted(images[-1], "image") if images[0] == images[-1] else f"{images[0]} to {images[-1]} images"
        shown = ", ".join(dict.fromkeys(each.name for each in protocol.conditions
                                        if each.name in {trial.condition for trial in trials}))  # fmt: skip
        begins = (
            "" if number == 1 else f", from {protocol.washout_days:g} days after a reader's session {number - 1} on"
        )
        yield f"Session {number}: {count} under {shown}{begins}."


def _counted(count: int, what: str) -> str:
    return f"{spaced(count)} {what}{'' if count == 1 else 's'}"


def _listed(names: list[str] | tuple[str, ...]) -> str:
    listed = ", ".join(names[:LISTED])
    return listed if len(names) <= LISTED else f"{listed} and {len(names) - LISTED} more"


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
