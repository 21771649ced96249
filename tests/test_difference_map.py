"""ΔE2000 maps: every pixel against colour-science, files as OpenImageIO reads them, means of squares, pictures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import colour
import numpy as np
import pytest
from PIL import Image
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import DisplayModel, LutgenError, lifetime
from lutgen.bindings import oiio
from lutgen.colorimetry import LINEAR_TO_XYZ
from lutgen.pictures import difference_map as module
from lutgen.pictures.blocks import Place
from lutgen.pictures.difference_map import BIN, difference_map
from lutgen.pictures.frame import AreaMeans, Grid, whole_factor
from lutgen.report.difference_map import (
    MAGENTA,
    RANGE,
    check_range,
    draw_histogram,
    draw_map,
    plot_map,
    scale_of,
    share_above,
)

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.pictures.difference_map import DifferenceMap

AGE = ("chroma-luma", 10_000.0)


@pytest.fixture(scope="module")
def tissue() -> Any:
    return np.asarray(immunohistochemistry())[100:197, 200:331]


def literal(code: Any, model: DisplayModel, mode: str, hours: float) -> Any:
    """ΔE2000 of code values (..., 3) by colour-science, pixel by pixel. Only the signal comes from the display."""

    def lab(shown: Any) -> Any:
        light = colour.models.eotf_sRGB(np.clip(shown, 0.0, 1.0))
        xyz, white = light @ LINEAR_TO_XYZ.T, LINEAR_TO_XYZ.sum(axis=1)
        return colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white))

    return colour.delta_E(lab(code), lab(model.at(mode, hours).code_to_code(code)), method="CIE 2000")


def read_back(path: Path) -> Any:
    image = oiio().ImageBuf(str(path))
    assert (image.spec().nchannels, str(image.spec().format)) == (1, "float")
    return image.get_pixels(oiio().FLOAT)[..., 0]


def write_tiff(path: Path, pixels: Any, kind: str, tile: int = 0) -> Path:
    spec = oiio().ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if tile:
        spec.tile_width = spec.tile_height = tile
    if pixels.shape[2] == 4:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio().ImageOutput.create("tiff")
    assert out.open(str(path), spec)
    assert out.write_image(np.ascontiguousarray(pixels))
    assert out.close()
    return path


@pytest.mark.parametrize("suffix", [".exr", ".tif"])
@pytest.mark.parametrize("age", [AGE, ("chroma", 18_000.0)])
def test_every_pixel_is_colour_sciences(
    age: tuple[str, float], suffix: str, model: DisplayModel, tissue: Any, tmp_path: Path
) -> None:
    imsave(tmp_path / "a.png", tissue, check_contrast=False)
    out = tmp_path / f"map{suffix}"
    difference = difference_map(tmp_path / "a.png", model, *age, floats=[out])
    expected = literal(tissue / 255.0, model, *age)
    np.testing.assert_allclose(read_back(out), expected, atol=2e-4)
    np.testing.assert_allclose(difference.shown, expected, atol=2e-4)
    assert difference.factor == 1
    assert difference.mean == pytest.approx(expected.mean(), abs=1e-4)
    assert difference.largest == pytest.approx(expected.max(), abs=2e-4)


def test_statistics_are_those_of_lifetime(model: DisplayModel, tissue: Any, tmp_path: Path) -> None:
    imsave(tmp_path / "a.png", tissue, check_contrast=False)
    difference = difference_map(tmp_path / "a.png", model, *AGE)
    curve = lifetime([tmp_path / "a.png"], model, hours=[AGE[1]]).images[0].curves[AGE[0]]
    for name in ("mean", "sd", "p95", "p99", "largest"):
        assert getattr(difference, name) == getattr(curve, name)[-1], name


def test_sixteen_bits_are_exact_per_pixel_though_colours_are_binned(
    model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lutgen.pictures.distinct.LIMIT", 500)
    pixels = np.random.default_rng(3).integers(0, 65_536, (40, 50, 3), dtype=np.uint16)
    file = write_tiff(tmp_path / "a.tif", pixels, "uint16")
    difference = difference_map(file, model, *AGE, floats=[tmp_path / "m.exr"])
    np.testing.assert_allclose(read_back(tmp_path / "m.exr"), literal(pixels / 65_535.0, model, *AGE), atol=2e-4)
    assert difference.colours <= 500
    assert difference.binning_error > 0.1


def test_a_tiled_image_is_written_in_tiles_and_read_in_pieces(
    model: DisplayModel, tissue: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lutgen.pictures.images.BAND", 2000)
    file = write_tiff(tmp_path / "a.tif", tissue, "uint8", tile=32)
    difference_map(file, model, *AGE, floats=[tmp_path / "m.tif", tmp_path / "m.exr"])
    for name in ("m.tif", "m.exr"):
        assert oiio().ImageBuf(str(tmp_path / name)).spec().tile_width == 32
        np.testing.assert_allclose(read_back(tmp_path / name), literal(tissue / 255.0, model, *AGE), atol=2e-4)


def test_what_is_transparent_is_nan_and_not_counted(model: DisplayModel, tissue: Any, tmp_path: Path) -> None:
    alpha = np.full((*tissue.shape[:2], 1), 255, np.uint8)
    alpha[:20] = 0
    alpha[20:30] = 128
    imsave(tmp_path / "a.png", np.concatenate([tissue, alpha], axis=2), check_contrast=False)
    difference = difference_map(tmp_path / "a.png", model, *AGE, floats=[tmp_path / "m.exr"])
    written = read_back(tmp_path / "m.exr")
    assert np.isnan(written[:20]).all()
    np.testing.assert_allclose(written[20:], literal(tissue[20:] / 255.0, model, *AGE), atol=2e-4)
    assert difference.pixels == tissue[20:, :, 0].size
    assert np.isnan(difference.shown[:20]).all()


def test_a_large_image_is_drawn_by_means_of_squares(
    model: DisplayModel, tissue: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LONGEST", 50)
    monkeypatch.setattr("lutgen.pictures.images.BAND", 1000)
    imsave(tmp_path / "a.png", tissue, check_contrast=False)
    difference = difference_map(tmp_path / "a.png", model, *AGE)
    expected = literal(tissue / 255.0, model, *AGE)
    assert (difference.factor, difference.shown.shape) == (3, (33, 44))
    assert difference.shown[2, 5] == pytest.approx(expected[6:9, 15:18].mean(), abs=2e-4)
    assert difference.shown[-1, -1] == pytest.approx(expected[96:, 129:].mean(), abs=2e-4)


@pytest.mark.parametrize("factor_to", [7, 20, 61, 1000])
def test_means_do_not_depend_on_how_the_picture_is_cut(factor_to: int) -> None:
    random = np.random.default_rng(1)
    values, counted = random.random((61, 47, 2)), random.integers(0, 2, (61, 47)).astype(float)
    values[counted == 0] = np.nan
    size = whole_factor(61, 47, factor_to)
    whole, parts = (AreaMeans(Grid.squares(61, 47, size), 2) for _ in range(2))
    whole.add(Place(0, 61, 0, 47), values, counted)
    for top, bottom in ((0, 5), (5, 23), (23, 61)):
        for left, right in ((0, 31), (31, 47)):
            place = (slice(top, bottom), slice(left, right))
            parts.add(Place(top, bottom, left, right), values[place], counted[place])
    np.testing.assert_allclose(parts.means(), whole.means(), rtol=1e-12)
    squares = list(np.ndindex(*whole.means().shape[:2]))
    for row, column in squares[:: 1 + len(squares) // 150]:
        square = values[size * row : size * (row + 1), size * column : size * (column + 1)]
        if np.isfinite(square).any():
            np.testing.assert_allclose(whole.means()[row, column], np.nanmean(square, axis=(0, 1)))
        else:
            assert np.isnan(whole.means()[row, column]).all()


def overlaps(edges: Array, length: int) -> Array:
    """The area of each pixel that each cell covers, (cells, pixels)."""
    pixel = np.arange(length)
    covered = np.minimum(edges[1:, np.newaxis], pixel + 1) - np.maximum(edges[:-1, np.newaxis], pixel)
    return np.asarray(np.maximum(covered, 0.0))


@pytest.mark.parametrize(("high", "wide"), [(61, 47), (60, 46), (7, 47), (23, 1)])
@pytest.mark.parametrize("band", [61, 20, 1])
def test_a_pixel_across_an_edge_counts_on_both_sides_by_its_share(high: int, wide: int, band: int) -> None:
    random = np.random.default_rng(2)
    values, counted = random.random((61, 47, 1)), random.integers(0, 2, (61, 47)).astype(float)
    counted[:20, :20] = 0
    grid = Grid(np.linspace(0, 61, high + 1), np.linspace(0, 47, wide + 1))
    means = AreaMeans(grid, 1)
    for top in range(0, 61, band):
        for left, right in ((0, 31), (31, 47)):
            place = Place(top, min(top + band, 61), left, right)
            part = (slice(place.top, place.bottom), slice(left, right))
            means.add(place, values[part], counted[part])
    rows, columns = overlaps(grid.rows, 61), overlaps(grid.columns, 47)
    area = rows @ counted @ columns.T
    with np.errstate(invalid="ignore"):
        expected = rows @ (values[..., 0] * counted) @ columns.T / area
    np.testing.assert_allclose(means.means()[..., 0], expected, rtol=1e-9)


def test_the_same_bytes_again(model: DisplayModel, tissue: Any, tmp_path: Path) -> None:
    imsave(tmp_path / "a.png", tissue, check_contrast=False)
    for name in ("1", "2"):
        floats = [tmp_path / f"{name}.exr", tmp_path / f"{name}.tif"]
        plot_map(difference_map(tmp_path / "a.png", model, *AGE, floats=floats), tmp_path / f"{name}.png")
    for suffix in (".exr", ".tif", ".png"):
        assert (tmp_path / f"1{suffix}").read_bytes() == (tmp_path / f"2{suffix}").read_bytes(), suffix
        assert not re.search(rb"20\d\d:\d\d:\d\d", (tmp_path / f"1{suffix}").read_bytes()), "a date"


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"mode": "stable"}, "unknown mode that ages 'stable'. Pick one of: chroma, chroma-luma."),
        ({"hours": 18_001.0}, "outside the measured span"),
        ({"hours": float("nan")}, "outside the measured span"),
        ({"image": "gone.png"}, "gone.png: there is no such image"),
        ({"source": "colour"}, "unknown source 'colour'"),
        ({"floats": ["m.jpg"]}, "unknown suffix of a map in numbers '.jpg'"),
        ({"floats": ["old.exr"]}, "old.exr: exists already"),
        ({"floats": ["a.tif"], "force": True}, "a.tif: is the image itself"),
    ],
)
def test_bad_input_is_refused_and_nothing_is_written(
    given: dict[str, Any], sentence: str, model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_tiff(tmp_path / "a.tif", np.full((4, 4, 3), 90, np.uint8), "uint8")
    (tmp_path / "old.exr").write_text("mine")
    asked: dict[str, Any] = {"image": "a.tif", "model": model, "mode": "chroma", "hours": 9000.0} | given
    with pytest.raises(LutgenError) as error:
        difference_map(**asked)
    assert sentence in str(error.value)
    assert {path.name for path in tmp_path.iterdir()} == {"a.tif", "old.exr"}
    assert (tmp_path / "old.exr").read_text() == "mine"


def test_a_pixel_that_is_not_finite_is_named_and_nothing_is_left(model: DisplayModel, tmp_path: Path) -> None:
    pixels = np.full((8, 8, 3), 0.5, np.float32)
    pixels[3, 2] = np.nan
    write_tiff(tmp_path / "a.tif", pixels, "float")
    with pytest.raises(LutgenError, match=r"pixel \(2, 3\) is NaN or infinite"):
        difference_map(tmp_path / "a.tif", model, *AGE, floats=[tmp_path / "m.exr"])
    assert [path.name for path in tmp_path.iterdir()] == ["a.tif"]


# The picture ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole_map(model: DisplayModel, tissue: Any, tmp_path_factory: pytest.TempPathFactory) -> DifferenceMap:
    file = tmp_path_factory.mktemp("found") / "slide.png"
    imsave(file, tissue, check_contrast=False)
    return difference_map(file, model, "chroma", 18_000.0)


def test_the_histogram_counts_every_pixel_once(whole_map: DifferenceMap) -> None:
    held = whole_map.histogram()
    assert held.sum() == whole_map.pixels
    expected, _ = np.histogram(whole_map.shown, np.arange(len(held) + 1) * BIN)
    # Single-precision values of the map may fall on the other side of a bin's edge.
    assert np.abs(held - expected).sum() <= 4


def test_one_colour_makes_a_map_of_one_number(model: DisplayModel, tmp_path: Path) -> None:
    imsave(tmp_path / "a.png", np.full((8, 8, 3), 200, np.uint8), check_contrast=False)
    flat = difference_map(tmp_path / "a.png", model, *AGE)
    assert (flat.sd, flat.mean) == (0.0, flat.largest)
    assert plot_map(flat, tmp_path / "m.png").is_file()
    new = difference_map(tmp_path / "a.png", model, "chroma", 0.0)
    assert new.largest == pytest.approx(0.0, abs=1e-9)
    assert plot_map(new, tmp_path / "n.png").is_file()


def test_what_lies_above_the_scale_is_marked_and_said(whole_map: DifferenceMap) -> None:
    from matplotlib.colors import to_rgba
    from matplotlib.figure import Figure

    drawn = draw_map(Figure().add_subplot(), whole_map, (1.0, 8.0))
    colours = drawn.cmap(drawn.norm(whole_map.shown))
    np.testing.assert_array_equal((colours == to_rgba(MAGENTA)).all(axis=-1), whole_map.shown > 8.0)
    assert (whole_map.shown > 8.0).any()
    assert whole_map.share(8.0) == pytest.approx(float((whole_map.shown > 8.0).mean()), abs=1e-4)
    assert (
        share_above(whole_map, (0.0, 8.0))
        == f"{100 * whole_map.share(8.0):.1f} % above; --range 0,{np.ceil(whole_map.largest):g} holds all"
    )
    axes = Figure().add_subplot()
    draw_histogram(axes, whole_map, (0.0, 8.0), drawn)
    assert axes.get_ylim() == (0.0, 8.0)
    assert [text.get_text() for text in axes.texts] == [f"mean {whole_map.mean:.2f}"]


def test_the_picture_shows_the_maps_colours(whole_map: DifferenceMap, tmp_path: Path) -> None:
    from matplotlib import colormaps

    plot_map(whole_map, tmp_path / "m.png", ends=RANGE)
    page = np.asarray(Image.open(tmp_path / "m.png").convert("RGB"))
    assert page.shape[1] == 1500
    # Only the lines of the frame are dark rows across the map.
    dark = np.flatnonzero(page[:, 70:970].max(axis=(1, 2)) < 110)
    top, bottom = dark[0], dark[-1]
    high, wide = whole_map.shown.shape
    rows, columns = np.mgrid[2 : high - 2 : 5, 2 : wide - 2 : 5]
    drawn = page[
        np.rint(top + (rows + 0.5) / high * (bottom - top)).astype(int),
        np.rint(60 + (columns + 0.5) / wide * 920).astype(int),
    ]
    scale = np.clip(whole_map.shown[rows, columns] / RANGE[1], 0.0, 1.0)
    wanted = 255.0 * np.asarray(colormaps["viridis"](scale))[..., :3]
    within = whole_map.shown[rows, columns] <= RANGE[1]
    assert np.quantile(np.abs(drawn - wanted).max(axis=2)[within], 0.95) <= 3.0


@pytest.mark.parametrize(
    ("ends", "sentence"),
    [
        ((20.0, 0.0), "range 20,0: the second number must be larger than the first"),
        ((3.0, 3.0), "range 3,3: the second number must be larger than the first"),
        ((-1.0, 5.0), "range -1,5: a scale runs between finite"),
        ((0.0, float("inf")), "range 0,inf: a scale"),
        ((float("nan"), 5.0), "range nan,5: a scale"),
    ],
)
def test_a_scale_that_is_none_is_refused(ends: tuple[float, float], sentence: str) -> None:
    with pytest.raises(LutgenError, match=sentence):
        check_range(*ends)


def test_the_colour_below_a_scale_is_told_where_there_is_one() -> None:
    assert "ΔE2000 1 to 8, as in the paper; magenta: above it; black: below it." in scale_of((1.0, 8.0))
    assert "black" not in scale_of(RANGE)
