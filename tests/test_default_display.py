"""The default display gives Table 1 of the paper on a named slide, and its drift is the drift of the fit."""

from __future__ import annotations

import hashlib
import os
from dataclasses import astuple
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image
from skimage.data import immunohistochemistry
from skimage.io import imsave

from configs.displays import table1
from configs.displays.reconstruct_ccfl import REACHED, Drift
from configs.displays.table1 import Colours, Curve
from lutgen import lifetime
from lutgen.display import DisplayModel, default_display
from tests.twin import Twin, rows_of_csv

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.pictures.lifetime import ImageLifetime

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).parent.parent

# The paper's printed order: hours until Max 3, average 3, Max 5, average 5.
PAPER = {"chroma": (4500, 7800, 8100, 11100), "chroma-luma": (2200, 3700, 4100, 5800)}
GATES = {"chroma": 0.05, "chroma-luma": 0.10}


@pytest.fixture(scope="module")
def pixels() -> NDArray[np.uint8]:
    return table1.slide()


@pytest.fixture(scope="module")
def whole(pixels: NDArray[np.uint8]) -> Colours:
    return Colours.of(pixels)


@pytest.fixture(scope="module")
def lifetimes(model: DisplayModel, whole: Colours) -> dict[str, tuple[float, ...]]:
    curve = Curve(model, whole)
    return {mode: curve.lifetimes(mode) for mode in PAPER}


@pytest.mark.slow
@pytest.mark.parametrize("mode", PAPER)
def test_the_lifetimes_on_the_named_slide_are_those_of_table_1(
    lifetimes: dict[str, tuple[float, ...]], mode: str
) -> None:
    np.testing.assert_allclose(lifetimes[mode], PAPER[mode], rtol=GATES[mode])


@pytest.mark.slow
def test_what_is_reached_is_what_is_found(lifetimes: dict[str, tuple[float, ...]]) -> None:
    assert {mode: tuple(round(hour) for hour in hours) for mode, hours in lifetimes.items()} == REACHED


def test_the_file_says_how_near_it_comes() -> None:
    first, *others = default_display().read_text(encoding="ascii").splitlines()
    for mode, hours in REACHED.items():
        hours_text = " / ".join(f"{hour:.0f}" for hour in hours)
        printed = " / ".join(str(hour) for hour in PAPER[mode])
        assert f"# lifetimes {mode}: {hours_text} (paper {printed})" in others
    chroma, luma = (100 * np.abs(np.array(REACHED[mode]) / PAPER[mode] - 1).max() for mode in ("chroma", "chroma-luma"))
    before, _, after = first.partition("chroma lifetimes within ")
    assert "CMU-1-Small-Region" in before
    assert float(after.split(" %")[0]) == pytest.approx(chroma, abs=0.11)
    assert float(after.split("within ")[1].split(" %")[0]) == pytest.approx(luma, abs=0.11)


@pytest.mark.slow
@pytest.mark.rare(instead="test_the_lifetimes_on_the_named_slide_are_those_of_table_1")
@pytest.mark.numbers  # both builds read the same pixels, which the lifetimes above check
def test_the_drift_is_what_the_fit_gives(whole: Colours) -> None:
    drift = table1.fit(whole)
    assert table1.rounded(drift) == Drift()


def test_the_slide_is_the_same_through_pillow(pixels: NDArray[np.uint8]) -> None:
    assert pixels.shape == (2967, 2220, 3)
    with Image.open(table1.SLIDE) as image:
        assert hashlib.sha256(image.convert("RGB").tobytes()).hexdigest() == table1.SLIDE_SHA256


@pytest.mark.parametrize(("mode", "hours"), [("chroma", 8100.0), ("chroma", 15_000.0), ("chroma-luma", 4100.0)])
def test_mean_and_sd_are_those_over_pixels_by_the_papers_steps_and_colour_science(
    model: DisplayModel, mode: str, hours: float
) -> None:
    import colour

    some = immunohistochemistry()[::16, ::16]
    twin = Twin(rows_of_csv(default_display().read_text(encoding="utf-8")), mode=mode, hours=hours)
    code = some.reshape(-1, 3) / 255.0
    aged = np.array([twin.code((r, g, b)) for r, g, b in code.tolist()])
    d65 = np.array([0.3127, 0.3290])
    unaged_lab, aged_lab = (
        colour.XYZ_to_Lab(colour.RGB_to_XYZ(each, srgb_of_the_paper(), d65, None, apply_cctf_decoding=True), d65)
        for each in (code, aged)
    )
    difference = colour.delta_E(unaged_lab, aged_lab, method="CIE 2000")
    assert difference.mean() > 1
    statistics = Curve(model, Colours.of(some)).at(mode, hours)
    np.testing.assert_allclose(statistics, (difference.mean(), difference.std()), rtol=0, atol=1e-6)


def srgb_of_the_paper() -> Any:
    """colour-science's sRGB with a computed matrix, not the matrix of four digits."""
    import colour

    srgb = colour.RGB_COLOURSPACES["sRGB"].copy()
    srgb.use_derived_transformation_matrices(usage=True)
    return srgb


