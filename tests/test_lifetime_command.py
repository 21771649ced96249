"""The command `lutgen lifetime`: page, files, pictures, exit codes, bad input."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.data import immunohistochemistry
from skimage.io import imread, imsave

from lutgen import DisplayModel, lifetime, read_measurements
from lutgen.cli.commands import lifetime as lifetime_command
from lutgen.display import default_display
from lutgen.numerals import pixels_of_colours
from lutgen.pictures.lifetime import TOLERANCES
from lutgen.report.lifetimes import draw_curve, draw_lives, hours_or_never, lifetime_page, plot_lifetimes, title_of
from tests.command import Done, in_process, replaces_by_force_alone, words

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.pictures.lifetime import Lifetimes

pytestmark = pytest.mark.numbers

#: An effect with a standard error, on the default display.
MODEL = """\
schema = 1
[model]
selection = "continuous"
[[effects]]
name = "black-level"
origin = "built-in"
[effects.parameters]
"""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run `lutgen lifetime` in this process, in a folder with a.png and b.png."""
    monkeypatch.chdir(tmp_path)
    tissue = np.asarray(immunohistochemistry())
    for name, corner in (("a.png", 200), ("b.png", 300)):
        imsave(tmp_path / name, tissue[corner : corner + 48, corner : corner + 48], check_contrast=False)

    return in_process(monkeypatch, capsys, "lifetime")


@pytest.fixture(scope="module")
def lifetimes(tmp_path_factory: pytest.TempPathFactory) -> Lifetimes:
    file = tmp_path_factory.mktemp("found") / "slide.png"
    imsave(file, np.asarray(immunohistochemistry())[::8, ::8], check_contrast=False)
    model = DisplayModel(read_measurements(default_display()))
    return lifetime([file], model, tolerances=(3, 5, 40), hours=range(0, 18_001, 3000))


def written(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file()} - {"a.png", "b.png"}


def test_names_repeated_for_quick_help_are_the_librarys() -> None:
    (default,) = (option.default for option in lifetime_command.command.params if option.name == "tolerance")
    assert tuple(map(float, str(default).split(","))) == TOLERANCES


# Printed text ---------------------------------------------------------------------------------------------------------


def test_the_page_is_table_1(run: Callable[..., Done]) -> None:
    done = run("a.png")
    assert (done.code, done.err) == (0, "")
    (image,) = lifetime(["a.png"], DisplayModel(read_measurements(default_display()))).images
    lines = [words(line) for line in done.out.splitlines()]
    assert lines.pop(0) == "Luminance of chroma-luma: the paper's law, 67 % at 10 000 h and 40 % at 18 000 h."
    assert lines[0] == f"a.png: 2 304 pixels of {hours_or_never(image.colours)} colours.".replace("\xa0", " ")
    assert lines[1] == "hours until Max ΔE2000 3 Avg ΔE2000 3 Max ΔE2000 5 Avg ΔE2000 5"
    for line, mode in zip(lines[2:4], ("chroma", "chroma-luma"), strict=True):
        curve = image.curves[mode]
        lives = [curve.hours_until(name, each) for each in (3, 5) for name in ("max", "mean")]
        assert line == words(" ".join([mode, *map(hours_or_never, lives)]))
    assert "RECONSTRUCTED" in done.out


def test_what_is_never_reached_is_a_dash_that_is_explained(run: Callable[..., Done]) -> None:
    out = words(run("a.png", "--tolerance", "70", "--hours", "0..6000").out)
    assert "chroma – – chroma-luma – –" in out
    assert "–: not within the 6 000 h looked at." in out
    assert "not within" not in words(run("a.png", "--tolerance", "0.5").out)


def test_tissue_says_its_threshold(run: Callable[..., Done], tmp_path: Path) -> None:
    picture = imread(tmp_path / "a.png") // 2
    imsave(tmp_path / "c.png", np.concatenate([picture, np.full_like(picture, 240)]), check_contrast=False)
    out = words(run("c.png", "--tissue", "--hours", "0,9000").out)
    assert re.search(r"c\.png: 2 304 pixels of .*; 50\.0 % left out as bare glass, L\* of \d\d\.\d and more\.", out)
    stained = np.tile(np.array([[[225, 150, 190]], [[90, 50, 130]]], np.uint8), (8, 16, 1))
    imsave(tmp_path / "d.png", stained, check_contrast=False)
    assert "no bare glass was found, nothing was left out." in words(run("d.png", "--tissue", "--hours", "0,9000").out)


