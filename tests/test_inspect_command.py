"""The command ``lutgen inspect``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.command import Done, in_process
from tests.session_files import curves, ti3

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.numbers


@pytest.fixture
def inspect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    monkeypatch.chdir(tmp_path)
    Path("one.ti3").write_text(ti3(calibration=curves(1, 0.9, 0.8)))
    Path("two.ti3").write_text(ti3(keywords=()))
    Path("campaign.toml").write_text('schema = 1\n[[sessions]]\nfile = "one.ti3"\n[[sessions]]\nfile = "two.ti3"\n')
    return in_process(monkeypatch, capsys, "inspect")


def test_one_session_is_a_page(inspect: Callable[..., Done]) -> None:
    done = inspect("one.ti3")
    assert (done.code, done.err) == (0, "")
    assert done.lines[0] == "one.ti3"
    assert "0.3127  0.3290        200.0    0.2      1000  2.20" in done.out
    assert "red at the limit (red 1.000, green 0.900, blue 0.800)" in done.out
    assert "\nMissing: " in done.out
    assert "One place on the screen: no edge fall-off" in done.out


def test_several_sessions_share_a_table_and_a_campaign_is_its_sessions(inspect: Callable[..., Done]) -> None:
    done = inspect("one.ti3", "two.ti3")
    assert done.code == 0
    assert done.out.count("200.0") >= 1
    assert inspect("campaign.toml").out.splitlines()[:3] == done.lines[:3]
    assert inspect(".").out == inspect("campaign.toml").out
    everywhere = done.lines[-1]
    assert everywhere.startswith("Missing in every session: ")
    assert done.out.count("One place on the screen: no edge fall-off") == 1
    assert "One place on the screen: no edge fall-off" in everywhere
    assert "No calibration curves" in done.out
    assert "No calibration curves" not in everywhere


def test_json_stands_alone_and_pictures_are_named(inspect: Callable[..., Done]) -> None:
    done = inspect("one.ti3", "two.ti3", "--json", "-", "--plots", "plots")
    content = json.loads(done.out)
    assert [each["file"] for each in content["sessions"]] == ["one.ti3", "two.ti3"]
    assert content["sessions"][0]["calibration"]["at_stop"] == ["red"]
    assert sorted(path.name for path in Path("plots").iterdir()) == ["inspect-one.png", "inspect-two.png"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("none.ti3",), "cannot read the readings"),
        ((), "Missing argument"),
        (("one.ti3", "--json", "there.json"), "exists already"),
        (("one.ti3", "one.ti3", "--plots", "plots"), "two sessions would be drawn"),
        (("one.ti3", "bad.ti3", "--plots", "plots", "--json", "new.json"), "cut off"),
        (("campaign-of-none.toml",), "cannot read the readings"),
    ],
)
def test_bad_input_ends_with_2_and_leaves_nothing(
    inspect: Callable[..., Done], arguments: tuple[str, ...], message: str
) -> None:
    Path("there.json").write_text("{}")
    Path("bad.ti3").write_text(ti3()[:900])
    done = inspect(*arguments)
    assert done.code == 2
    assert message in done.err
    assert "Traceback" not in done.err
    assert not Path("plots").exists()
    assert not Path("new.json").exists()
