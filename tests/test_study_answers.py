"""Readers' files: the place of each reader, the file after an answer, and detection of manual edits."""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
import stat
from contextlib import closing
from typing import TYPE_CHECKING

import pytest

from lutgen.errors import LutgenError
from lutgen.study.answer_file import AnswerFile, NotSavedError, read_entries
from lutgen.study.answers import read_answers, reader_name, take_place
from lutgen.study.protocol import read_protocol, write_protocol
from lutgen.study.reading import begin_reading
from tests.studies import Clock, decision, make_study, read_on

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.numbers

AT = "2026-03-02T09:00:00.000+00:00"


@pytest.fixture
def study(tmp_path: Path) -> Path:
    make_study(tmp_path / "study")
    return tmp_path / "study"


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with one completed session."""
    folder = tmp_path_factory.mktemp("read") / "study"
    make_study(folder)
    with begin_reading(folder, reader="Dr A", session=1, clock=Clock()) as reading:
        read_on(reading)
    return folder


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("Dr A", "Dr A"),
        ("  Dr   A ", "Dr A"),
        ("../../etc/passwd", "../../etc/passwd"),
        ("CON", "CON"),
        ("Mu\u0308ller", "M\u00fcller"),
        ("病理医", "病理医"),
        ("a" * 64, "a" * 64),
    ],
)
def test_a_name_is_kept_in_one_form(given: str, kept: str) -> None:
    assert reader_name(given) == kept


@pytest.mark.parametrize(
    "name", ["", "   ", "a" * 65, "a\nb", "a\0b", "a\u202eb", "a\u200bb", "\udc80", "a\tb", "a\x1b[2Jb"]
)
def test_a_name_that_cannot_be_seen_is_refused_and_not_repeated_raw(name: str) -> None:
    with pytest.raises(LutgenError, match=r"--reader '.*': give a name of 1 to 64 letters") as caught:
        reader_name(name)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["../../escaped", "/etc/passwd", "CON", "a'; DROP TABLE log; --", "%00"])
def test_a_name_never_reaches_the_file_system(study: Path, name: str) -> None:
    before = {path for path in study.parent.rglob("*") if "answers" not in path.parts}
    take_place(study, read_protocol(study), name, session=1, at=AT).close()
    assert {path for path in study.parent.rglob("*") if "answers" not in path.parts} == before
    (path,) = (study / "answers").iterdir()
    assert path.name == "reader-1.sqlite"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert read_entries(path, read_protocol(study).sha256)[0].content["reader"] == name


def test_a_name_has_its_place_and_a_new_one_takes_the_next(study: Path) -> None:
    protocol = read_protocol(study)
    places = []
    for name in ("M\u00fcller", "B", reader_name("mu\u0308LLER"), "b"):
        with closing(take_place(study, protocol, name, session=1, at=AT)) as file:
            places.append(file.path.name)
    assert places == ["reader-1.sqlite", "reader-2.sqlite"] * 2
    with pytest.raises(LutgenError, match=r"planned for 2 reader\(s\), and all places are taken") as caught:
        take_place(study, protocol, "C", session=1, at=AT)
    assert "ller" not in str(caught.value)


def test_a_mistyped_name_takes_no_place_for_a_later_session(study: Path) -> None:
    with pytest.raises(LutgenError, match="no reader 'Dr X' has read session 1"):
        take_place(study, read_protocol(study), "Dr X", session=2, at=AT)
    assert not (study / "answers").exists()


def test_a_place_whose_first_row_was_never_written_is_free(study: Path) -> None:
    (study / "answers").mkdir()
    (study / "answers/reader-1.sqlite").touch()
    assert read_answers(study) == ()
    with closing(take_place(study, read_protocol(study), "Dr A", session=1, at=AT)) as file:
        assert file.path.name == "reader-1.sqlite"


def test_answers_are_read_back_as_given_without_practice(read: Path) -> None:
    protocol, answers = read_protocol(read), read_answers(read)
    assert [answer.position for answer in answers] == [1, 2, 3, 4]
    assert [(answer.image, answer.condition) for answer in answers] == [
        (trial.image, trial.condition) for trial in protocol.session(1, 1)
    ]
    for answer in answers:
        pressed = decision(answer.position)
        assert (answer.category, answer.ease, answer.seconds) == (pressed.category, pressed.ease, pressed.seconds)
        assert answer.positive == (answer.category in {"2+", "3+"})
        assert (answer.reader, answer.session) == ("Dr A", 1)


def test_no_answers_are_no_error(study: Path) -> None:
    assert read_answers(study) == ()


def test_the_chain_is_what_is_documented(read: Path) -> None:
    """A literal twin: SHA-256 of the previous hash and the row's columns as a JSON list, from the protocol's hash."""
    with closing(sqlite3.connect(read / "answers/reader-1.sqlite")) as connection:
        rows = connection.execute("SELECT row, at, session, kind, content, hash FROM log ORDER BY row").fetchall()
    before = json.loads((read / "protocol.json").read_text())["sha256"]
    assert len(rows) > 8
    for *columns, claimed in rows:
        text = json.dumps([before, *columns], separators=(",", ":"))
        before = hashlib.sha256(text.encode()).hexdigest()
        assert claimed == before


def edited(read: Path, tmp_path: Path, statement: str) -> Path:
    shutil.copytree(read, tmp_path / "edited")
    with closing(sqlite3.connect(tmp_path / "edited/answers/reader-1.sqlite")) as connection:
        connection.executescript(f"DROP TRIGGER never_changed; DROP TRIGGER never_removed; {statement}")
    return tmp_path / "edited"


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        (
            "UPDATE log SET content = replace(content, '\"ease\":2', '\"ease\":9')",
            r"row 4 \(practised, session 1\) was al",
        ),
        (
            "UPDATE log SET content = replace(content, '\"ease\":3', '\"ease\":9')",
            r"row 8 \(answered, session 1\) was al",
        ),
        ("UPDATE log SET at = '2026-01-01T00:00:00.000+00:00' WHERE row = 2", r"row 2 \(started, session 1\) was al"),
        ("UPDATE log SET session = 2 WHERE row = 6", r"row 6 \(answered, session 2\) was al"),
        ("UPDATE log SET kind = 'practised' WHERE row = 6", r"row 6 \(practised, session 1\) was al"),
        ("UPDATE log SET content = CAST(content AS BLOB) WHERE row = 6", r"row 6 \(answered, session 1\) was al"),
        ("UPDATE log SET hash = upper(hash) WHERE row = 6", r"row 6 \(answered, session 1\) was al"),
        ("UPDATE log SET content = replace(content, 'Dr A', 'Dr B')", r"row 1 \(opened, session 0\) does not belong"),
        ("DELETE FROM log WHERE row = 6", r"row 6 is missing before row 7"),
        ("DELETE FROM log WHERE row = 1", r"row 1 is missing"),
        ("UPDATE log SET row = -6 WHERE row = 6", r"row 1 is missing before row -6"),
        ("DELETE FROM log", "all its rows are missing"),
        (
            "DELETE FROM log WHERE row = (SELECT max(row) FROM log)",
            r"row \d+ is missing, after row \d+ \(answered, ses",
        ),
        ("DELETE FROM log WHERE row > 6", r"row 7 is missing, after row 6 \(answered, session 1\)"),
        ("DROP TABLE log", "no such table"),
        ("INSERT INTO log VALUES (99, '', 1, 'answered', '{}', '')", r"is missing before row 99"),
        (
            "UPDATE log SET content = (SELECT content FROM log WHERE row = 8) WHERE row = 6",
            r"row 6 \(answered, session 1\) was al",
        ),
    ],
)
def test_an_edit_by_hand_is_found_and_the_row_named(read: Path, tmp_path: Path, statement: str, message: str) -> None:
    with pytest.raises(LutgenError, match=f"reader-1.sqlite: .*{message}"):
        read_answers(edited(read, tmp_path, statement))


def test_sqlite_itself_refuses_to_change_rows(read: Path) -> None:
    with closing(sqlite3.connect(read / "answers/reader-1.sqlite")) as connection:
        for statement in ("UPDATE log SET kind = 'x'", "DELETE FROM log"):
            with pytest.raises(sqlite3.IntegrityError, match="rows are never"):
                connection.execute(statement)


def test_a_session_that_ends_with_another_number_of_answers_is_found(study: Path) -> None:
    """A forgery by a person who cuts answers out and computes every hash again."""
    protocol = read_protocol(study)
    with closing(take_place(study, protocol, "Dr A", session=1, at=AT)) as file:
        file.append(AT, 1, [("started", {"images": 4}), ("ended", {"answers": 4})])
    with pytest.raises(LutgenError, match="row 3 ends session 1 with another number of answers"):
        read_answers(study)


@pytest.mark.parametrize(
    ("position", "category"), [(5, "0"), (0, "0"), (1, "4+")], ids=["a fifth image", "an image 0", "a category"]
)
def test_answers_that_the_protocol_does_not_ask_are_refused(study: Path, position: int, category: str) -> None:
    with closing(take_place(study, read_protocol(study), "Dr A", session=1, at=AT)) as file:
        file.append(AT, 1, [("answered", {"position": position, "category": category, "seconds": 1.0, "ease": 1})])
    with pytest.raises(LutgenError, match="row 2 answers what the protocol does not ask"):
        read_answers(study)


def test_another_readers_file_under_a_readers_name_is_refused(read: Path, tmp_path: Path) -> None:
    shutil.copytree(read, tmp_path / "copied")
    answers = tmp_path / "copied/answers"
    shutil.copyfile(answers / "reader-1.sqlite", answers / "reader-2.sqlite")
    with pytest.raises(LutgenError, match=r"reader-2\.sqlite: is a copy of reader-1\.sqlite"):
        read_answers(tmp_path / "copied")


def test_answers_to_another_protocol_are_refused(read: Path, tmp_path: Path) -> None:
    other = make_study(tmp_path / "other", seed=2)
    shutil.copytree(read / "answers", tmp_path / "other/answers")
    assert other.sha256 != read_protocol(read).sha256
    with pytest.raises(LutgenError, match=r"row 1 .* does not belong to this study's protocol"):
        read_answers(tmp_path / "other")


@pytest.mark.parametrize("damage", ["text", "cut", "overwritten"])
def test_a_damaged_file_is_named(read: Path, tmp_path: Path, damage: str) -> None:
    shutil.copytree(read, tmp_path / "damaged")
    path = tmp_path / "damaged/answers/reader-1.sqlite"
    data = path.read_bytes()
    path.write_bytes(
        {"text": b"image,ease\n1,9\n" * 99, "cut": data[:5000], "overwritten": data[:4096] + bytes(len(data) - 4096)}[
            damage
        ]
    )
    with pytest.raises(LutgenError, match=r"reader-1\.sqlite: cannot be used as a file of answers"):
        read_answers(tmp_path / "damaged")


def test_a_full_disk_saves_nothing_by_halves_and_goes_on_when_there_is_room(tmp_path: Path) -> None:
    """SQLite's own limit of pages gives the same error as a full disk."""
    with closing(AnswerFile(tmp_path / "a.sqlite", "anchor", first=(AT, {}))) as file:
        (pages,) = file._connection.execute("PRAGMA page_count").fetchone()
        file._connection.execute(f"PRAGMA max_page_count = {pages}")
        long = {"text": "x" * 5000}
        with pytest.raises(NotSavedError, match=r"a\.sqlite: cannot be written \(database or disk is full\)"):
            file.append(AT, 1, [("answered", {}), ("answered", long)])
        assert len(read_entries(file.path, "anchor")) == len(file.entries) == 1
        file._connection.execute("PRAGMA max_page_count = 1000000")
        file.append(AT, 1, [("answered", {}), ("answered", long)])
        assert read_entries(file.path, "anchor") == file.entries
    assert len(file.entries) == 3


def test_answers_of_an_altered_protocol_are_not_read(read: Path, tmp_path: Path) -> None:
    shutil.copytree(read, tmp_path / "altered")
    path = tmp_path / "altered/protocol.json"
    path.write_text(path.read_text().replace('"washout_days": 24.0', '"washout_days": 1.0'))
    with pytest.raises(LutgenError, match="was altered after it was frozen"):
        read_answers(tmp_path / "altered")
    write_protocol(tmp_path / "altered", read_protocol(read))
    assert read_answers(tmp_path / "altered") == read_answers(read)
