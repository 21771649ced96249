"""Counting distinct colours: equal to `numpy.unique` on all pixels, for every depth, order and format."""

from __future__ import annotations

import struct
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.data import immunohistochemistry
from skimage.filters import threshold_otsu

from lutgen import LutgenError
from lutgen.bindings import oiio
from lutgen.colorimetry import code_to_linear, linear_to_code, linear_to_lab
from lutgen.pictures import blocks, distinct
from lutgen.pictures.distinct import BINS, Colours, count_colours, otsu, tissue_only

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array

Pixels = Any
DEPTHS = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}


def write(path: Path, pixels: Pixels, *, tile: int = 0, **attributes: Any) -> Path:
    lib = oiio()
    spec = lib.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], DEPTHS[pixels.dtype.name])
    spec.tile_width = spec.tile_height = tile
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    out = lib.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    pixels = np.ascontiguousarray(pixels)
    columns = (0, spec.width, 0, spec.height, 0, 1)
    assert out.write_tiles(*columns, pixels) if tile else out.write_image(pixels), out.geterror()
    assert out.close()
    return path


def counted(pixels: Pixels, white: float) -> tuple[Array, Any]:
    """The oracle: code values of all distinct colours, in the order of their numbers, and their counts."""
    colours, counts = np.unique(pixels.reshape(-1, pixels.shape[-1])[:, :3], axis=0, return_counts=True)
    return colours / white, counts