@pytest.mark.slow
def test_a_model_with_standard_errors_gets_intervals_and_says_how_it_is_seen(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    rest = {"new": 0.002, "grown": 0.0, "power": 1.0, "saturation": 0.0, "tint_x": 0.0, "tint_z": 0.0}
    lines = [f"{name} = {{ value = {value} }}" for name, value in rest.items()]
    lines[0] = "new = { value = 0.002, stderr = 0.0005, free = true }"
    (tmp_path / "m.toml").write_text(MODEL + "\n".join(lines) + "\n")
    done = run("a.png", "--model", "m.toml", "--hours", "0..18000:6000", "--at", "ambient_lx=60", "--plots", "p")
    assert (done.code, done.err) == (0, "")
    lives = r"chroma (\d+) (\d{3}) (\d+) (\d{3}).* \1 \d{3} to \1 \d{3} \3 \d{3} to \3 \d{3}"
    assert re.search(lives, words(done.out)), done.out
    assert "Below: 95 % intervals" in words(done.out)
    assert "Nothing in this model depends on ambient_lx." in words(done.out)
    assert written(tmp_path) == {"m.toml", "lifetime-a.png"}


# Written files --------------------------------------------------------------------------------------------------------


def test_json_csv_and_pictures_say_the_same(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("a.png", "b.png", "--hours", "0..18000:3000", "--json", "l.json", "--csv", "l.csv", "--plots", "p")
    assert done.code == 0
    assert written(tmp_path) == {"l.json", "l.csv", "lifetime-a.png", "lifetime-b.png"}
    content: dict[str, Any] = json.loads((tmp_path / "l.json").read_text())
    rows = [line.split(",") for line in (tmp_path / "l.csv").read_text().splitlines()]
    assert [row[:2] for row in rows[1:]] == [
        [image["file"], mode] for image in content["images"] for mode in ("chroma", "chroma-luma")
    ]
    first = content["images"][0]["modes"]["chroma"]["lifetimes"]["3"]
    assert float(rows[1][rows[0].index("max_3")]) == pytest.approx(first["max"], abs=0.05)
    assert words(hours_or_never(first["max"])) in words(done.out)
    assert imread(tmp_path / "p/lifetime-a.png").shape[1] == 1500


def test_json_to_standard_output_is_alone(run: Callable[..., Done]) -> None:
    done = run("a.png", "--hours", "0,9000", "--json", "-", "--plots", "p")
    content = json.loads(done.out)
    assert (done.code, content["schema"], content["images"][0]["file"]) == (0, 1, "a.png")


@pytest.mark.parametrize("option", ["--json", "--csv", "--plots"])
def test_nothing_is_replaced_without_force(option: str, run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "p").mkdir()
    old = tmp_path / "p" / ("lifetime-a.png" if option == "--plots" else "l.out")
    where = "p" if option == "--plots" else str(old)
    replaces_by_force_alone(run, old, "a.png", "--hours", "0,9000", option, where)


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("a.png", "--tolerance", "3,-1"), "tolerance -1: a tolerated ΔE2000 is a finite number above 0"),
        (("a.png", "--tolerance", "three"), "--tolerance three: give numbers in a list, such as 3,5."),
        (("a.png", "--tolerance", "3,,5"), "--tolerance 3,,5: give numbers"),
        (("a.png", "--tolerance", "inf"), "tolerance inf:"),
        (("a.png", "--hours", "0..20000"), "hour 20000 is outside the measured span 0..18000 h"),
        (("a.png", "--hours", "soon"), "is not a number of hours"),
        (("gone.png",), "gone.png: there is no such image"),
        (("a.png", "--display", "gone.csv"), "gone.csv"),
        (("a.png", "--at", "moon=1"), "unknown condition 'moon'"),
        (("a.png", "--json", "no/where/../"), "is a folder"),
        (("white.png", "--tissue"), "white.png: no tissue was found"),
        (("a.png", "sub/a.png", "--plots", "p"), "lifetime-a.png: two images would be drawn into this file"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    imsave(tmp_path / "white.png", np.full((8, 8, 3), 250, np.uint8), check_contrast=False)
    (tmp_path / "no/where").mkdir(parents=True)
    done = run(*arguments, "--csv", "l.csv")
    assert (done.code, done.out) == (2, "")
    assert words(message) in words(done.err)
    assert done.err.startswith("lutgen: error: ")
    assert written(tmp_path) == {"white.png"}


def test_one_broken_image_stops_all(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "b.png").write_bytes((tmp_path / "b.png").read_bytes()[:500])
    done = run("a.png", "b.png", "--hours", "0,9000", "--json", "l.json")
    assert (done.code, written(tmp_path)) == (2, set())
    assert "b.png: the image is truncated or damaged" in done.err


# The picture ----------------------------------------------------------------------------------------------------------


def test_the_picture_is_the_same_bytes_again(lifetimes: Lifetimes, tmp_path: Path) -> None:
    first, second = (plot_lifetimes(lifetimes, tmp_path / name)[0].read_bytes() for name in ("x", "y"))
    assert first == second


def test_the_picture_shows_mean_bars_tolerances_and_crossings(lifetimes: Lifetimes) -> None:
    from matplotlib.figure import Figure

    (image,) = lifetimes.images
    curve = image.curves["chroma"]
    axes = Figure().add_subplot()
    draw_curve(axes, curve, lifetimes.tolerances, 15.0)
    bars = next(each for each in axes.containers if each.get_label() == "mean ± 2 SD")
    np.testing.assert_allclose(bars[0].get_ydata(), curve.mean)
    tops = [float(segment[1][1]) for segment in bars[2][0].get_segments()]
    np.testing.assert_allclose(tops, curve.max)
    # The tolerance of 40 is above the drawn range.
    level: list[Any] = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert [float(line.get_ydata()[0]) for line in level] == [3.0, 5.0]
    marks: list[Any] = [line for line in axes.lines if line.get_markersize() == 9]
    rings = {(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in marks}
    expected = {(curve.hours_until(name, each), each) for each in (3.0, 5.0) for name in ("mean", "max")}
    assert rings == {place for place in expected if place[0] is not None}


def test_the_bars_below_are_table_1(lifetimes: Lifetimes) -> None:
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    draw_lives(axes, lifetimes, lifetimes.images[0], "chroma-luma")
    bar_texts = [words(text.get_text()) for text in axes.texts]
    curve = lifetimes.images[0].curves["chroma-luma"]
    lives = [curve.hours_until(name, each) for each in (3, 5) for name in ("max", "mean")]
    assert bar_texts == [words(f"{hours_or_never(life)} h") for life in lives] + ["not within 18 000 h"] * 2


def test_the_title_is_the_finding_and_the_page_names_what_is_never_reached(lifetimes: Lifetimes) -> None:
    title = words(title_of(lifetimes, lifetimes.images[0]))
    life = lifetimes.images[0].curves["chroma"].hours_until("mean", 3.0)
    assert title.startswith(words(f"The mean ΔE2000 reaches 3: chroma at {hours_or_never(life)} h"))
    sentences = [part for part in lifetime_page(lifetimes) if isinstance(part, str)]
    assert any("not within" in sentence for sentence in sentences)


def test_one_pixel_is_counted_in_the_singular() -> None:
    assert pixels_of_colours(1, 1) == "1 pixel of 1 colour"
    assert pixels_of_colours(255_792, 1).replace("\xa0", " ") == "255 792 pixels of 1 colour"


def test_hours_a_day_give_months_of_use(run: Callable[..., Done]) -> None:
    plain, daily = run("a.png"), run("a.png", "--hours-per-day", "10")
    table = run("a.png", "--json", "-", "--hours-per-day", "10")
    lives = json.loads(table.out)["images"][0]["modes"]["chroma-luma"]["lifetimes"][f"{min(TOLERANCES):g}"]
    assert f"{lives['mean'] / (10 * 365.25 / 12):.1f} months" in daily.out
    assert "Months: of 30.4 days with 10 h each." in daily.out
    assert "months" not in plain.out
    refused = run("a.png", "--hours-per-day", "25")
    assert refused.code == 2
    assert "0<x<=24" in refused.err
