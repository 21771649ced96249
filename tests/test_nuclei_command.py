"""The command `lutgen nuclei`: page, files, pictures, exit codes, bad input."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.data import immunohistochemistry
from skimage.io import imread, imsave

from lutgen import DisplayModel, nuclei, read_measurements
from lutgen.cli.commands import nuclei as nuclei_command
from lutgen.display import default_display
from lutgen.pictures.conspicuity import LOSS
from lutgen.report.nuclei import (
    DETAIL,
    NUCLEUS,
    RING,
    ROWS,
    crowded,
    draw_contrast,
    headline,
    nuclei_page,
    outlined,
    percent,
    plot_nuclei,
    shown_hours,
)
from lutgen.report.parts import Headline
from tests.command import Done, in_process, replaces_by_force_alone, words

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.pictures.conspicuity import Conspicuity

pytestmark = pytest.mark.numbers


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run `lutgen nuclei` in this process, in a folder with a.png and its mask m.png."""
    monkeypatch.chdir(tmp_path)
    imsave(tmp_path / "a.png", np.asarray(immunohistochemistry())[180:308, 150:278], check_contrast=False)
    mask = np.zeros((128, 128), np.uint8)
    mask[20:30, 20:32], mask[60:70, 70:80] = 1, 2
    imsave(tmp_path / "m.png", mask, check_contrast=False)

    return in_process(monkeypatch, capsys, "nuclei")


@pytest.fixture(scope="module")
def analysis(tmp_path_factory: pytest.TempPathFactory) -> Conspicuity:
    file = tmp_path_factory.mktemp("found") / "slide.png"
    imsave(file, np.asarray(immunohistochemistry())[100:400], check_contrast=False)
    return nuclei(file, DisplayModel(read_measurements(default_display())), hours=range(0, 18_001, 3000))


def written(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file()} - {"a.png", "m.png"}


def test_the_default_repeated_for_quick_help_is_the_librarys() -> None:
    (default,) = (option.default for option in nuclei_command.command.params if option.name == "loss")
    assert default == LOSS


# Printed text ---------------------------------------------------------------------------------------------------------


def test_the_page_begins_with_the_finding_and_ends_with_where_it_comes_from(run: Callable[..., Done]) -> None:
    done = run("a.png", "--hours", "0,10000,18000")
    assert (done.code, done.err) == (0, "")
    same = nuclei("a.png", DisplayModel(read_measurements(default_display())), hours=(10_000, 18_000))
    lines = [words(line) for line in done.out.splitlines()]
    chroma, luma = same.contrasts["chroma"], same.contrasts["chroma-luma"]
    assert lines[0] == (
        f"Nuclei stand out by ΔE2000 {chroma.median[0]:.1f} (median of {same.nuclei.count}) when the display is new; "
        f"at 18 000 h by {chroma.median[-1]:.1f} in chroma ({percent(chroma.change[-1])}) and {luma.median[-1]:.1f} in "
        f"chroma-luma ({percent(luma.change[-1])})."
    )
    rows = [line for line in lines if line.startswith("chroma-luma 18 000")]
    assert len(rows) == 1
    assert f"{luma.median[-1]:.1f}" in rows[0]
    assert "no texture, no sharpness, no reader" in words(done.out)
    assert "found by haematoxylin (haematoxylin and DAB, by its colours)" in words(done.out)
    assert "RECONSTRUCTED" in done.out


def test_a_mask_of_two_nuclei_says_so_and_gives_no_intervals(run: Callable[..., Done]) -> None:
    out = words(run("a.png", "--mask", "m.png", "--hours", "0,9000", "--at", "ambient_lx=60").out)
    assert "2 nuclei, the labels of the mask m.png" in out
    assert "No intervals: too few nuclei" in out
    assert "Nothing in this model depends on ambient_lx." in out


