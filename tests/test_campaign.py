"""Campaigns: the sessions of one display as one table of readings, and the draft of the file that lists them."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen import LutgenError, read_measurements
from lutgen.readings import read_campaign
from tests.command import Done, in_process
from tests.session_files import DRIVE, WHITE_CD_M2, light, ti3

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.numbers

HEAD = 'schema = 1\n[display]\nname = "invented"\n'
RELATIVE = ti3(keywords=())

#: Line of a session's first reading.
DATA_LINE = ti3().splitlines().index("BEGIN_DATA") + 2


def session(date: str, share: float = 1.0, name: str = "invented") -> str:
    """A session of the invented display, dimmed to a share of its light."""
    luminance = f'LUMINANCE_XYZ_CDM2 "{190.09 * share} {WHITE_CD_M2 * share} {217.8 * share}"'
    return ti3(keywords=(luminance, 'NORMALIZED_TO_Y_100 "YES"'), name=name).replace("Tue May 26 13:21:48 2020", date)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three sessions, ten and a hundred days apart."""
    for name, date, share in (("a", "2020-01-01", 1.0), ("b", "2020-01-11", 0.9), ("c", "2020-04-10", 0.7)):
        (tmp_path / f"{name}.ti3").write_text(session(date, share))
    (tmp_path / "relative.ti3").write_text(RELATIVE)
    return tmp_path


def written(folder: Path, text: str) -> Path:
    path = folder / "campaign.toml"
    path.write_text(text)
    return path


def test_a_single_session_needs_no_hours(folder: Path) -> None:
    path = written(folder, f'{HEAD}[[sessions]]\nfile = "a.ti3"\n')
    assert read_campaign(path).hours().tolist() == [0.0]
    assert read_measurements(path).hours.tolist() == [0.0] * len(DRIVE)


def test_sessions_without_times_are_refused_with_the_ways_to_give_them(tmp_path: Path) -> None:
    for name, white in (("a.csv", 100.0), ("b.csv", 90.0)):
        (tmp_path / name).write_text(f"R,G,B,X_cdm2,Y_cdm2,Z_cdm2\n1,1,1,95,{white},108\n0,0,0,0.1,0.1,0.1\n")
    campaign = read_campaign(tmp_path / "a.csv", tmp_path / "b.csv")
    with pytest.raises(LutgenError, match="neither hours nor date") as refused:
        campaign.hours()
    assert all(way in str(refused.value) for way in ("column 'hour'", "# date: ", "lutgen sessions init"))


def test_dates_become_hours_by_the_hours_of_a_day(folder: Path) -> None:
    blocks = "".join(f'[[sessions]]\nfile = "{name}.ti3"\n' for name in "cab")
    path = written(folder, f"{HEAD}hours_per_day = 6.0\n{blocks}")
    assert read_campaign(path).hours().tolist() == [600.0, 0.0, 60.0]
    readings = read_measurements(path)
    hours, tips = readings.tips()
    assert hours.tolist() == [0.0, 60.0, 600.0]
    np.testing.assert_allclose(tips[:, 0, 2], WHITE_CD_M2 * np.array([1.0, 0.9, 0.7]), rtol=1e-6)
    np.testing.assert_allclose(readings.drive[: len(DRIVE)], DRIVE, atol=1e-6)
    np.testing.assert_allclose(readings.xyz_cd_m2[-len(DRIVE) :], 0.7 * WHITE_CD_M2 * light(), atol=1e-3)
    assert readings.session[0] == "a.ti3"
    assert (readings.files[0], readings.lines[0]) == (str(folder / "a.ti3"), DATA_LINE)
    assert readings.places([0, len(DRIVE), 2]) == f"a.ti3, lines {DATA_LINE}, {DATA_LINE + 2}; b.ti3, line {DATA_LINE}"
    assert readings.order is not None
    assert (np.diff(readings.order) > 0).all()
    assert readings.metadata["display"] == "invented"


