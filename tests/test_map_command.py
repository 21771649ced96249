"""The commands `lutgen map` and `lutgen table`: pages, files, schemas, exit codes, bad input."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import DisplayModel, default_display, lifetime, read_measurements
from lutgen.cli.commands import map as map_command
from lutgen.pictures.lifetime import TABLE_1, TABLE_1_COLUMNS
from lutgen.report.difference_map import RANGE
from tests.command import Done, replaces_by_force_alone, words
from tests.quick import mostly_slow
from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.numbers

AGE = ("--mode", "chroma-luma", "--hours", "10000")


@pytest.fixture
def run(run: Callable[..., Done], tmp_path: Path) -> Callable[..., Done]:
    """Run `lutgen` in this process, in a folder with a.png and b.png."""
    tissue = np.asarray(immunohistochemistry())
    for name, corner in (("a.png", 200), ("b.png", 300)):
        imsave(tmp_path / name, tissue[corner : corner + 48, corner : corner + 48], check_contrast=False)
    return run


def written(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file()} - {"a.png", "b.png"}


def test_the_default_repeated_for_quick_help_is_the_librarys() -> None:
    (ends,) = (option.default for option in map_command.command.params if option.name == "ends")
    assert tuple(map(float, str(ends).split(","))) == RANGE


# lutgen map -----------------------------------------------------------------------------------------------------------


def test_one_run_writes_picture_numbers_and_json_that_agree(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("map", "a.png", *AGE, "-o", "m.png", "-o", "m.exr", "-o", "sub/m.tif", "--json", "m.json")
    assert (done.code, done.err) == (0, "")
    assert written(tmp_path) == {"m.png", "m.exr", "m.tif", "m.json"}
    content: dict[str, Any] = json.loads((tmp_path / "m.json").read_text())
    validator("map").validate(content)
    tif = np.asarray(Image.open(tmp_path / "sub/m.tif"))
    assert tif.dtype == np.float32
    assert content["delta_e"]["mean"] == pytest.approx(tif.mean(dtype=float), abs=1e-4)
    assert content["delta_e"]["max"] == pytest.approx(tif.max(), abs=1e-4)
    assert sum(content["histogram"]["pixels"]) == content["pixels"] == tif.size
    out = words(done.out)
    mean, most = content["delta_e"]["mean"], content["delta_e"]["max"]
    assert f"chroma-luma at 10 000 h changes pixels by ΔE2000 {mean:.1f} on average, {most:.1f} at most." in out
    assert "RECONSTRUCTED" in out
    assert "Written: m.png, m.exr, sub/m.tif" in out


def test_json_to_standard_output_is_alone(run: Callable[..., Done]) -> None:
    done = run("map", "a.png", *AGE, "-o", "m.png", "--json", "-")
    assert json.loads(done.out)["mode"] == "chroma-luma"


def test_the_range_changes_the_picture_alone(run: Callable[..., Done], tmp_path: Path) -> None:
    for name, ends in (("x", "0,12"), ("y", "0,20")):
        assert run("map", "a.png", *AGE, "-o", f"{name}.png", "-o", f"{name}.exr", "--range", ends).code == 0
    assert (tmp_path / "x.exr").read_bytes() == (tmp_path / "y.exr").read_bytes()
    assert (tmp_path / "x.png").read_bytes() != (tmp_path / "y.png").read_bytes()


def test_conditions_are_said(run: Callable[..., Done]) -> None:
    assert "Nothing in this model depends on ambient_lx." in words(
        run("map", "a.png", *AGE, "-o", "m.png", "--at", "ambient_lx=60").out
    )


@pytest.mark.parametrize("name", mostly_slow(["m.png", "m.exr", "m.json"], "m.png", "m.json"))
def test_nothing_is_replaced_without_force(name: str, run: Callable[..., Done], tmp_path: Path) -> None:
    arguments = ("map", "a.png", *AGE, "-o", "m.png", "-o", "m.exr", "--json", "m.json")
    (tmp_path / name).write_text("mine")
    assert (run(*arguments).code, written(tmp_path)) == (2, {name})
    replaces_by_force_alone(run, tmp_path / name, *arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--mode", "stable"), "'stable' is not one of 'chroma', 'chroma-luma'"),
        (("--hours", "20000"), "hour 20000 is outside the measured span 0..18000 h"),
        (("--hours", "nan"), "'nan' is not a finite number"),
        (("--range", "20,0"), "range 20,0: the second number must be larger"),
        (("--range", "5"), "--range 5: give the two ends of the scale, such as 0,12."),
        (("--range", "0,a"), "--range 0,a: give the two ends"),
        (("--range", "0,5,9"), "--range 0,5,9: give the two ends"),
        (("-o", "m.jpg"), "m.jpg: give a name that ends in .png, .exr, .tif or .tiff."),
        (("-o", "m.png"), "m.png: is given twice with -o"),
        (("-o", "a.png", "--force"), "a.png: is an input of this command, and is never written to"),
        (("-o", "sub"), "sub: give a name that ends in"),
        (("--display", "gone.csv"), "gone.csv"),
        (("--source", "film"), "'film' is not one of"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    before = (tmp_path / "a.png").read_bytes()
    done = run("map", "a.png", *AGE, "-o", "m.png", "-o", "m.exr", *arguments)
    assert (done.code, done.out) == (2, "")
    assert words(message) in words(done.err)
    assert written(tmp_path) == set()
    assert (tmp_path / "a.png").read_bytes() == before


@pytest.mark.parametrize("image", ["gone.png", "cut.png", "text.png"])
def test_an_image_that_cannot_be_read_is_named(image: str, run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "cut.png").write_bytes((tmp_path / "a.png").read_bytes()[:900])
    (tmp_path / "text.png").write_text("no image")
    done = run("map", image, *AGE, "-o", "m.png", "-o", "m.exr")
    assert (done.code, written(tmp_path)) == (2, {"cut.png", "text.png"})
    assert done.err.startswith(f"lutgen: error: {image}: ")


# lutgen table ---------------------------------------------------------------------------------------------------------


def test_the_published_numbers_are_those_of_the_papers_table() -> None:
    """In the printed order: Max 3, Avg 3, Max 5, Avg 5."""
    assert TABLE_1 == {"chroma": (4500, 7800, 8100, 11_100), "chroma-luma": (2200, 3700, 4100, 5800)}
    assert TABLE_1_COLUMNS == ((3.0, "max"), (3.0, "mean"), (5.0, "max"), (5.0, "mean"))


def test_table_1_stands_beside_the_papers(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("table", "1", "a.png", "b.png", "--json", "t.json", "--csv", "t.csv")
    assert (done.code, done.err) == (0, "")
    content = json.loads((tmp_path / "t.json").read_text())
    validator("table").validate(content)
    first, _ = lifetime(["a.png", "b.png"], DisplayModel(read_measurements(default_display()))).images
    assert len(content["rows"]) == 16
    row = content["rows"][5]
    hours = first.curves["chroma-luma"].hours_until("mean", 3.0)
    assert (row["mode"], row["tolerance"], row["statistic"], row["paper"]) == ("chroma-luma", 3.0, "mean", 3700)
    assert row["hours"] == hours
    assert row["difference"] == pytest.approx(hours / 3700.0 - 1.0)  # type: ignore[operator]
    out = words(done.out)
    assert "chroma, the paper 4 500 7 800 8 100 11 100 chroma, a.png" in out
    assert f"{100.0 * row['difference']:+.1f} %" in out
    assert "never published" in out
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines[6] == f"a.png,chroma-luma,3,mean,{hours:.1f},3700,{100.0 * row['difference']:.2f}"


def test_a_lifetime_that_is_never_reached_is_a_dash_and_null(run: Callable[..., Done], tmp_path: Path) -> None:
    rows = [line for line in default_display().read_text().splitlines() if not line[:1].isdigit()]
    rows += [line for line in default_display().read_text().splitlines() if line.split(",")[0] in ("0", "500")]
    (tmp_path / "young.csv").write_text("\n".join(rows) + "\n")
    done = run("table", "1", "a.png", "--display", "young.csv", "--json", "t.json", "--csv", "t.csv")
    content = json.loads((tmp_path / "t.json").read_text())
    validator("table").validate(content)
    assert {row["hours"] for row in content["rows"]} == {row["difference"] for row in content["rows"]} == {None}
    assert (tmp_path / "t.csv").read_text().splitlines()[1] == "a.png,chroma,3,max,,4500,"
    assert "–: not within 500 h." in words(done.out)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("2", "a.png"), "'2' is not '1'"),
        (("1",), "Missing argument 'IMAGE...'"),
        (("1", "gone.png"), "gone.png: there is no such image"),
        (("1", "a.png", "gone.png"), "gone.png: there is no such image"),
    ],
)
def test_bad_tables_are_refused(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    done = run("table", *arguments, "--csv", "t.csv")
    assert (done.code, written(tmp_path)) == (2, set())
    assert message in words(done.err)