@pytest.mark.parametrize(
    ("change", "expected"),
    [(-0.1416, "−14 %"), (0.0313, "+3.1 %"), (0.0, "±0 %"), (-0.0001, "±0 %"), (-0.0996, "−10 %"), (np.nan, "–")],
)
def test_changes_are_written_with_their_sign(change: float, expected: str) -> None:
    assert percent(change) == expected


def test_the_table_shows_first_and_last_hours() -> None:
    assert list(shown_hours(31)) == [0, 8, 15, 22, 30]
    assert list(shown_hours(2)) == [0, 1]
    assert list(shown_hours(1)) == [0]
    assert len(shown_hours(1000)) == ROWS


# Written files --------------------------------------------------------------------------------------------------------


def test_json_csv_and_pictures_say_the_same(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("a.png", "--hours", "0,18000", "--json", "n.json", "--csv", "n.csv", "--plots", "p")
    assert done.code == 0
    assert written(tmp_path) == {"n.json", "n.csv", "nuclei-a.png", "nuclei-a-outlines.png"}
    content: dict[str, Any] = json.loads((tmp_path / "n.json").read_text())
    rows = [line.split(",") for line in (tmp_path / "n.csv").read_text().splitlines()]
    assert len(rows) == content["nuclei"] + 1
    last = [float(row[rows[0].index("chroma_18000h")]) for row in rows[1:]]
    assert np.median(last) == pytest.approx(content["modes"]["chroma"][1]["median"], abs=1e-4)
    assert f"{np.median(last):.1f} in chroma" in words(done.out)
    assert imread(tmp_path / "p/nuclei-a.png").shape[1] == 1500
    assert imread(tmp_path / "p/nuclei-a-outlines.png").shape[:2] == (512, 512)


def test_labels_that_were_written_are_a_mask_with_the_same_nuclei(run: Callable[..., Done], tmp_path: Path) -> None:
    assert run("a.png", "--hours", "0,18000", "--labels", "l.png", "--csv", "one.csv").code == 0
    labels, rows = imread(tmp_path / "l.png"), (tmp_path / "one.csv").read_text().splitlines()[1:]
    assert labels.dtype == np.uint16
    assert np.bincount(labels.ravel())[1:].tolist() == [int(row.split(",")[3]) for row in rows]
    assert run("a.png", "--hours", "0,18000", "--mask", "l.png", "--csv", "two.csv").code == 0
    again = (tmp_path / "two.csv").read_text().splitlines()[1:]
    assert [row.split(",")[1:4] for row in again] == [row.split(",")[1:4] for row in rows]
    done = run("a.png", "--labels", "l.png")
    assert (done.code, "exists already" in done.err) == (2, True)
    assert "give a name that ends in .png" in run("a.png", "--labels", "l.jpg").err


def test_json_to_standard_output_is_alone(run: Callable[..., Done]) -> None:
    done = run("a.png", "--mask", "m.png", "--hours", "0,9000", "--json", "-", "--plots", "p")
    content = json.loads(done.out)
    assert (done.code, content["schema"], content["nuclei"]) == (0, 1, 2)
    assert content["modes"]["chroma"][0]["median_interval"] is None


@pytest.mark.parametrize("option", ["--json", "--csv", "--plots"])
def test_nothing_is_replaced_without_force(option: str, run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "p").mkdir()
    old = tmp_path / "p" / ("nuclei-a-outlines.png" if option == "--plots" else "n.out")
    where = "p" if option == "--plots" else str(old)
    replaces_by_force_alone(run, old, "a.png", "--hours", "0,9000", option, where)


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gone.png",), "gone.png: there is no such image. Check the name and the folder."),
        (("flat.png",), "flat.png: all pixels have one colour"),
        (("a.png", "--mask", "flat.png"), "flat.png: the mask has 8 × 8 pixels, the image a.png 128 × 128."),
        (("a.png", "--mask", "gone.png"), "gone.png: cannot read the mask: no such file or directory."),
        (("a.png", "--mask", "m.png", "--stain", "he"), "leave --stain out"),
        (("a.png", "--mask", "m.png", "--min-area", "5000"), "all 2 nuclei are smaller than 5000 pixels"),
        (("a.png", "--min-area", "100000"), "a.png: no nuclei were found:"),
        (("a.png", "--min-area", "-1"), "--min-area -1: give the pixels"),
        (("a.png", "--loss", "100"), "--loss 100: give the loss in per cent"),
        (("a.png", "--hours", "0..20000"), "hour 20000 is outside the measured span 0..18000 h"),
        (("a.png", "--display", "gone.csv"), "gone.csv"),
        (("a.png", "--json", "no/where/../"), "is a folder"),
        (("a.png", "--plots", "a.png"), "a.png: is a file. Give the name of a folder"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    imsave(tmp_path / "flat.png", np.full((8, 8, 3), 250, np.uint8), check_contrast=False)
    (tmp_path / "no/where").mkdir(parents=True)
    done = run(*arguments, "--csv", "n.csv")
    assert (done.code, done.out) == (2, "")
    assert words(message) in words(done.err)
    assert done.err.startswith("lutgen: error: ")
    assert written(tmp_path) == {"flat.png"}


# The pictures ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_pictures_are_the_same_bytes_again(analysis: Conspicuity, tmp_path: Path) -> None:
    first, second = ([path.read_bytes() for path in plot_nuclei(analysis, tmp_path / name)] for name in ("x", "y"))
    assert first == second


def test_the_plot_shows_the_median_and_the_bands(analysis: Conspicuity) -> None:
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    draw_contrast(axes, analysis, "chroma-luma")
    contrast = analysis.contrasts["chroma-luma"]
    lines: dict[str, Any] = {str(line.get_label()): line for line in axes.lines}
    np.testing.assert_allclose(lines["median"].get_ydata(), contrast.median)
    assert lines["un-aged median"].get_ydata()[0] == pytest.approx(np.median(contrast.unaged))
    heights: list[Any] = [np.asarray(band.get_paths()[0].vertices)[:, 1] for band in axes.collections]
    assert [each.min() for each in heights] == [contrast.percentiles[:, 0].min(), contrast.percentiles[:, 1].min()]
    assert [each.max() for each in heights] == [contrast.percentiles[:, 4].max(), contrast.percentiles[:, 3].max()]


def test_outlines_lie_on_the_edges_of_nuclei_and_rings_and_nowhere_else(analysis: Conspicuity) -> None:
    picture = outlined(analysis, (0, 300), (0, 512))
    assert picture.shape == (900, 1536, 3)
    green = (picture == NUCLEUS).all(axis=2)
    large = analysis.nuclei.labels.repeat(3, axis=0).repeat(3, axis=1)
    assert green.any()
    assert (large[green] > 0).all()
    black = (picture == RING).all(axis=2)
    assert np.count_nonzero(black & (analysis.rings.labels.repeat(3, axis=0).repeat(3, axis=1) > 0)) > 1000
    changed = (picture != analysis.field.rgb().repeat(3, axis=0).repeat(3, axis=1)).any(axis=2)
    assert not (changed & ~green & ~black).any()


def test_the_page_shows_where_most_nuclei_are(analysis: Conspicuity) -> None:
    (top, bottom), (left, right) = crowded(analysis)
    assert (bottom - top, right - left) == (DETAIL, DETAIL)
    nuclear = analysis.nuclei.labels > 0
    inside = nuclear[top:bottom, left:right].mean()
    others = [nuclear[y : y + DETAIL, x : x + DETAIL].mean() for y in range(0, 150, 7) for x in range(0, 362, 7)]
    assert inside >= max(others) - 1e-6


def test_the_headline_and_the_page_agree(analysis: Conspicuity) -> None:
    first, *_ = nuclei_page(analysis)
    assert first == Headline(headline(analysis))
