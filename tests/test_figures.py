"""`lutgen figure`, `sheet` and `animate`: layouts, unscaled pixels, and frames as Pillow and ffmpeg read them."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import DisplayModel, LutgenError, apply_to_image, default_display, lifetime
from lutgen.cli.commands import animate as animate_command
from lutgen.colorimetry import code_to_linear, linear_to_code
from lutgen.pictures.frame import GREY, aged_series
from lutgen.report import difference_map, sheets
from lutgen.report.animation import LONGEST, SECONDS, animate, frame
from lutgen.report.lifetimes import plot_lifetime
from lutgen.report.sheets import COLUMNS, Layout, check_hours, draw_figure, longest
from tests.command import Done, replaces_by_force_alone
from tests.quick import mostly_slow

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.numbers

DISPLAY = Path(__file__).parents[1] / "configs" / "displays" / "reconstructed-ccfl.csv"

AGES = (("chroma", 10_000.0), ("chroma", 18_000.0), ("chroma-luma", 10_000.0), ("chroma-luma", 18_000.0))


@pytest.fixture
def run(run: Callable[..., Done], tmp_path: Path) -> Callable[..., Done]:
    """Run `lutgen` in this process, in a folder with a.png."""
    tissue = np.asarray(immunohistochemistry())[200:261, 200:273]
    imsave(tmp_path / "a.png", tissue, check_contrast=False)
    return run


def written(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file()} - {"a.png"}


def pixels(path: Path) -> Any:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def applied(folder: Path, model: DisplayModel, mode: str, hours: float) -> Any:
    """The image aged by `lutgen apply`."""
    out = folder / f"applied-{mode}-{hours:g}.png"
    if not out.is_file():
        apply_to_image(folder / "a.png", out, model.at(mode, hours))
    return pixels(out)


def places(page: Any, picture: Any) -> list[tuple[int, int]]:
    """Row and column of every place where a page contains a picture, to the last bit."""
    high, wide = picture.shape[:2]
    corners = (page == picture[0, 0]).all(axis=2)
    corners &= np.roll((page == picture[-1, -1]).all(axis=2), (1 - high, 1 - wide), axis=(0, 1))
    return [
        (int(row), int(column))
        for row, column in np.argwhere(corners)
        if np.array_equal(page[row : row + high, column : column + wide], picture)
    ]


def test_the_defaults_repeated_for_quick_help_are_the_librarys() -> None:
    assert (animate_command.SECONDS, animate_command.SIZE) == (SECONDS, LONGEST)


# One image at several ages --------------------------------------------------------------------------------------------


def test_a_small_image_is_seen_as_apply_writes_it(
    run: Callable[..., Done], tmp_path: Path, model: DisplayModel
) -> None:
    assert run("--version").code == 0
    series = aged_series(tmp_path / "a.png", model, ("chroma", "chroma-luma"), (10_000.0, 18_000.0))
    assert series.factor == 1
    np.testing.assert_array_equal(series.seen("stable", 0.0), pixels(tmp_path / "a.png"))
    for mode, hours in AGES:
        np.testing.assert_array_equal(series.seen(mode, hours), applied(tmp_path, model, mode, hours))


def test_a_large_image_is_made_smaller_by_means_of_light_and_aged_then(tmp_path: Path, model: DisplayModel) -> None:
    tissue = np.asarray(immunohistochemistry())[:90, :120]
    alpha = np.full((90, 120, 1), 255, np.uint8)
    alpha[:3, :3] = 0
    imsave(tmp_path / "a.png", np.concatenate([tissue, alpha], axis=2), check_contrast=False)
    series = aged_series(tmp_path / "a.png", model, ["chroma"], [9000.0], longest=40)
    light = code_to_linear(tissue / 255.0).reshape(30, 3, 40, 3, 3).mean(axis=(1, 3))
    expected = np.rint(255.0 * linear_to_code(light)).astype(np.uint8)
    expected[0, 0] = GREY
    assert series.factor == 3
    np.testing.assert_array_equal(series.frame.code, expected)
    code = np.clip(model.at("chroma", 9000.0).code_to_code(expected / 255.0), 0.0, 1.0)
    np.testing.assert_array_equal(series.seen("chroma", 9000.0), np.rint(255.0 * code))
    curve = lifetime([tmp_path / "a.png"], model, hours=[9000.0]).images[0].curves["chroma"]
    assert series.mean_in_words("chroma", 9000.0) == f"mean ΔE2000 {curve.mean[-1]:.1f}"


# lutgen figure --------------------------------------------------------------------------------------------------------


def test_the_published_captions_are_the_papers() -> None:
    assert sheets.AGES == AGES
    assert difference_map.MAPS == (("chroma", 8100.0), ("chroma-luma", 4100.0))
    assert difference_map.MAP_RANGE == (1.0, 8.0)


@pytest.mark.parametrize("number", mostly_slow(["2", "3", "4"], "2"))
def test_figures_2_to_4_lie_as_the_captions_say(
    number: str, run: Callable[..., Done], tmp_path: Path, model: DisplayModel
) -> None:
    done = run("figure", number, "a.png", "-o", "f.png")
    assert (done.code, done.out) == (0, "f.png\n")
    page, layout = pixels(tmp_path / "f.png"), Layout(61, 73)
    assert places(page, pixels(tmp_path / "a.png")) == [layout.corner("centre")]
    for place, age in zip(("top", "right", "bottom", "left"), AGES, strict=True):
        assert places(page, applied(tmp_path, model, *age)) == [layout.corner(place)], place


def test_figure_5_is_the_plot_of_lifetime(run: Callable[..., Done], tmp_path: Path, model: DisplayModel) -> None:
    assert run("figure", "5", "a.png", "-o", "f.png").code == 0
    lifetimes = lifetime(["a.png"], model)
    plot_lifetime(lifetimes, lifetimes.images[0], tmp_path / "p.png")
    assert (tmp_path / "f.png").read_bytes() == (tmp_path / "p.png").read_bytes()


def test_figure_6_holds_two_maps_on_the_papers_scale(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[tuple[str, float, tuple[float, float]]] = []
    real = difference_map.draw_map

    def spy(axes: Any, drawn_map: Any, ends: tuple[float, float]) -> Any:
        drawn.append((drawn_map.mode, axes.get_position().y0, ends))
        return real(axes, drawn_map, ends)

    monkeypatch.setattr(difference_map, "draw_map", spy)
    assert run("figure", "6", "a.png", "-o", "f.png").code == 0
    assert pixels(tmp_path / "f.png").shape[1] == 1500
    assert [mode for mode, _, _ in sorted(drawn, key=lambda each: -each[1])] == ["chroma", "chroma-luma"]
    assert {ends for *_, ends in drawn} == {(1.0, 8.0)}


@pytest.mark.slow
@pytest.mark.parametrize("number", ["2", "6"])
def test_a_figure_has_the_same_bytes_again(
    number: str, run: Callable[..., Done], tmp_path: Path, model: DisplayModel
) -> None:
    assert run("figure", number, "a.png", "-o", "f.png").code == 0
    draw_figure(number, "a.png", model, tmp_path / "g.png")
    assert (tmp_path / "f.png").read_bytes() == (tmp_path / "g.png").read_bytes()


# lutgen sheet ---------------------------------------------------------------------------------------------------------


def test_a_sheet_has_a_row_a_mode_and_a_column_an_hour(
    run: Callable[..., Done], tmp_path: Path, model: DisplayModel
) -> None:
    assert run("sheet", "a.png", "--hours", "5000,10000,18000", "-o", "s.png").code == 0
    page = pixels(tmp_path / "s.png")
    at = {
        (mode, hours): places(page, applied(tmp_path, model, mode, hours))
        for mode in ("chroma", "chroma-luma")
        for hours in (5000.0, 10_000.0, 18_000.0)
    }
    assert {len(spots) for spots in at.values()} == {1}
    rows = {mode: {spots[0][0] for (each, _), spots in at.items() if each == mode} for mode, _ in at}
    columns = [{spots[0][1] for (_, hour), spots in at.items() if hour == hours} for hours in (5000.0, 1e4, 1.8e4)]
    assert all(len(each) == 1 for each in (*rows.values(), *columns))
    assert max(rows["chroma"]) + 61 < min(rows["chroma-luma"])
    assert max(columns[0]) + 73 < min(columns[1]) < max(columns[1]) + 73 < min(columns[2])


def test_a_sheet_of_one_mode_and_many_hours_is_made_to_fit(run: Callable[..., Done], tmp_path: Path) -> None:
    assert run("sheet", "a.png", "--mode", "chroma", "--hours", "0..18000:1000", "-o", "s.png").code == 0
    assert pixels(tmp_path / "s.png").shape[1] > 19 * 160
    assert [longest(columns) for columns in (1, 4, 20)] == [1000, 900, 180]
    with pytest.raises(LutgenError, match=f"21 hours are more than the {COLUMNS} columns of a sheet"):
        check_hours(range(21))


def test_hours_that_nobody_chooses_are_those_of_the_display(run: Callable[..., Done], tmp_path: Path) -> None:
    """The default hours of a display measured to 12 000 h end at 12 000 h in build, sheet and animation."""
    rows = DISPLAY.read_text().splitlines()
    kept = [row for row in rows if not row[0].isdigit() or float(row.split(",")[0]) in (0, 4000, 8000, 12_400)]
    (tmp_path / "d.csv").write_text("\n".join(kept) + "\n")
    display = ("--display", "d.csv")
    assert run("build", *display, "--mode", "chroma", "--format", "cube", "-o", "built").code == 0
    assert {path.name for path in (tmp_path / "built/chroma").iterdir()} == {"0h", "4000h", "8000h", "12400h"}
    assert run("animate", "a.png", *display, "--mode", "chroma", "-o", "a.apng").code == 0
    with Image.open(tmp_path / "a.apng", formats=["PNG"]) as animation:
        assert animation.n_frames == 4  # type: ignore[attr-defined]
    for arguments, output in (((), "chosen.png"), (("--hours", "0,4000,8000,12400"), "given.png")):
        assert run("sheet", "a.png", *display, *arguments, "-o", output).code == 0
    assert (tmp_path / "chosen.png").read_bytes() == (tmp_path / "given.png").read_bytes()


# lutgen animate -------------------------------------------------------------------------------------------------------


def test_every_frame_is_the_image_at_its_hour(run: Callable[..., Done], tmp_path: Path, model: DisplayModel) -> None:
    hours = "0..18000:3000"
    done = run("animate", "a.png", "--mode", "chroma", "--hours", hours, "--seconds", "3.5", "-o", "a.apng")
    assert (done.code, done.err) == (0, "")
    with Image.open(tmp_path / "a.apng", formats=["PNG"]) as animation:
        assert (animation.n_frames, animation.info["loop"]) == (7, 0)  # type: ignore[attr-defined]
        corners, captions = set(), set()
        for number in range(7):
            animation.seek(number)
            assert animation.info["duration"] == 500.0
            page = np.asarray(animation.convert("RGB"))
            corners.update(places(page, applied(tmp_path, model, "chroma", 3000.0 * number)))
            captions.add(page[:42].tobytes())
    assert len(corners) == 1
    assert len(captions) == 7, "each frame says its hour"


def test_frames_survive_the_writer_to_the_last_bit(
    run: Callable[..., Done], tmp_path: Path, model: DisplayModel
) -> None:
    assert run("--version").code == 0
    noise = np.random.default_rng(4).integers(0, 256, (40, 30, 3), dtype=np.uint8)
    imsave(tmp_path / "n.png", noise, check_contrast=False)
    series = aged_series(tmp_path / "n.png", model, ["chroma-luma"], [0.0, 9000.0, 18_000.0])
    for name in ("x.png", "y.png"):
        animate(series, "chroma-luma", series.hours, tmp_path / name)
    assert (tmp_path / "x.png").read_bytes() == (tmp_path / "y.png").read_bytes()
    with Image.open(tmp_path / "x.png") as animation:
        for number, hour in enumerate(series.hours):
            animation.seek(number)
            np.testing.assert_array_equal(np.asarray(animation.convert("RGB")), frame(series, "chroma-luma", hour))


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed (Debian: ffmpeg)")
def test_mp4_holds_the_frames_in_their_colours(run: Callable[..., Done], tmp_path: Path, model: DisplayModel) -> None:
    done = run("animate", "a.png", "--mode", "chroma-luma", "--hours", "0,9000,18000", "--seconds", "3", "-o", "a.mp4")
    assert (done.code, done.err) == (0, "")
    asked = "stream=width,height,nb_read_frames,duration"
    probe = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", asked, "-of", "default=nk=1:nw=1", "a.mp4"]
    output = subprocess.run(probe, cwd=tmp_path, check=True, capture_output=True, text=True, timeout=60).stdout.split()
    series = aged_series(tmp_path / "a.png", model, ["chroma-luma"], [0.0, 9000.0, 18_000.0])
    expected = frame(series, "chroma-luma", 18_000.0)
    high, wide = (size + size % 2 for size in expected.shape[:2])
    assert (int(output[0]), int(output[1]), float(output[2]), int(output[3])) == (wide, high, 3.0, 3)
    take = ["ffmpeg", "-v", "error", "-i", "a.mp4", "-vf", "select=eq(n\\,2),scale=in_color_matrix=bt709", "last.png"]
    subprocess.run(take, cwd=tmp_path, check=True, capture_output=True, timeout=60)
    last = pixels(tmp_path / "last.png")[: expected.shape[0], : expected.shape[1]]
    assert np.abs(last.astype(float) - expected).mean() < 4.0
    assert np.abs(last.mean(axis=(0, 1)) - expected.mean(axis=(0, 1))).max() < 1.5


def test_mp4_without_ffmpeg_says_what_goes_without(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = run("animate", "a.png", "--mode", "chroma", "-o", "a.mp4")
    assert (done.code, written(tmp_path)) == (2, set())
    assert "MP4 is written by the program ffmpeg, which is not on the PATH. Install it" in done.err
    assert run("animate", "a.png", "--mode", "chroma", "--hours", "0,9000", "-o", "b.png").code == 0


def test_an_ffmpeg_that_fails_is_quoted_and_leaves_nothing(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'no encoder here' >&2\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
    done = run("animate", "a.png", "--mode", "chroma", "--hours", "0,9000", "-o", "a.mp4")
    assert (done.code, written(tmp_path)) == (2, {"ffmpeg"})
    assert "a.mp4: ffmpeg cannot write it: no encoder here. Write an animated PNG" in done.err


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("figure", "7", "a.png", "-o", "f.png"), "'7' is not one of '2', '3', '4', '5', '6'"),
        (("figure", "2", "-o", "f.png"), "Missing argument 'IMAGE'"),
        (("figure", "2", "gone.png", "-o", "f.png"), "gone.png: there is no such image"),
        (("figure", "2", "a.png", "-o", "f.jpg"), "f.jpg: give a name that ends in .png."),
        (("figure", "6", "a.png", "-o", "a.png", "--force"), "a.png: is an input of this command"),
        (("figure", "2", "a.png", "-o", "f.png", "--display", "young.csv"), "outside the measured span"),
        (("sheet", "a.png", "--mode", "stable", "-o", "s.png"), "'stable' is not one of"),
        (("sheet", "a.png", "--hours", "0,20000", "-o", "s.png"), "hour 20000 is outside the measured span"),
        (("sheet", "a.png", "--hours", "0..18000", "-o", "s.png"), "31 hours are more than the 20 columns"),
        (("sheet", "gone.png", "-o", "s.png"), "gone.png: there is no such image"),
        (("sheet", "a.png", "-o", "s.tif"), "s.tif: give a name that ends in .png."),
        (("animate", "a.png", "--mode", "stable", "-o", "x.png"), "'stable' is not one of"),
        (("animate", "a.png", "--mode", "chroma", "-o", "x.gif"), "x.gif: give a name that ends in .png, .apng"),
        (("animate", "a.png", "--mode", "chroma", "--hours", "9000", "-o", "x.png"), "needs at least 2 hours, not 1"),
        (("animate", "a.png", "--mode", "chroma", "--hours", "0..19000", "-o", "x.png"), "outside the measured span"),
        (("animate", "a.png", "--mode", "chroma", "--seconds", "0", "-o", "x.png"), "0 seconds for 31 frames"),
        (("animate", "a.png", "--mode", "chroma", "--seconds", "nan", "-o", "x.png"), "'nan' is not a finite number"),
        (("animate", "a.png", "--mode", "chroma", "--size", "0", "-o", "x.png"), "a longest side of 0 pixels"),
        (("animate", "gone.png", "--mode", "chroma", "-o", "x.png"), "gone.png: there is no such image"),
    ],
)  # fmt: skip
def test_bad_input_is_named_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    lines = default_display().read_text().splitlines()
    young = [line for line in lines if not line[:1].isdigit() or line.split(",")[0] in ("0", "500")]
    (tmp_path / "young.csv").write_text("\n".join(young) + "\n")
    before = (tmp_path / "a.png").read_bytes()
    done = run(*arguments)
    assert (done.code, done.out, written(tmp_path)) == (2, "", {"young.csv"})
    assert message in " ".join(done.err.split())
    assert (tmp_path / "a.png").read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [("figure", "2", "a.png"), ("sheet", "a.png"), ("animate", "a.png", "--mode", "chroma", "--hours", "0,9000")],
)
def test_nothing_is_replaced_without_force(
    arguments: tuple[str, ...], run: Callable[..., Done], tmp_path: Path
) -> None:
    replaces_by_force_alone(run, tmp_path / "x.png", *arguments, "-o", "x.png")
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