def test_a_doubtful_date_in_a_file_is_told_of_this_file_and_only_if_the_campaign_states_no_time(folder: Path) -> None:
    (folder / "b.ti3").write_text(session("3/4/2019", 0.9))
    blocks = [f'[[sessions]]\nfile = "{name}.ti3"\n' for name in "ab"]
    told = read_campaign(folder / "b.ti3").entries[0].session
    assert told.remarks == (told.date_remark,)
    assert "Its date, '3/4/2019', is unknown or ambiguous" in told.date_remark
    for times in (("hours = 0\n", "hours = 9\n"), ("date = 2019-01-01\n", "date = 2019-04-03\n")):
        text = "".join(block + time for block, time in zip(blocks, times, strict=True))
        readings = read_measurements(written(folder, f"{HEAD}hours_per_day = 8.0\n{text}"))
        assert not readings.remarks
    path = written(folder, f"{HEAD}{blocks[0]}hours = 0\n{blocks[1]}")
    assert read_campaign(path).entries[1].session.remarks == told.remarks


def test_a_remark_on_some_sessions_names_their_files(folder: Path) -> None:
    names = ("relative", "other")
    (folder / "other.ti3").write_text(ti3(xyz=99.0 * light(), keywords=()))
    blocks = [f'[[sessions]]\nfile = "{name}.ti3"\nhours = {at}\nwhite_cd_m2 = 80.0\n' for at, name in enumerate(names)]
    relative = "XYZ are relative to white"
    assert read_measurements(written(folder, HEAD + "".join(blocks))).remarks[0].startswith(relative)
    third = '[[sessions]]\nfile = "a.ti3"\nhours = 9\n'
    remarks = read_measurements(written(folder, HEAD + "".join([*blocks, third]))).remarks
    assert remarks[0].startswith(f"relative.ti3, other.ti3: {relative}")


def test_hours_are_counted_from_the_first_session(folder: Path) -> None:
    blocks = "".join(
        f'[[sessions]]\nfile = "{name}.ti3"\nhours = {h}\n' for name, h in (("a", 500), ("b", 800), ("c", 4500.5))
    )
    assert read_measurements(written(folder, HEAD + blocks)).tips()[0].tolist() == [0.0, 300.0, 4000.5]


def test_conditions_reach_the_readings_and_the_rest_is_as_usual(folder: Path) -> None:
    text = f"""{HEAD}
[[sessions]]
file = "a.ti3"
hours = 0
[[sessions]]
file = "b.ti3"
hours = 0
ambient_lx = 80.0
position = [0.1, 0.9]
settings = "brightness 30 %"
instrument = "another meter"
"""
    path = written(folder, text)
    readings = read_measurements(path)
    lit = readings.conditions["ambient_lx"] > 0
    assert lit.sum() == len(DRIVE)
    assert set(readings.conditions["u"][lit]) == {0.1}
    assert set(readings.conditions["u"][~lit]) == {0.5}
    assert set(np.array(readings.note)[lit]) == {"brightness 30 %"}
    assert read_campaign(path).entries[1].instrument == "another meter"


def test_the_hash_covers_the_sessions(folder: Path) -> None:
    path = written(folder, f'{HEAD}[[sessions]]\nfile = "a.ti3"\nhours = 0\n')
    before = read_measurements(path).sha256
    (folder / "a.ti3").write_text(session("2020-01-02"))
    assert read_measurements(path).sha256 != before


A = '[[sessions]]\nfile = "a.ti3"\n'