def same(colours: Colours, expected: tuple[Array, Any]) -> None:
    np.testing.assert_allclose(colours.code(), expected[0], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(colours.counts, expected[1])


@pytest.fixture(scope="module")
def tissue() -> Pixels:
    return np.asarray(immunohistochemistry())[:200, :300]


@pytest.mark.parametrize("suffix", ["png", "tif"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_integers_are_counted_exactly(suffix: str, dtype: type, tissue: Pixels, tmp_path: Path) -> None:
    white = np.iinfo(dtype).max
    pixels: Pixels = tissue.astype(dtype) * (white // 255)
    pixels[0, 0] = (0, white, 0)
    pixels[5] = white
    colours = count_colours(write(tmp_path / f"in.{suffix}", pixels))
    same(colours, counted(pixels, white))
    assert (colours.bits, colours.half_bin, colours.pixels) == (8 * np.dtype(dtype).itemsize, 0.0, 60_000)


def test_sixteen_bits_that_eight_cannot_hold_are_told_apart(tissue: Pixels, tmp_path: Path) -> None:
    fine = tissue.astype(np.uint16) * 257 - np.arange(200, dtype=np.uint16)[:, np.newaxis, np.newaxis] * (tissue > 0)
    same(count_colours(write(tmp_path / "in.tif", fine)), counted(fine, 65535.0))


@pytest.mark.parametrize(("name", "dtype"), [("in.exr", np.float16), ("in.exr", np.float32), ("in.tif", np.float32)])
def test_floats_are_counted_to_16_bits_of_their_signal(name: str, dtype: type, tissue: Pixels, tmp_path: Path) -> None:
    linear = name.endswith("exr")
    pixels: Pixels = (code_to_linear(tissue / 255.0) if linear else tissue / 255.0).astype(dtype)
    colours = count_colours(write(tmp_path / name, pixels))
    signal = pixels.astype(np.float64)
    levels = np.rint(65535.0 * (linear_to_code(signal) if linear else signal)).astype(np.uint16)
    same(colours, counted(levels, 65535.0))
    assert (colours.bits, colours.half_bin) == (16, 0.5 / 65535.0)


def test_source_says_what_the_numbers_are(tissue: Pixels, tmp_path: Path) -> None:
    colours = count_colours(write(tmp_path / "in.png", tissue), "linear")
    stored, counts = counted(tissue, 255.0)
    same(colours, (linear_to_code(stored), counts))


def test_jpegs_are_counted_as_they_are_decoded(tissue: Pixels, tmp_path: Path) -> None:
    path = write(tmp_path / "in.jpg", tissue)
    image = oiio().ImageInput.open(str(path))
    decoded = image.read_image(0, 0, 0, 3, "uint8")
    image.close()
    same(count_colours(path), counted(decoded, 255.0))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_transparent_pixels_are_not_counted_and_others_whole(dtype: type, tissue: Pixels, tmp_path: Path) -> None:
    white = np.iinfo(dtype).max
    alpha: Pixels = np.tile(np.linspace(0, white, 300).astype(dtype), (200, 1))[..., np.newaxis]
    pixels = np.concatenate([tissue.astype(dtype) * (white // 255), alpha], axis=2)
    colours = count_colours(write(tmp_path / "in.png", pixels, oiio__UnassociatedAlpha=1))
    same(colours, counted(pixels[alpha[..., 0] > 0], white))


def test_colours_multiplied_by_alpha_are_divided_by_it(tmp_path: Path) -> None:
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[:2] = (60, 30, 0, 120)
    colours = count_colours(write(tmp_path / "in.tif", pixels))
    np.testing.assert_allclose(colours.code(), [[0.5, 0.25, 0.0]], rtol=0, atol=0.5 / 65535.0)
    assert colours.pixels == 8


def test_tiles_strips_bands_and_the_order_of_pixels_do_not_show(
    tissue: Pixels, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shuffled = np.random.default_rng(1).permutation(tissue.reshape(-1, 3)).reshape(tissue.shape)
    files = [
        write(tmp_path / "flat.tif", tissue),
        write(tmp_path / "tiles.tif", tissue, tile=64),
        write(tmp_path / "shuffled.png", shuffled),
        write(tmp_path / "turned.png", tissue[::-1, ::-1]),
    ]
    monkeypatch.setattr("lutgen.pictures.images.BAND", 5000)
    for file in files:
        same(count_colours(file), counted(tissue, 255.0))


@pytest.mark.parametrize("limit", [50_000, 3000, 400])
def test_too_many_colours_are_counted_in_the_finest_bins_that_fit_whatever_their_order(
    limit: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(2)
    pixels = random.integers(20_000, 30_000, (128, 256, 3), dtype=np.uint16)
    monkeypatch.setattr(distinct, "LIMIT", limit)
    monkeypatch.setattr(distinct, "_SLICE", 1000)
    colours = count_colours(write(tmp_path / "in.tif", pixels))
    shift = 16 - colours.bits
    expected = np.unique(pixels.reshape(-1, 3) >> shift, axis=0)
    assert len(colours) == len(expected) <= limit
    assert shift == 0 or len(np.unique(pixels.reshape(-1, 3) >> (shift - 1), axis=0)) > limit
    # Each pixel is within half a bin of its colour, and the colours are the middles of the bins.
    np.testing.assert_allclose(colours.code() * 65535.0, (expected << shift) + ((1 << shift) - 1) / 2, atol=1e-9)
    assert colours.half_bin == pytest.approx(((1 << shift) - 1) / 2 / 65535.0)
    assert colours.pixels == 128 * 256
    other = count_colours(write(tmp_path / "turned.tif", pixels[::-1, ::-1]))
    np.testing.assert_array_equal(other.keys, colours.keys)
    np.testing.assert_array_equal(other.counts, colours.counts)


def test_an_image_of_one_colour_has_one(tmp_path: Path) -> None:
    colours = count_colours(write(tmp_path / "in.png", np.full((9, 7, 3), (10, 20, 30), np.uint8)))
    same(colours, (np.array([[10, 20, 30]]) / 255.0, np.array([63])))


def test_progress_ends_at_the_whole(tissue: Pixels, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lutgen.pictures.images.BAND", 5000)
    calls: list[tuple[int, int]] = []
    count_colours(write(tmp_path / "in.png", tissue), progress=lambda done, total: calls.append((done, total)))
    assert [done for done, _ in calls] == list(range(1, len(calls) + 1))
    assert calls[-1] == (len(calls), len(calls))


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tile", [0, 16])
def test_a_pixel_that_is_no_number_is_named(tile: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lutgen.pictures.images.BAND", 16 * 16)
    light = np.full((80, 40, 3), 0.5, np.float32)
    light[70, 35, 1] = np.nan
    with pytest.raises(LutgenError, match=r"in\.exr: pixel \(35, 70\) is NaN or infinite"):
        count_colours(write(tmp_path / "in.exr", light, tile=tile))


def test_a_wide_image_is_read_tile_by_tile(tissue: Pixels, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lutgen.pictures.images.BAND", 64 * 64)
    calls: list[int] = []
    path = write(tmp_path / "in.tif", tissue, tile=64)
    same(count_colours(path, progress=lambda _done, total: calls.append(total)), counted(tissue, 255.0))
    assert calls == [20] * 20  # 300 × 200 pixels are 5 × 4 tiles


def test_nothing_but_transparent_pixels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=r"in\.png: every pixel is transparent"):
        count_colours(write(tmp_path / "in.png", np.zeros((4, 4, 4), np.uint8), oiio__UnassociatedAlpha=1))


def test_a_truncated_image_is_refused(tissue: Pixels, tmp_path: Path) -> None:
    path = write(tmp_path / "in.tif", tissue)
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(LutgenError, match=r"in\.tif: the image is truncated or damaged"):
        count_colours(path)


# Slides ---------------------------------------------------------------------------------------------------------------


def slide(path: Path, tissue: Pixels) -> Path:
    """A tiled TIFF, which OpenSlide reads as a slide whatever its name."""
    big = np.tile(tissue, (6, 4, 1))
    return write(path.with_suffix(".tif"), big, tile=256, compression="none").rename(path)


def without_tile(path: Path, tile: int) -> Path:
    """Change a TIFF so that one of its tiles has no bytes, as in slides with a missing tile (TIFF 6.0, section 15)."""
    data = bytearray(path.read_bytes())
    (start,) = struct.unpack("<I", data[4:8])
    (entries,) = struct.unpack("<H", data[start : start + 2])
    for place in range(start + 2, start + 2 + 12 * entries, 12):
        tag, kind, _, where = struct.unpack("<HHII", data[place : place + 12])
        size = {3: 2, 4: 4}.get(kind, 0)
        if tag in (324, 325):
            data[where + size * tile : where + size * (tile + 1)] = bytes(size)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("suffix", blocks.SUFFIXES)
def test_slides_are_counted_like_images(suffix: str, tissue: Pixels, tmp_path: Path) -> None:
    pytest.importorskip("openslide", reason="the extra `slides` is not installed")
    colours = count_colours(slide(tmp_path / f"a{suffix}", tissue))
    once = counted(tissue, 255.0)
    same(colours, (once[0], 24 * once[1]))


def test_a_slide_with_a_missing_tile_is_refused(tissue: Pixels, tmp_path: Path) -> None:
    pytest.importorskip("openslide", reason="the extra `slides` is not installed")
    # 1200 × 1200 pixels are 5 × 5 tiles: the eighth tile is at (2 · 256, 1 · 256).
    path = without_tile(slide(tmp_path / "a.svs", tissue), 7)
    with pytest.raises(LutgenError, match=r"a\.svs: the tile at pixel \(512, 256\) is missing"):
        count_colours(path)


def test_what_is_no_slide_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("openslide", reason="the extra `slides` is not installed")
    (tmp_path / "a.svs").write_bytes(b"no slide")
    with pytest.raises(LutgenError, match=r"a\.svs: OpenSlide cannot read this slide"):
        count_colours(tmp_path / "a.svs")
    with pytest.raises(LutgenError, match=r"b\.ndpi: there is no such slide"):
        count_colours(tmp_path / "b.ndpi")


def test_slides_without_openslide_say_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "openslide", None)
    with pytest.raises(LutgenError, match=r"pip install lutgen\[slides\]"):
        count_colours(tmp_path / "a.mrxs")


# Tissue ---------------------------------------------------------------------------------------------------------------


def on_glass(tissue: Pixels, rows: int) -> Pixels:
    """Tissue above bare, slightly noisy glass."""
    glass = np.random.default_rng(3).normal(242, 2, (rows, tissue.shape[1], 3))
    return np.concatenate([tissue, np.clip(np.rint(glass), 0, 255).astype(np.uint8)])


def test_otsu_is_scikit_images() -> None:
    random = np.random.default_rng(4)
    for _ in range(20):
        histogram = random.integers(0, 50, BINS) * (random.random(BINS) < 0.3)
        histogram[[3, 200]] += 1
        edge = threshold_otsu(hist=(histogram, np.arange(BINS)))
        assert otsu(histogram.astype(np.float64)) == edge + 1


def test_bare_glass_is_left_out_at_otsus_threshold(tissue: Pixels, tmp_path: Path) -> None:
    pixels = on_glass(tissue[:, :120] // 2 + 40, 150)
    path = write(tmp_path / "in.png", pixels)
    kept, tissue_part = tissue_only(count_colours(path), path)
    lightness = linear_to_lab(code_to_linear(pixels / 255.0))[..., 0]
    bins = np.clip(lightness * BINS / 100.0, 0, BINS - 1).astype(int)
    edge = threshold_otsu(hist=(np.bincount(bins.ravel(), minlength=BINS), np.arange(BINS)))
    assert tissue_part.threshold == pytest.approx((edge + 1) * 100.0 / BINS)
    assert kept.pixels == np.count_nonzero(bins <= edge) == 200 * 120
    assert tissue_part.left_out_share == pytest.approx(150 / 350)


def test_a_field_full_of_stained_tissue_is_not_cut_in_two(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    pink, purple = random.normal((225, 150, 190), 5, (90, 64, 3)), random.normal((90, 50, 130), 5, (30, 64, 3))
    path = write(tmp_path / "in.png", np.concatenate([pink, purple]).astype(np.uint8))
    colours = count_colours(path)
    kept, tissue_part = tissue_only(colours, path)
    assert (tissue_part.threshold, tissue_part.left_out_share, kept.pixels) == (None, 0.0, colours.pixels)


@pytest.mark.parametrize("colour", [(255, 255, 255), (240, 240, 238)])
def test_bare_glass_alone_is_no_tissue(colour: tuple[int, ...], tissue: Pixels, tmp_path: Path) -> None:
    glass = on_glass(tissue, 80)[200:] if colour != (255, 255, 255) else np.full((8, 8, 3), colour, np.uint8)
    path = write(tmp_path / "in.png", glass)
    with pytest.raises(LutgenError, match=r"in\.png: no tissue was found.*Leave --tissue out"):
        tissue_only(count_colours(path), path)


def test_one_colour_that_is_not_glass_is_tissue(tmp_path: Path) -> None:
    path = write(tmp_path / "in.png", np.full((8, 8, 3), (120, 60, 140), np.uint8))
    kept, tissue_part = tissue_only(count_colours(path), path)
    assert (len(kept), tissue_part.threshold) == (1, None)