def test_lifetimes_are_where_the_straight_pieces_pass_the_tolerance(
    model: DisplayModel, pixels: NDArray[np.uint8]
) -> None:
    curve = Curve(model, Colours.of(pixels[::8, ::8]))
    for mode in PAPER:
        mean, sd = np.array([curve.at(mode, hour) for hour in curve.hours]).T
        assert (np.diff(mean) > 0).all()
        assert (np.diff(mean + 2 * sd) > 0).all()
        wanted = [np.interp(limit, size, curve.hours) for limit in (3, 5) for size in (mean + 2 * sd, mean)]
        np.testing.assert_allclose(curve.lifetimes(mode), wanted, rtol=1e-12)


def test_a_tolerance_that_is_never_passed_has_no_lifetime(model: DisplayModel) -> None:
    black = Colours.of(np.zeros((4, 4, 3), dtype=np.uint8))
    assert np.isnan(Curve(model, black).lifetimes("chroma")).all()


@pytest.mark.slow
def test_the_report_sets_ours_beside_the_papers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], model: DisplayModel, lifetimes: dict[str, tuple[float, ...]]
) -> None:
    Image.fromarray(immunohistochemistry()).save(tmp_path / "ihc.png")
    assert table1.main([str(tmp_path / "ihc.png")]) == 0
    _, _, chroma, _, name, *other = capsys.readouterr().out.splitlines()
    assert chroma.split()[1::3] == [f"{hours:.0f}" for hours in lifetimes["chroma"]]
    assert name == "ihc.png"
    ihc = Curve(model, Colours.of(immunohistochemistry())).lifetimes("chroma")
    assert other[0].split()[1::3] == [f"{hours:.0f}" for hours in ihc]


def test_another_drift_is_told_from_the_fitted_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], pixels: NDArray[np.uint8]
) -> None:
    monkeypatch.setattr(table1, "slide", lambda: pixels[:64, :64])
    for drift, code in ((Drift(0.0793, 0.2758, 6528.0), 0), (Drift(0.0805, 0.276, 6530.0), 1)):
        monkeypatch.setattr(table1, "fit", lambda _, drift=drift: drift)
        assert table1.main(["--fit"]) == code
        assert str(astuple(drift)[0]) in capsys.readouterr().out


def test_other_pixels_and_a_missing_slide_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pixels: NDArray[np.uint8]
) -> None:
    path = tmp_path / "slide.png"
    monkeypatch.setattr(table1, "SLIDE", path)
    with pytest.raises(SystemExit, match="run make setup"):
        table1.slide()
    Image.fromarray(pixels[:8, :8]).save(path)
    with pytest.raises(SystemExit, match="not those that the display was fitted on"):
        table1.slide()
    path.write_bytes(b"no image")
    with pytest.raises(SystemExit, match=r"slide\.png"):
        table1.slide()


@pytest.mark.slow
@pytest.mark.rare(instead="test_the_lifetimes_on_the_named_slide_are_those_of_table_1")
def test_the_docs_say_what_lifetime_finds(model: DisplayModel, tmp_path: Path) -> None:
    tables = [
        [cell.strip() for cell in row.strip("|").split("|")]
        for row in (ROOT / "docs/explanation/default-display.md").read_text(encoding="utf-8").splitlines()
        if row.startswith("|")
    ]
    documented = {row[0]: row[1:] for row in tables}
    assert {name: documented[f"{name}, paper"] for name in PAPER} == {
        name: [f"{hours:,}".replace(",", " ") if hours > 9999 else str(hours) for hours in row]
        for name, row in PAPER.items()
    }
    imsave(tmp_path / "ihc.png", immunohistochemistry(), check_contrast=False)
    images = {"immunohistochemistry, scikit-image": tmp_path / "ihc.png"}
    if real := os.environ.get("LUTGEN_REAL_DATA"):
        images |= {f"H&E field `{name}`": Path(real, "images", f"{name}.png") for name in ("he_a", "he_b")}
    lifetimes_of_images = lifetime([table1.SLIDE, *images.values()], model).images
    ours = {"chroma": documented["chroma, ours (fitted)"], "chroma-luma": documented["chroma-luma, ours"]}
    assert {mode: [numbers(cell)[0] for cell in cells] for mode, cells in ours.items()} == lives(lifetimes_of_images[0])
    for name, image in zip(images, lifetimes_of_images[1:], strict=True):
        pairs = [numbers(cell) for cell in documented[name]]
        assert {mode: [pair[place] for pair in pairs] for place, mode in enumerate(PAPER)} == lives(image), name


def numbers(cell: str) -> list[int]:
    """Hours in a cell of the page: `10 044; 3785`, `11 084 (−0.1 %)`."""
    return [int(part.partition("(")[0].replace(" ", "")) for part in cell.split(";")]


def lives(image: ImageLifetime) -> dict[str, list[int]]:
    """Hours until Max 3, average 3, Max 5, average 5, by mode."""
    criteria = [(statistic, tolerance) for tolerance in (3.0, 5.0) for statistic in ("max", "mean")]
    return {
        mode: [round(curve.hours_until(*criterion) or 0) for criterion in criteria]
        for mode, curve in image.curves.items()
    }