#: Text after the head, and the words of the error.
BAD = {
    "no TOML": ("[[sessions", "is no TOML"),
    "an unknown key": (f"{A}hour = 3\n", r"line 4: unknown key 'hour'\. Pick one of: ambient_lx, date"),
    "an unknown key of the display": (f"hours = 3\n{A}", "unknown key 'hours'"),
    "no sessions": ("", "needs .* one .*sessions"),
    "no file": ("[[sessions]]\nhours = 1\n", "names no file"),
    "a file that is missing": ('[[sessions]]\nfile = "z.ti3"\n', "cannot read the readings"),
    "a name that is too long": (f'[[sessions]]\nfile = "{"9" * 5000}"\n', "cannot read the readings"),
    "a number for a file": ("[[sessions]]\nfile = 3\n", "must be text"),
    "the same session twice": (
        f"{A}hours = 0\n{A}hours = 9\n",
        r"line 7: .* the same bytes as the session of .*line 4",
    ),
    "no hours": (f'{A}[[sessions]]\nfile = "b.ti3"\n', "dates, which are no operating hours"),
    "some hours": (f'{A}[[sessions]]\nfile = "b.ti3"\nhours = 9\n', "hours where others only have a date"),
    "a quoted date": (f'{A}date = "2020-05-26"\n', "without quotes"),
    "an absurd date": (f"{A}date = 1904-01-01\n", "displays are not older"),
    "month 13": (f"{A}date = 2020-13-01\n", "is no TOML"),
    "hours in words": (f'{A}hours = "many"\n', "must be a number"),
    "no number": (f"{A}hours = nan\n", "must be a number"),
    "negative hours": (f"{A}hours = -3\n", "hours = -3 must be"),
    "25 hours a day": (f"hours_per_day = 25\n{A}", "at most 24"),
    "a window of nothing": (f"{A}hours = 0\nwindow = 0.0\n", "window = 0 must be"),
    "half a position": (f"{A}hours = 0\nposition = [0.5]\n", "two numbers"),
    "a position off the screen": (f"{A}hours = 0\nposition = [0.5, 1.5]\n", "v = 1.5 must be"),
    "sessions in one line": ('sessions = [{file = "a.ti3"}]\n', "one .*sessions.* for every session"),
    "white of a session in cd/m²": (f"{A}hours = 0\nwhite_cd_m2 = 80.0\n", "a.ti3: is in cd/m².* Delete white_cd_m2"),
    "white without light": (f"{A}hours = 0\nwhite_cd_m2 = 0.0\n", "must be white's luminance"),
    "a relative session": ('[[sessions]]\nfile = "relative.ti3"\nhours = 0\n', "relative to white"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_campaigns_are_refused_with_a_sentence(folder: Path, name: str) -> None:
    text, message = BAD[name]
    with pytest.raises(LutgenError, match=message):
        read_measurements(written(folder, HEAD + text))


@pytest.mark.parametrize("keywords", [(), ('NORMALIZED_TO_Y_100 "YES"',)])
def test_a_campaign_says_how_bright_the_white_of_a_relative_session_was(
    folder: Path, keywords: tuple[str, ...]
) -> None:
    (folder / "relative.ti3").write_text(ti3(keywords=keywords))
    path = written(folder, f'{HEAD}[[sessions]]\nfile = "relative.ti3"\nwhite_cd_m2 = 80.0\n')
    readings = read_measurements(path)
    np.testing.assert_allclose(readings.xyz_cd_m2, 80.0 * light(), atol=1e-3)
    assert any("White is 80 cd/m²" in remark and "line 4" in remark for remark in readings.remarks)


@pytest.mark.parametrize("kind", ["CTI3", "CGATS.17"])
def test_a_file_in_candela_that_does_not_say_so_says_what_to_write(folder: Path, kind: str) -> None:
    (folder / "silent.ti3").write_text(ti3(xyz=77.5 * light(), keywords=(), kind=kind))
    with pytest.raises(
        LutgenError, match=r'Y = 77\.5.* NORMALIZED_TO_Y_100 "NO", or say white_cd_m2 = 77\.5 in a'
    ) as refusal:
        read_measurements(folder / "silent.ti3")
    assert "silent.ti3" in str(refusal.value)
    path = written(folder, f'{HEAD}[[sessions]]\nfile = "silent.ti3"\nwhite_cd_m2 = 77.5\n')
    np.testing.assert_allclose(read_measurements(path).xyz_cd_m2, 77.5 * light(), atol=1e-3)


def test_a_campaign_of_another_schema_is_refused(folder: Path) -> None:
    with pytest.raises(LutgenError, match=r"schema = 2; a campaign has schema = 1"):
        read_measurements(written(folder, f"schema = 2\n{A}"))
    with pytest.raises(LutgenError, match="cannot read"):
        read_campaign(folder / "none.toml")
    (folder / "latin.toml").write_bytes(b"# \xff\n")
    with pytest.raises(LutgenError, match="schema"):
        read_campaign(folder / "latin.toml")
    (folder / "round.toml").write_text(f'{HEAD}[[sessions]]\nfile = "round.toml"\n')
    with pytest.raises(LutgenError, match=r"round\.toml, line 4: .* is a campaign file itself"):
        read_campaign(folder / "round.toml")


@given(text=st.text(max_size=200))
def test_any_text_is_a_campaign_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    for content in (text, HEAD + text, f"{HEAD}{A}{text}"):
        path.write_bytes(content.encode("utf-8", "surrogatepass"))
        with pytest.raises(LutgenError):
            read_campaign(path)


# The draft


@pytest.fixture
def init(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    monkeypatch.chdir(folder)
    return in_process(monkeypatch, capsys, "sessions", "init")


def test_a_draft_says_what_the_files_say_and_leaves_open_what_only_a_person_knows(
    folder: Path, init: Callable[..., Done]
) -> None:
    done = init("c.ti3", "a.ti3", "b.ti3", "-o", "made/campaign.toml")
    assert (done.code, done.err) == (0, "")
    text = (folder / "made/campaign.toml").read_text()
    content = tomllib.loads(text)
    assert content["display"]["name"] == "invented"
    assert [(each["file"], str(each["date"])) for each in content["sessions"]] == [
        ("../a.ti3", "2020-01-01"), ("../b.ti3", "2020-01-11"), ("../c.ti3", "2020-04-10"),
    ]  # fmt: skip
    assert text.count("# TODO ambient_lx") == 3
    assert "# TODO hours_per_day" in text
    assert "35 readings; white 140.0 cd/m²" in text
    with pytest.raises(LutgenError, match="no operating hours"):
        read_measurements(folder / "made/campaign.toml")
    (folder / "made/campaign.toml").write_text(text.replace("# TODO hours_per_day", "hours_per_day"))
    assert read_measurements(folder / "made/campaign.toml").tips()[0].tolist() == [0.0, 80.0, 800.0]


def test_a_person_at_a_terminal_is_asked(
    folder: Path, init: Callable[..., Done], monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = iter(["", "6", "0", "brightness 30 %"])
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.termui.visible_prompt_func", lambda _text: next(answers))
    assert init("a.ti3", "b.ti3", "-o", "campaign.toml").code == 0
    campaign = read_campaign(folder / "campaign.toml")
    assert campaign.hours_per_day == 6.0
    assert campaign.entries[0].conditions == {"ambient_lx": 0.0}
    assert campaign.entries[1].settings == "brightness 30 %"
    assert campaign.hours().tolist() == [0.0, 60.0]


def test_an_answer_that_makes_no_sense_is_refused(init: Callable[..., Done], monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter(["", "forty", "", ""])
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.termui.visible_prompt_func", lambda _text: next(answers))
    done = init("a.ti3", "-o", "campaign.toml")
    assert done.code == 2
    assert "hours_per_day: 'forty'" in done.err
    assert not Path("campaign.toml").exists()


def test_other_displays_are_noticed_and_named(folder: Path, init: Callable[..., Done]) -> None:
    mixed = light() @ np.array([[0.8, 0.1, 0.0], [0.1, 0.9, 0.1], [0.1, 0.0, 0.9]]).T
    (folder / "other.ti3").write_text(ti3(xyz=100 * mixed / mixed[0, 1]).replace("2020", "2021"))
    (folder / "named.ti3").write_text(session("2021-01-01", name="another"))
    (folder / "generic.ti3").write_text(session("2021-01-02", name="Color LCD"))
    for other in ("other.ti3", "named.ti3"):
        done = init("a.ti3", other, "-o", "campaign.toml")
        assert done.code == 2
        assert re.search(rf"of 2 displays.*a\.ti3.*{other}", done.err)
        assert not (folder / "campaign.toml").exists()
    assert init("a.ti3", "generic.ti3", "-o", "one.toml").code == 0
    done = init("a.ti3", "other.ti3", "-o", "campaign.toml", "--same-display")
    assert done.code == 0
    assert "look like 2 displays" in done.out


def test_nothing_is_replaced_unasked_nor_written_for_bad_input(folder: Path, init: Callable[..., Done]) -> None:
    (folder / "campaign.toml").write_text("mine")
    done = init("a.ti3", "-o", "campaign.toml")
    assert (done.code, "exists already" in done.err) == (2, True)
    assert (folder / "campaign.toml").read_text() == "mine"
    assert init("a.ti3", "-o", "campaign.toml", "--force").code == 0
    for arguments, message in (
        (("a.ti3", "-o", "x.txt"), "ends in .toml"),
        (("a.ti3", "a.ti3", "-o", "x.toml"), "the same bytes"),
        (("none.ti3", "-o", "x.toml"), "cannot read"),
    ):
        done = init(*arguments)
        assert done.code == 2
        assert message in done.err
    assert not (folder / "x.toml").exists()


def test_a_file_too_large_for_a_campaign_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(2_000_000_000)
    with pytest.raises(LutgenError, match=r"huge\.toml: larger than 64 MB, which no file of readings is\."):
        read_campaign(tmp_path / "huge.toml")
