"""A session as a state machine: order, washout, clock, resuming, and faults during the session."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import pytest

from lutgen.errors import LutgenError
from lutgen.report.parts import Table
from lutgen.report.study_plan import study_status_page
from lutgen.study.answer_file import AnswerRow, read_entries
from lutgen.study.answers import read_answers, study_status
from lutgen.study.protocol import read_protocol
from lutgen.study.reading import PastError, begin_reading
from tests.studies import Clock, decision, make_study, read_on

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.study.reading import ReadingSession

pytestmark = pytest.mark.numbers


@pytest.fixture
def study(tmp_path: Path) -> Path:
    make_study(tmp_path / "study")
    return tmp_path / "study"


def entries(study: Path) -> list[AnswerRow]:
    return read_entries(study / "answers/reader-1.sqlite", read_protocol(study).sha256)


def kinds(study: Path) -> list[str]:
    return [entry.kind for entry in entries(study)]


def begin(study: Path, session: int, clock: Clock, **more: Any) -> Any:
    return begin_reading(study, reader="Dr A", session=session, clock=clock, **more)


def read_whole(study: Path, session: int, clock: Clock, **more: Any) -> None:
    with begin(study, session, clock, **more) as reading:
        read_on(reading)


def test_practice_comes_first_then_the_images_in_the_protocols_order(study: Path) -> None:
    protocol = read_protocol(study)
    with begin(study, 1, Clock()) as reading:
        files = [task.file for task in [*reading.practice, *reading.images]]
        order = []
        while (task := reading.task()) is not None:
            order.append(task.file)
            assert task.practice == (len(order) == 1)
            read_on(reading, 1)
    assert order == files
    assert files == [protocol.render("try-1", "none").file] + [
        protocol.render(trial.image, trial.condition).file for trial in protocol.session(1, 1)
    ]
    assert kinds(study) == ["opened", "started", "shown", "practised", *["shown", "answered"] * 4, "ended"]


def test_what_is_shown_is_what_was_planned_and_pictures_of_practice_are_unaged(study: Path) -> None:
    with begin(study, 1, Clock()) as reading:
        for task in [*reading.practice, *reading.images]:
            assert reading.picture(task) == (study / task.file).read_bytes()


@pytest.mark.parametrize(
    ("wait", "allowed"),
    [
        (timedelta(days=24, minutes=1), True),
        (timedelta(days=23, hours=23), False),
        (timedelta(days=300), True),
        (timedelta(0), False),
    ],
)
def test_a_session_waits_for_the_washout(study: Path, wait: timedelta, *, allowed: bool) -> None:
    clock = Clock()
    read_whole(study, 1, clock)
    end = clock.now
    clock.now += wait
    if allowed:
        read_whole(study, 2, clock)
        assert "overridden" not in kinds(study)
        return
    day = f"{end + timedelta(days=24):%Y-%m-%d %H:%M} UTC"
    with pytest.raises(LutgenError, match=rf"may begin on {day}, 24 days after session 1 ended.*--override REASON"):
        read_whole(study, 2, clock)
    read_whole(study, 2, clock, override="the reader leaves tomorrow")
    (row,) = (entry for entry in entries(study) if entry.kind == "overridden")
    assert row.content == {"what": "washout", "reason": "the reader leaves tomorrow"}
    assert len(read_answers(study)) == 8


def test_a_clock_that_was_set_back_is_refused_and_does_not_shorten_the_washout(study: Path) -> None:
    clock = Clock()
    read_whole(study, 1, clock)
    clock.now -= timedelta(days=40)
    with pytest.raises(LutgenError, match=r"the clock says 2026-01-21 09:00 UTC, but 2026-03-02 .* it was set back"):
        read_whole(study, 2, clock)
    read_whole(study, 2, clock, override="the battery was empty")
    assert [entry.content["what"] for entry in entries(study) if entry.kind == "overridden"] == ["clock", "washout"]
    *_, table = study_status_page(study_status(study))
    assert isinstance(table, Table)
    assert [row[-1] for row in table.rows][:2] == ["", "overridden: the battery was empty"]


def test_a_clock_that_is_set_back_in_a_session_loses_nothing_and_the_washout_counts_from_the_latest_time(
    study: Path,
) -> None:
    clock = Clock()
    with begin(study, 1, clock) as reading:
        read_on(reading, 2)
        clock.now -= timedelta(days=40)
        read_on(reading)
    assert len(read_answers(study)) == 4
    clock.now = datetime(2026, 3, 25, 9, tzinfo=UTC)
    with pytest.raises(LutgenError, match="may begin on 2026-03-26 09:00 UTC"):
        read_whole(study, 2, clock)


def test_an_override_that_is_not_needed_is_not_recorded(study: Path) -> None:
    read_whole(study, 1, Clock(), override="to be sure")
    assert "overridden" not in kinds(study)


@pytest.mark.parametrize("reason", ["", "  ", "a\nb", "x" * 501, "a\u202eb"])
def test_a_reason_must_be_one(study: Path, reason: str) -> None:
    with pytest.raises(LutgenError, match=r"--override .*: give a reason"):
        read_whole(study, 1, Clock(), override=reason)


def test_sessions_come_in_their_order_and_once(study: Path) -> None:
    clock = Clock()
    for session, said_of_it in ((0, "sessions 1 to 2"), (3, "sessions 1 to 2"), (2, "no reader 'Dr A' has read")):
        with pytest.raises(LutgenError, match=said_of_it):
            read_whole(study, session, clock)
    with begin(study, 1, clock) as reading:
        read_on(reading, 2)
    clock.now += timedelta(days=30)
    with pytest.raises(LutgenError, match=r"session 1 is not complete\. Read --session 1 first"):
        read_whole(study, 2, clock, override="no")
    read_whole(study, 1, clock)
    with pytest.raises(LutgenError, match=r"--session 1: is complete, 4 of 4 images are read\. Next is --session 2"):
        read_whole(study, 1, clock)


def test_a_session_goes_on_where_it_was_and_the_image_that_was_shown_comes_again(study: Path) -> None:
    clock = Clock()
    with begin(study, 1, clock) as reading:
        read_on(reading, 3)
        task = reading.task()
        assert task is not None
        reading.show(task)
    with begin(study, 1, clock) as reading:
        assert (reading.practised, reading.read, reading.left) == (1, 2, 2)
        assert reading.task() == task
        read_on(reading)
    rows = entries(study)
    assert [row.content["showings"] for row in rows if row.kind == "answered"] == [1, 1, 2, 1]
    assert [row.content for row in rows if row.kind == "resumed"] == [{"read": 2}]
    assert len(read_answers(study)) == 4


def prepared(reading: ReadingSession) -> None:
    """Answer practice and the first image, and show the second image."""
    read_on(reading, 2)
    task = reading.task()
    assert task is not None
    reading.show(task)


def test_the_same_answer_again_changes_nothing_and_another_is_refused(study: Path) -> None:
    with begin(study, 1, Clock()) as reading:
        prepared(reading)
        before = entries(study)
        reading.answer(1, decision(1))
        reading.answer(1, decision(1), practice=True)
        assert entries(study) == before
        first = decision(1)
        for other in (replace(first, ease=9), replace(first, seconds=1.0), replace(first, category="0")):
            with pytest.raises(PastError, match="image 1 already has another answer"):
                reading.answer(1, other)
        assert entries(study) == before


@pytest.mark.parametrize("number", [3, 4, 99])
def test_no_image_is_left_out(study: Path, number: int) -> None:
    with begin(study, 1, Clock()) as reading:
        prepared(reading)
        with pytest.raises(PastError, match=f"image {number} is not the one"):
            reading.answer(number, decision(number))


def test_an_image_that_was_not_shown_has_no_answer(study: Path) -> None:
    with begin(study, 1, Clock()) as reading, pytest.raises(PastError, match="not the one to be read now"):
        reading.answer(1, decision(1), practice=True)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"category": "4+"}, r"diagnosis '4\+': pick one of 0, 1\+, 2\+, 3\+"),
        ({"ease": 0}, "ease of reading 0: give 1 to 10"),
        ({"ease": 11}, "ease of reading 11: give 1 to 10"),
        ({"seconds": -0.1}, "give 0 to 86400"),
        ({"seconds": float("nan")}, "give 0 to 86400"),
        ({"paused_seconds": float("inf")}, "give 0 to 2.592e"),
        ({"pauses": -1}, "pauses -1: give 0 to"),
    ],
)
def test_an_answer_outside_the_protocol_is_refused(study: Path, change: dict[str, Any], error: str) -> None:
    with begin(study, 1, Clock()) as reading:
        prepared(reading)
        with pytest.raises(LutgenError, match=error):
            reading.answer(2, replace(decision(2), **change))
        assert reading.read == 1


def test_an_image_that_changed_after_planning_stops_the_session_before_it_starts(study: Path) -> None:
    protocol = read_protocol(study)
    last = protocol.session(1, 1)[-1]
    path = study / protocol.render(last.image, last.condition).file
    data = path.read_bytes()
    path.write_bytes(data + b"\0")
    with pytest.raises(LutgenError, match=rf"{path.name}: has changed since the study was planned"):
        read_whole(study, 1, Clock())
    path.unlink()
    with pytest.raises(LutgenError, match=rf"{path.name}: no such file"):
        read_whole(study, 1, Clock())
    assert kinds(study) == ["opened"]
    path.write_bytes(data)
    read_whole(study, 1, Clock())


def test_an_image_that_changes_in_the_session_is_not_shown(study: Path) -> None:
    with begin(study, 1, Clock()) as reading:
        prepared(reading)
        task = reading.images[2]
        (study / task.file).write_bytes(b"another")
        with pytest.raises(LutgenError, match="has changed since the study was planned"):
            reading.picture(task)


def test_a_second_process_on_one_reader_is_refused_and_on_another_is_not(study: Path) -> None:
    with begin(study, 1, Clock()):
        with pytest.raises(LutgenError, match="running already"), begin(study, 1, Clock()):
            pass
        with begin_reading(study, reader="Dr B", session=1, clock=Clock()) as other:
            assert other.place == 2
    read_whole(study, 1, Clock())


def test_status_tells_how_far_readers_are_and_nothing_of_what_they_said(study: Path) -> None:
    clock = Clock()
    read_whole(study, 1, clock)
    status = study_status(study)
    first, second = status.readers
    assert (first.reader, second.reader) == ("Dr A", None)
    assert [session.state for session in first.sessions] == ["complete", "not begun"]
    assert [session.may_begin for session in first.sessions] == [None, clock.now + timedelta(days=24)]
    assert [session.may_begin for session in second.sessions] == [None, None]
    with begin(study, 2, clock, override="leaves early") as reading:
        read_on(reading, 3)
    with begin(study, 2, clock):
        now = study_status(study).readers[0].sessions[1]
    assert (now.state, now.read, now.practised, now.resumed, now.overrides) == ("begun", 2, 1, 1, ("leaves early",))
    text = str(study_status(study).as_json())
    assert not any(word in text for word in ("ease", "categor", "seconds", "case-", "chroma", "positive"))
