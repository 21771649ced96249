"""The commands ``lutgen sessions explain`` and ``lutgen trend``."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.command import Done

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).parents[1]
CAMPAIGN = str(ROOT / "examples/campaign/campaign.toml")


def test_the_examples_are_what_their_script_writes() -> None:
    command = [sys.executable, "-m", "examples.make_campaign", "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_explain_prints_a_page_and_writes_json_as_its_schema_says(run: Callable[..., Done]) -> None:
    done = run("sessions", "explain", CAMPAIGN, "--json", "explain.json")
    assert (done.code, done.err) == (0, "")
    assert done.lines[0].startswith("Simulated, not measured")
    content = json.loads(Path("explain.json").read_text())
    validator("explain").validate(content)
    causes = {Path(each["file"]).stem: each["causes"] for each in content["sessions"]}
    # The causes in examples/make_campaign.py.
    assert causes["2022-01"] == ["brightness"]
    assert causes["2023-06"][0] == "ambient"
    assert causes["2024-12"] == ["aging"]


def test_sessions_are_explained_without_a_campaign_file_too(run: Callable[..., Done]) -> None:
    first, dimmed = (str(Path(CAMPAIGN).with_name(name)) for name in ("2021-01.ti3", "2022-01.ti3"))
    done = run("sessions", "explain", first, dimmed, "--json", "-")
    validator("explain").validate(json.loads(done.out))
    assert "brightness" in json.loads(done.out)["sessions"][-1]["causes"]
    for files, message in (((first,), "one session"), ((first, first), "the same bytes"), ((first, "x.ti3"), "x.ti3")):
        done = run("sessions", "explain", *files)
        assert (done.code, done.out) == (2, "")
        assert message in done.err


@pytest.mark.slow
@pytest.mark.parametrize("command", [("sessions", "explain"), ("trend",)])
def test_what_a_reader_had_to_decide_is_said(
    command: tuple[str, ...], run: Callable[..., Done], tmp_path: Path
) -> None:
    blocks = []
    for share, day in ((1.0, 1), (0.9, 2)):
        rows = (
            f"{r},{g},{b},{60 * r * share},{80 * g * share},{70 * b * share}"
            for r in (0, 1)
            for g in (0, 1)
            for b in (0, 1)
        )
        (tmp_path / f"{day}.csv").write_text("\n".join(["R,G,B,X,Y,Z", *rows]) + "\n")
        blocks.append(f'[[sessions]]\nfile = "{day}.csv"\nhours = {1000 * day}\n')
    (tmp_path / "c.toml").write_text("schema = 1\n" + "".join(blocks))
    done = run(*command, tmp_path / "c.toml")
    assert "taken as cd/m², of which white has 80: the header" in done.err
    assert "of which white has 72: the header" in done.err


def test_trend_prints_draws_and_writes(run: Callable[..., Done]) -> None:
    arguments = ("trend", CAMPAIGN, "--limit", "white>=60%", "--plot", "a.png", "--json", "a.json")
    done = run(*arguments)
    assert (done.code, done.err) == (0, "")
    assert done.lines[0].startswith("Simulated, not measured")
    assert "Left out: 2022-01.ti3. It looks as if the display's brightness or preset was changed." in done.lines
    assert "white>=60%: as given by --limit." in done.lines
    content = json.loads(Path("a.json").read_text())
    validator("trend").validate(content)
    assert content["limits"][0]["extrapolated"]
    assert Path("a.png").read_bytes()[:4] == b"\x89PNG"


def test_a_limit_of_two_sets_that_no_session_tells_is_said_once(run: Callable[..., Done]) -> None:
    folder = Path(CAMPAIGN).parent
    for name in ("2021-01.ti3", "2024-12.ti3"):
        shutil.copyfile(folder / name, name)
    sessions = "".join(f'[[sessions]]\nfile = "{year}.ti3"\ndate = {year}-15\n' for year in ("2021-01", "2024-12"))
    Path("two.toml").write_text(f"schema = 1\n{sessions}")
    done = run("trend", "two.toml", "--limits", "tg18-primary", "--limits", "acr-diagnostic")
    (sentence,) = [line for line in done.lines if line.startswith("No session has the readings for these limits: ")]
    assert sentence.count("non-uniformity<=30%") == 1


@pytest.mark.slow
def test_trend_writes_the_same_every_time(run: Callable[..., Done]) -> None:
    for plot, numbers in (("a.png", "a.json"), ("b.png", "-")):
        done = run("trend", CAMPAIGN, "--limit", "white>=60%", "--plot", plot, "--json", numbers)
    assert json.loads(done.out) == json.loads(Path("a.json").read_text())
    assert Path("b.png").read_bytes() == Path("a.png").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sessions", "explain", "none.toml"), "cannot read the readings"),
        (("sessions", "explain", CAMPAIGN, "--reference", "x"), "names 0 of its sessions"),
        (("sessions", "explain", CAMPAIGN, "--json", "there.json"), "exists already"),
        (("trend", "none.toml", "--plot", "new.png"), "cannot read the readings"),
        (("trend", CAMPAIGN, "--plot", "new.jpg"), "ends in .png"),
        (("trend", CAMPAIGN, "--limit", "white>200"), "write a quantity"),
        (("trend", CAMPAIGN, "--limits", "x"), "Invalid value"),
        (("trend", CAMPAIGN, "--ambient", "1_0"), "'1_0' is not a finite number"),
        (("trend", CAMPAIGN, "--reference", "x"), "names 0 of its sessions"),
        (("trend", CAMPAIGN, "--reference", "2021-01.ti3", "--all-sessions"), "leave out --reference"),
        (("trend",), "Missing argument"),
    ],
)
def test_bad_input_ends_with_2_and_leaves_nothing(
    run: Callable[..., Done], arguments: tuple[str, ...], message: str
) -> None:
    Path("there.json").write_text("{}")
    done = run(*arguments)
    assert done.code == 2
    assert message in done.err
    assert "Traceback" not in done.err
    assert sorted(path.name for path in Path().iterdir()) == ["there.json"]


def test_a_table_of_readings_with_hours_is_followed_session_by_session(run: Callable[..., Done]) -> None:
    done = run("trend", str(Path(CAMPAIGN).parent.parent / "display-a.csv"), "--limit", "white>=60%")
    assert done.code == 0
    assert "white will fall below its 60 % limit" in done.out
