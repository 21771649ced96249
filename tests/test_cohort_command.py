"""The command `lutgen cohort`: page, files, exit codes, broken slides, an interruption."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest
from jsonschema.exceptions import ValidationError

from lutgen import lifetime, save_model
from lutgen.pictures import cohort_workers
from lutgen.report.lifetimes import hours_or_never
from tests.altered import altered
from tests.cohort_slides import break_slide, make_slides, model, seven_colours, waiting_model
from tests.command import Done, here, in_process, words
from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.numbers


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run `lutgen cohort` in this process, in a folder with in/s00.png to in/s06.png."""
    monkeypatch.chdir(tmp_path)
    make_slides(tmp_path / "in", 7, side=24)

    lutgen = in_process(monkeypatch, capsys, "cohort")
    return lambda *arguments, hours="0..18000:6000": lutgen(*arguments, "--hours", hours)


def written(folder: Path) -> set[str]:
    return {path.relative_to(folder).parts[0] for path in folder.rglob("*") if path.is_file()} - {"in"}


# Printed text ---------------------------------------------------------------------------------------------------------


def test_the_page_has_a_line_a_slide_the_median_and_its_interval(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("in", "-o", "run", "--jobs", "1")
    assert (done.code, done.err) == (0, "")
    lines = [words(line) for line in done.out.splitlines()]
    assert lines[0] == "7 slides in run."
    images = lifetime(sorted((tmp_path / "in").iterdir()), model(), hours=range(0, 18_001, 6000)).images
    for mode in ("chroma", "chroma-luma"):
        head = lines.index(f"{mode}: hours until Max ΔE2000 3 Avg ΔE2000 3 Max ΔE2000 5 Avg ΔE2000 5")
        columns = [
            [image.curves[mode].hours_until(name, each) or float("inf") for image in images]
            for each in (3, 5)
            for name in ("max", "mean")
        ]

        def told(life: float) -> str:
            return words(hours_or_never(None if life == float("inf") else life))

        for place in range(7):
            assert lines[head + 1 + place] == " ".join(
                [f"in/s{place:02}.png", *(told(column[place]) for column in columns)]
            )
        middles = [told(sorted(column)[3]) for column in columns]
        assert lines[head + 8] == " ".join(["median of 7 slides", *middles])
        ranges = [f"{told(min(column))} to {told(max(column))}" for column in columns]
        assert lines[head + 9] == " ".join(["95 % interval", *ranges])
    assert "holds the median of all slides like these with 98.4 %" in words(done.out)
    assert "RECONSTRUCTED" in done.out


def test_few_slides_have_a_range_and_what_is_never_reached_is_explained(run: Callable[..., Done]) -> None:
    done = words(run("in/s00.png", "in/s01.png", "-o", "run", "--tolerance", "70", "--jobs", "1").out)
    assert "median of 2 slides – – range – to – – to –" in done
    assert "–: not within the 18 000 h looked at; in medians such a slide is the longest." in done
    assert "Fewer than six slides give no 95 % interval" in done


def test_a_broken_slide_is_named_and_the_others_finish(run: Callable[..., Done], tmp_path: Path) -> None:
    broken = tmp_path / "in/s03.png"
    whole = broken.read_bytes()
    break_slide(broken)
    (tmp_path / "list.txt").write_text("in/s00.png\nin/gone.svs\nin/s03.png\n")
    done = run("list.txt", "in", "-o", "run", "--jobs", "2", "--csv", "c.csv", "--json", "c.json")
    assert done.code == 1
    out = words(done.out)
    assert out.startswith("6 slides in run; 2 slides broken, named below and left out of all figures.")
    assert "Broken: in/gone.svs: " in out
    assert "Broken: in/s03.png: the image is truncated or damaged" in out
    document = json.loads((tmp_path / "c.json").read_text())
    assert [each["file"] for each in document["broken"]] == ["in/gone.svs", "in/s03.png"]
    assert document["over_all"]["slides"] == len(document["slides"]) == 6
    broken.write_bytes(whole)
    again = run("in", "-o", "run", "--jobs", "1")
    assert (again.code, words(again.out)[:50]) == (0, "7 slides in run, 6 of them from an earlier run. ch")


def test_nothing_but_broken_slides(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "bad.png").write_bytes(b"no image")
    done = run("bad.png", "-o", "run", "--json", "-")
    document = json.loads(done.out)
    assert (done.code, document["over_all"], document["slides"]) == (
        1,
        {"slides": 0, "coverage": None, "modes": {}},
        [],
    )
    assert run("bad.png", "-o", "run").out.startswith("0 slides in run; 1 slide broken")


# Written files --------------------------------------------------------------------------------------------------------


def test_json_is_as_the_schema_says_and_csv_says_the_same(run: Callable[..., Done], tmp_path: Path) -> None:
    written_to = ("--json", "c.json", "--csv", "c.csv")
    (tmp_path / "in, too.png").write_bytes(b"no image")
    done = run("in", "in, too.png", "-o", "run", *written_to, "--tolerance", "3,9,70", "--jobs", "1")
    assert done.code == 1
    assert written(tmp_path) == {"run", "c.json", "c.csv", "in, too.png"}
    document: dict[str, Any] = json.loads((tmp_path / "c.json").read_text())
    validator("cohort").validate(document)
    head, *rows = [line.split(",") for line in (tmp_path / "c.csv").read_text().splitlines()]
    assert head[:4] == ["row", "file", "mode", "mean_3"]
    assert [row[0] for row in rows] == ["slide"] * 14 + ["broken"] + ["median", "low", "high"] * 2
    lives = document["over_all"]["modes"]["chroma"]["lifetimes"]
    for row, key in zip(rows[15:18], ("median", 0, 1), strict=True):
        assert row[2] == "chroma"
        for tolerance in ("3", "9", "70"):
            of = lives[tolerance]["mean"]
            value = of["median"] if key == "median" else of["interval"][key]
            cell = row[head.index(f"mean_{tolerance}")]
            assert cell == ("" if value is None else f"{value:.1f}")
    assert lives["70"]["mean"] == {"median": None, "interval": [None, None], "range": [None, None], "reached": 0}
    assert len({len(row) for row in (head, *rows[:14], *rows[15:])}) == 1


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The JSON of a cohort of one slide."""
    folder = tmp_path_factory.mktemp("content")
    (slide,) = make_slides(folder / "in", 1, side=24)
    hours = ("--hours", "0..18000:6000")
    return json.loads(here("cohort", slide, "-o", folder / "run", "--json", "-", *hours).stdout)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("over_all", "slides"), None),
        (("over_all", "modes", "chroma", "lifetimes", "3", "mean", "median"), "long"),
        (("over_all", "modes", "chroma", "lifetimes", "3", "max", "interval"), [1.0]),
        (("over_all", "modes", "chroma", "curve", 0, "mean", "low"), None),
        (("slides", 0, "pixels"), 0),
        (("broken",), None),
    ],
)
def test_the_schema_refuses_what_is_wrong(content: Any, path: tuple[Any, ...], value: object) -> None:
    validator("cohort").validate(content)
    with pytest.raises(ValidationError):
        validator("cohort").validate(altered(content, path, value))


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("in", "--tolerance", "3,-1"), "tolerance -1: a tolerated ΔE2000 is a finite number above 0"),
        (("in", "--tolerance", "three"), "--tolerance three: give numbers in a list"),
        (("gone",), "gone: no such file or folder"),
        (("in", "gone.png"), "gone.png: no such file or folder"),
        (("gone.txt",), "gone.txt: cannot read the list of slides"),
        (("empty",), "empty: no slide in this folder or below"),
        (("in", "--model", "gone.toml"), "gone.toml"),
        (("in", "--json", "in"), "in: is a folder"),
        (("in", "--scheduler", "tcp://127.0.0.1:9"), "--scheduler tcp://127.0.0.1:9: no Dask scheduler answers there"),
        (("in", "--scheduler", "local"), "is no address of a Dask scheduler"),
        (("in", "--scheduler", "tcp://127.0.0.1:9", "--jobs", "2"), "--scheduler uses those of a cluster"),
        (("in", "--jobs", "0"), "--jobs"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    arguments: tuple[str, ...],
    message: str,
    run: Callable[..., Done],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if "--scheduler" in arguments:
        pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setattr(cohort_workers, "PATIENCE_S", 0.5)
    (tmp_path / "empty").mkdir()
    done = run(*arguments, "-o", "run", "--csv", "c.csv")
    assert (done.code, done.out) == (2, "")
    assert words(message) in words(done.err)
    assert written(tmp_path) == set()


def test_hours_beyond_the_measured_ones_are_refused(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("in", "-o", "run", hours="0..20000")
    assert (done.code, written(tmp_path)) == (2, set())
    assert "hour 20000 is outside the measured span" in done.err


@pytest.mark.parametrize("option", ["--json", "--csv", "-o"])
def test_nothing_is_replaced_without_force(option: str, run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "old").write_text("mine")
    where = ("-o", "run") if option != "-o" else ()
    done = run("in/s00.png", option, "old", *where)
    assert (done.code, (tmp_path / "old").read_text()) == (2, "mine")
    if option != "-o":
        assert run("in/s00.png", option, "old", *where, "--force").code == 0
        assert (tmp_path / "old").read_bytes() != b"mine"


# An interruption ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows interrupts in its own way")
def test_an_interrupted_run_keeps_what_is_finished_and_goes_on(tmp_path: Path) -> None:
    """Both processes wait at a slide before the last three: three results exist, and no fourth result can appear."""
    files = make_slides(tmp_path / "in", 8, side=24)
    for file in files[3:5]:
        seven_colours(file)
    save_model(waiting_model(tmp_path), tmp_path / "model.toml")
    options = ["--hours", "0,18000", "--model", "model.toml", "--jobs", "2"]
    command = [sys.executable, "-m", "lutgen", "cohort", "in", "-o", "run", *options]
    slides = tmp_path / "run/slides"
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as started:
        while len(list(slides.glob("*.json"))) < 3 and started.poll() is None:
            time.sleep(0.02)
        # As a terminal does: interrupt the command and its processes.
        os.killpg(started.pid, signal.SIGINT)
        out, err = started.communicate(timeout=60)
    assert (started.returncode, out) == (130, "")
    assert err.splitlines()[0].startswith("Interrupted. run keeps the finished slides; the same command continues")
    assert "Traceback" not in err
    assert len(list(slides.iterdir())) == 3
    assert {file.suffix for file in slides.iterdir()} == {".json"}
    (tmp_path / "gate").unlink()
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.startswith("8 slides in run, 3 of them from an earlier run.")
