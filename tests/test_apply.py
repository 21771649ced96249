"""``lutgen apply``: pixels follow the model, everything else is unchanged, and bad input writes no file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from PIL import Image, ImageCms
from skimage import data

from lutgen import DisplayModel, LutgenError, apply_to_image
from lutgen.bake.formats import lut_suffixes
from lutgen.bindings import oiio
from lutgen.colorimetry import code_to_linear, linear_to_code
from lutgen.pictures.engines import ChainEngine, PaperEngine, engine_for
from lutgen.pictures.images import open_source
from tests.command import exit_code, here
from tests.disk import mounted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from lutgen.display import AgedDisplay

Pixels = Any
MODE, HOURS = "chroma", 10_000.0
LOSSLESS_8 = ("png", "tif")


class Stored(NamedTuple):
    """An image as OpenImageIO reads it, with alpha as stored."""

    pixels: Pixels
    spec: Any


@pytest.fixture
def inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(path: Path, pixels: Pixels, *, tile: int = 0, x: int = 0, **attributes: Any) -> Path:
    lib = oiio()
    depth = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float", "uint32": "uint"}
    spec = lib.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], depth[pixels.dtype.name])
    spec.x = x
    spec.tile_width = spec.tile_height = tile
    names = attributes.pop("channelnames", None)
    if names:
        spec.channelnames = names
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    out = lib.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    done = (
        out.write_tiles(x, x + spec.width, 0, spec.height, 0, 1, np.ascontiguousarray(pixels))
        if tile
        else out.write_image(np.ascontiguousarray(pixels))
    )
    assert done, out.geterror()
    assert out.close()
    return path


def read(path: Path) -> Stored:
    lib = oiio()
    hint = lib.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    image = lib.ImageInput.open(str(path), hint)
    assert image, lib.geterror()
    spec = image.spec()
    pixels = image.read_image(0, 0, 0, spec.nchannels, spec.format)
    assert pixels is not None, image.geterror()
    image.close()
    return Stored(pixels, lib.ImageSpec(spec))


def run(*words: object) -> int:
    """Run ``lutgen`` in this process. Return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        return exit_code(patch, *words)


def eight_bits(code: NDArray[np.float64]) -> Pixels:
    return np.rint(255.0 * code).astype(np.uint8)


@pytest.fixture(scope="module")
def tissue() -> Pixels:
    # Part of it, with all stains and pale ground.
    return np.ascontiguousarray(data.immunohistochemistry()[200:328, 200:328])


@pytest.fixture(scope="module")
def aged(model: DisplayModel) -> AgedDisplay:
    return model.at(MODE, HOURS)


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("build") / "aged"
    assert run("build", "--hours", "10000", "--mode", MODE, "--no-certificates", "--jobs", "1", "-o", folder) == 0
    return folder


@pytest.fixture(scope="module")
def icc() -> bytes:
    return ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def with_alpha(pixels: Pixels) -> Pixels:
    """Add an alpha ramp that includes 0. Alpha must not change the colours."""
    white = 1.0 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
    ramp = np.broadcast_to(np.linspace(0.0, 1.0, pixels.shape[1])[np.newaxis, :, np.newaxis], (*pixels.shape[:2], 1))
    return np.concatenate([pixels, (ramp * white).astype(pixels.dtype)], axis=2)


# Pixels ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["stable", "chroma", "chroma-luma"])
@pytest.mark.parametrize("suffix", LOSSLESS_8)
def test_eight_bits_are_the_model_rounded(
    suffix: str, mode: str, tissue: Pixels, model: DisplayModel, tmp_path: Path
) -> None:
    source = write(tmp_path / f"in.{suffix}", tissue)
    out = tmp_path / f"out.{suffix}"
    display = model.at(mode, HOURS)
    applied = apply_to_image(source, out, display)
    written = read(out).pixels
    assert written.dtype == np.uint8
    np.testing.assert_array_equal(written, eight_bits(display.code_to_code(tissue / 255.0)))
    assert applied.clipped_share == pytest.approx(display.clipped_share(tissue / 255.0), abs=1e-12)
    assert (written != tissue).any() == (mode != "stable")


def test_sixteen_bits_are_the_model_rounded(tissue: Pixels, aged: AgedDisplay, tmp_path: Path) -> None:
    fine = tissue.astype(np.uint16) * 257 - np.arange(128, dtype=np.uint16)[:, np.newaxis] % 200 * (tissue > 0)
    applied = apply_to_image(write(tmp_path / "in.tif", fine), tmp_path / "out.tif", aged)
    written = read(tmp_path / "out.tif").pixels
    assert written.dtype == np.uint16
    np.testing.assert_array_equal(written, np.rint(65535.0 * aged.code_to_code(fine / 65535.0)))
    assert applied.clipped_share == pytest.approx(aged.clipped_share(fine / 65535.0), abs=1e-12)


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float16, 2.0**-11), (np.float32, 2.0**-23)])
def test_exr_is_linear_light_in_and_out(
    dtype: type, tolerance: float, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    linear: Pixels = code_to_linear(tissue / 255.0).astype(dtype)
    applied = apply_to_image(write(tmp_path / "in.exr", linear), tmp_path / "out.exr", aged)
    written = read(tmp_path / "out.exr").pixels
    expected = code_to_linear(aged.code_to_code(linear_to_code(linear.astype(np.float64))))
    assert applied.encoding == "linear"
    assert written.dtype == dtype
    np.testing.assert_allclose(written, expected, rtol=tolerance, atol=1e-7)


def test_float_tiff_is_code_values_in_and_out(tissue: Pixels, aged: AgedDisplay, tmp_path: Path) -> None:
    code = (tissue / 255.0).astype(np.float32)
    applied = apply_to_image(write(tmp_path / "in.tif", code), tmp_path / "out.tif", aged)
    assert applied.encoding == "signal"
    np.testing.assert_allclose(read(tmp_path / "out.tif").pixels, aged.code_to_code(code), rtol=0, atol=1e-7)


@pytest.mark.parametrize(("source", "encoding"), [("signal", "signal"), ("linear", "linear"), ("auto", "linear")])
def test_source_says_what_the_numbers_are(
    source: str, encoding: str, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    pixels = (tissue[:32] / 255.0).astype(np.float32)
    applied = apply_to_image(write(tmp_path / "in.exr", pixels), tmp_path / "out.exr", aged, source=source)
    code = pixels if encoding == "signal" else linear_to_code(pixels)
    expected = aged.code_to_code(code) if encoding == "signal" else code_to_linear(aged.code_to_code(code))
    assert applied.encoding == encoding
    np.testing.assert_allclose(read(tmp_path / "out.exr").pixels, expected, rtol=0, atol=1e-7)


def test_light_beyond_white_is_clipped_and_counted(aged: AgedDisplay, tmp_path: Path) -> None:
    light = np.full((4, 8, 3), 0.5, np.float16)
    light[0, :4] = (3.0, 0.5, -1.0)
    applied = apply_to_image(write(tmp_path / "in.exr", light), tmp_path / "out.exr", aged)
    expected = code_to_linear(aged.code_to_code(np.array([1.0, linear_to_code(0.5), 0.0])))
    np.testing.assert_allclose(read(tmp_path / "out.exr").pixels[0, 0], expected, rtol=1e-3)
    assert applied.source_clipped_share == 4 / 32


def test_jpeg_is_close_to_the_model_and_keeps_colour_at_full_resolution(
    tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    source = write(tmp_path / "in.jpg", tissue)
    apply_to_image(source, tmp_path / "out.jpg", aged)
    expected = eight_bits(aged.code_to_code(read(source).pixels / 255.0)).astype(int)
    written = read(tmp_path / "out.jpg")
    assert written.spec.get_string_attribute("jpeg:subsampling") == "4:4:4"
    assert np.abs(written.pixels - expected).mean() < 1.5
    coarse = write(tmp_path / "coarse.jpg", expected.astype(np.uint8), Compression="jpeg:75")
    assert np.abs(written.pixels - expected).mean() < 0.7 * np.abs(read(coarse).pixels - expected).mean()


@pytest.mark.parametrize("selection", ["nearest", "continuous"])
def test_the_fast_engine_is_the_chain(selection: str, model: DisplayModel) -> None:
    display = DisplayModel(model.measurements, selection=selection).at("chroma-luma", 18_000.0)
    random = np.random.default_rng(1)
    greys = np.repeat(random.random((1, 500)), 3, axis=0)
    two_equal = random.random((2, 500))[[0, 0, 1]]
    primaries = np.array([[0, 1, 1, 0, 0, 1, 0, 1], [0, 1, 0, 1, 0, 1, 1, 0], [0, 1, 0, 0, 1, 0, 1, 1.0]])
    linear = np.concatenate([random.random((3, 20_000)), greys, two_equal, primaries], axis=1)
    fast = engine_for(display)
    assert isinstance(fast, PaperEngine)
    light, clipped = fast(linear)
    code, chain_clipped = ChainEngine(display)(linear_to_code(linear))
    np.testing.assert_allclose(linear_to_code(light), code, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(clipped, chain_clipped)


# By a built LUT -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["cube", "clf", "build"])
def test_a_built_lut_is_within_one_code_of_the_model(
    how: str, tissue: Pixels, aged: AgedDisplay, build: Path, tmp_path: Path
) -> None:
    source, out = write(tmp_path / "in.png", tissue), tmp_path / "out.png"
    lut = build / MODE / "10000h" / f"aged.{how}"
    which = ["--build", build, "--mode", MODE, "--hours", HOURS] if how == "build" else ["--lut", lut]
    assert run("apply", source, *which, "-o", out) == 0
    written = read(out).pixels.astype(int)
    model_says = eight_bits(aged.code_to_code(tissue / 255.0)).astype(int)
    assert np.quantile(np.abs(written - model_says), 0.99) <= 1
    assert np.abs(written - tissue).max() > 10


def test_a_lut_is_interpolated_tetrahedrally(tmp_path: Path) -> None:
    # 2³ points with max(r, g, b) in red at the corners: trilinear and tetrahedral interpolation differ.
    corners = [(r, g, b) for b in (0, 1) for g in (0, 1) for r in (0, 1)]
    rows = "".join(f"{max(corner)} 0 0\n" for corner in corners)
    (tmp_path / "max.cube").write_text(f"LUT_3D_SIZE 2\n{rows}")
    source = write(tmp_path / "in.tif", np.full((2, 2, 3), (0.5, 0.25, 0.125), np.float32))
    applied = apply_to_image(source, tmp_path / "out.tif", tmp_path / "max.cube")
    np.testing.assert_allclose(read(tmp_path / "out.tif").pixels[0, 0], (0.5, 0, 0), atol=1e-6)
    assert applied.clipped_share is None


@pytest.mark.parametrize("word", ["nan", "NaN", "-inf", "Infinity", "-1.#IND", "1.#QNAN00"])
def test_a_lut_with_a_number_that_is_not_finite_is_refused(
    word: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = write(tmp_path / "in.png", np.zeros((8, 8, 3), np.uint8))
    lut = tmp_path / "l.cube"
    head, rows = '# no inf\nTITLE "nan inf"\nLUT_3D_SIZE 2\n', ["0 0 0\n"] * 8
    lut.write_text(head + "".join(rows))
    assert run("apply", source, "--lut", lut, "-o", tmp_path / "fine.png") == 0
    rows[3] = f"0.5 {word} 0\n"
    lut.write_text(head + "".join(rows))
    assert run("apply", source, "--lut", lut, "-o", tmp_path / "out.png") == 2
    *_, line = capfd.readouterr().err.splitlines()
    assert f"l.cube, line 7: holds {word!r}" in line
    assert "`lutgen lint " in line
    assert not (tmp_path / "out.png").exists()


@pytest.mark.parametrize(
    ("head", "channels", "largest", "why"),
    [
        (
            "",
            "rgb",
            1023,
            "has values up to 1023: integers, not 0..1, so OpenColorIO shows almost everything as white.",
        ),
        ("", "bgr", 1, "looks written blue fastest"),
        ("", "rgb", 1, ""),
        # An error of ffmpeg and pillow_lut; OpenColorIO, which applies the LUT, reads it as it is meant.
        ("DOMAIN_MAX 2 2 2", "rgb", 1, ""),
    ],
)
def test_a_lut_that_lint_calls_wrong_is_applied_with_a_warning(
    head: str, channels: str, largest: float, why: str, inside: Path
) -> None:
    write(inside / "in.png", np.full((8, 8, 3), 90, np.uint8))
    steps = np.linspace(0, largest, 5)
    colours = ({"r": r, "g": g, "b": b} for b in steps for g in steps for r in steps)
    rows = [" ".join(f"{colour[channel]:.4f}" for channel in channels) for colour in colours]
    (inside / "a lut.cube").write_text("\n".join(["LUT_3D_SIZE 5", head, *rows]) + "\n")
    done = here("apply", "in.png", "--lut", "a lut.cube", "--json", "-o", "out.png")
    assert done.returncode == 0
    assert json.loads(done.stdout)["images"][0]["output"] == "out.png"
    assert (inside / "out.png").exists()
    if not why:
        assert not done.stderr
        return
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"Warning: a lut.cube {why}")
    assert "`lutgen lint 'a lut.cube'`" in line


@pytest.mark.parametrize(("words", "first", "code"), [("nan", "0", 0), ("inf", "0", 0), ("a table", "nan", 2)])
def test_the_description_of_a_clf_may_say_nan(words: str, first: str, code: int, tmp_path: Path) -> None:
    rows = "\n".join([f"{first} 0 0", *["0 0 0"] * 7])
    (tmp_path / "l.clf").write_text(
        f'<?xml version="1.0" encoding="UTF-8"?>\n<ProcessList compCLFversion="3.0" id="1">\n'
        f"<Description>{words}</Description>\n<InputDescriptor>{words}</InputDescriptor>\n"
        f'<LUT3D inBitDepth="32f" outBitDepth="32f"><Array dim="2 2 2 3">{rows}</Array></LUT3D>\n</ProcessList>\n'
    )
    source = write(tmp_path / "in.png", np.zeros((8, 8, 3), np.uint8))
    assert run("apply", source, "--lut", tmp_path / "l.clf", "-o", tmp_path / "out.png") == code


def test_opencolorio_does_not_speak_where_curves_have_no_tetrahedra(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = write(tmp_path / "in.png", np.zeros((8, 8, 3), np.uint8))
    (tmp_path / "l.cube").write_text("LUT_1D_SIZE 2\n0 0 0\n1 1 1\n")
    assert run("apply", source, "--lut", tmp_path / "l.cube", "-o", tmp_path / "out.png") == 0
    assert "OpenColorIO" not in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"hello\nworld\n", ": At line (1). Malformed color triples specified. Export"),
        (bytes(range(128, 256)) * 20, ". Export it again"),
        (b"LUT_3D_SIZE 2\n" + b"\0\1x\xff'" * 400, ". Export it again"),
    ],
)
def test_a_lut_that_is_none_is_a_short_sentence(
    content: bytes, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(Path("in.png"), np.zeros((8, 8, 3), np.uint8))
    Path("l.cube").write_bytes(content)
    assert run("apply", "in.png", "--lut", "l.cube", "-o", "out.png") == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert why in line
    assert len(line) < 300
    assert line.endswith("`lutgen lint l.cube` lists its faults.")


# Unchanged parts of an image ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["in.png", "in.tif", "in.exr", "in.jpg"])
def test_metadata_and_icc_profile_survive(
    name: str, tissue: Pixels, aged: AgedDisplay, icc: bytes, tmp_path: Path
) -> None:
    pixels = code_to_linear(tissue / 255.0).astype(np.float16) if name.endswith("exr") else tissue
    source = write(tmp_path / name, pixels, ImageDescription="biopsy 7", Artist="M. Malpighi")
    if not name.endswith("exr"):  # half of OpenImageIO's versions take no profile from Python
        with Image.open(source) as picture:
            picture.save(source, icc_profile=icc, exif=picture.getexif())
    before = read(source).spec
    out = source.with_stem("out")
    apply_to_image(source, out, aged)
    after = read(out).spec
    for key in ("ImageDescription", "Artist"):
        assert after.get_string_attribute(key) == before.get_string_attribute(key)
    if name.endswith(("jpg", "exr")):
        assert after.get_string_attribute("ImageDescription") == "biopsy 7"
    if not name.endswith("exr"):
        with Image.open(out) as picture:
            assert picture.info["icc_profile"] == icc


@pytest.mark.parametrize("suffix", ["png", "tif"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_colours_under_unassociated_alpha_are_aged_as_if_it_were_not_there(
    suffix: str, dtype: type, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    white = np.iinfo(dtype).max
    pixels = with_alpha(tissue.astype(dtype) * (white // 255))
    source = write(tmp_path / f"in.{suffix}", pixels, oiio__UnassociatedAlpha=1)
    out = tmp_path / f"out.{suffix}"
    apply_to_image(source, out, aged)
    written = read(out)
    np.testing.assert_array_equal(written.pixels[..., 3], pixels[..., 3])
    np.testing.assert_array_equal(written.pixels[..., :3], np.rint(white * aged.code_to_code(pixels[..., :3] / white)))
    assert written.spec.get_int_attribute("oiio:UnassociatedAlpha") == 1


def test_colours_multiplied_by_alpha_are_divided_aged_and_multiplied_in_exr(
    tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    straight = with_alpha(code_to_linear(tissue / 255.0).astype(np.float32))
    alpha = straight[..., 3:].astype(np.float64)
    pixels = np.concatenate([straight[..., :3] * alpha, alpha], axis=2).astype(np.float32)
    apply_to_image(write(tmp_path / "in.exr", pixels), tmp_path / "out.exr", aged)
    written = read(tmp_path / "out.exr").pixels
    np.testing.assert_array_equal(written[..., 3], pixels[..., 3])
    expected = alpha * code_to_linear(aged.code_to_code(linear_to_code(straight[..., :3].astype(np.float64))))
    # The first column (alpha 0) loses its colour. Division by a small alpha enlarges float32's rounding error.
    np.testing.assert_allclose(written[:, 1:, :3], expected[:, 1:], rtol=0, atol=1e-6)
    assert not written[:, 0, :3].any()


def test_associated_tiff_stays_associated(tissue: Pixels, aged: AgedDisplay, tmp_path: Path) -> None:
    straight = with_alpha(tissue) / 255.0
    alpha = straight[..., 3:]
    pixels = np.rint(255.0 * np.concatenate([straight[..., :3] * alpha, alpha], axis=2)).astype(np.uint8)
    apply_to_image(write(tmp_path / "in.tif", pixels), tmp_path / "out.tif", aged)
    written = read(tmp_path / "out.tif")
    assert not written.spec.get_int_attribute("oiio:UnassociatedAlpha")
    np.testing.assert_array_equal(written.pixels[..., 3], pixels[..., 3])
    assert (written.pixels[..., :3] <= written.pixels[..., 3:]).all()
    opaque = pixels[..., 3] > 250
    stored = pixels[opaque] / 255.0
    expected = aged.code_to_code(np.minimum(stored[:, :3] / stored[:, 3:], 1.0)) * stored[:, 3:]
    np.testing.assert_array_equal(written.pixels[opaque][:, :3], eight_bits(expected))


@pytest.mark.parametrize("suffix", ["tif", "exr"])
def test_tiles_and_offset_survive_and_ragged_edges_are_right(
    suffix: str, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    cut = tissue[:101, :117]
    pixels = cut if suffix == "tif" else code_to_linear(cut / 255.0).astype(np.float32)
    x = 5 if suffix == "exr" else 0
    flat, tiled = write(tmp_path / f"flat.{suffix}", pixels), write(tmp_path / f"t.{suffix}", pixels, tile=64, x=x)
    apply_to_image(flat, tmp_path / f"out_flat.{suffix}", aged)
    apply_to_image(tiled, tmp_path / f"out_t.{suffix}", aged)
    written = read(tmp_path / f"out_t.{suffix}")
    assert (written.spec.tile_width, written.spec.tile_height, written.spec.x) == (64, 64, x)
    np.testing.assert_array_equal(written.pixels, read(tmp_path / f"out_flat.{suffix}").pixels)


def test_many_bands_give_what_one_gives(
    tissue: Pixels, aged: AgedDisplay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = write(tmp_path / "in.png", tissue)
    apply_to_image(source, tmp_path / "one.png", aged)
    monkeypatch.setattr("lutgen.pictures.images.BAND", 2_000)
    apply_to_image(source, tmp_path / "many.png", aged)
    np.testing.assert_array_equal(read(tmp_path / "many.png").pixels, read(tmp_path / "one.png").pixels)


@pytest.mark.parametrize(
    ("source", "target", "dtype", "encoding"),
    [
        ("in.png", "out.exr", np.float16, "linear"),
        ("in.exr", "out.png", np.uint16, "signal"),
        ("in.exr", "out.tif", np.float32, "linear"),
        ("in.tif", "out.jpg", np.uint8, "signal"),
        ("in.tif", "out.png", np.uint8, "signal"),
    ],
)
def test_the_suffix_picks_the_format_and_colours_stay_what_they_are(
    *, source: str, target: str, dtype: type, encoding: str, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    linear = source.endswith("exr")
    pixels = code_to_linear(tissue / 255.0).astype(np.float32) if linear else tissue
    apply_to_image(write(tmp_path / source, pixels), tmp_path / target, aged)
    written = read(tmp_path / target).pixels
    assert written.dtype == dtype
    shown = written.astype(np.float64) / (1 if written.dtype.kind == "f" else np.iinfo(dtype).max)
    shown = linear_to_code(shown) if encoding == "linear" else shown
    error = np.abs(shown - aged.code_to_code(tissue / 255.0))
    assert error.mean() < (2 / 255 if target.endswith("jpg") else 1.1 / 510)


# Side by side ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["in.png", "in.tif", "in.exr"])
def test_side_by_side_is_the_untouched_source_and_the_aged_image(
    name: str, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    linear = name.endswith("exr")
    pixels = code_to_linear(tissue / 255.0).astype(np.float16) if linear else tissue
    source = write(tmp_path / name, pixels)
    both, alone = source.with_stem("both"), source.with_stem("alone")
    applied = apply_to_image(source, both, aged, side_by_side=True)
    apply_to_image(source, alone, aged)
    written = read(both)
    assert (applied.width, applied.height) == (256, 128) == (written.spec.full_width, written.spec.full_height)
    np.testing.assert_array_equal(written.pixels[:, :128], pixels)
    np.testing.assert_array_equal(written.pixels[:, 128:], read(alone).pixels)


def test_side_by_side_in_another_format_encodes_the_left_half_too(
    tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    source = write(tmp_path / "in.exr", code_to_linear(tissue / 255.0).astype(np.float32))
    apply_to_image(source, tmp_path / "both.png", aged, side_by_side=True)
    left = read(tmp_path / "both.png").pixels[:, :128]
    np.testing.assert_allclose(left / 65535.0, tissue / 255.0, rtol=0, atol=1e-5)


def test_a_mirrored_image_has_its_un_aged_half_where_viewers_show_the_left(
    tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    source = write(tmp_path / "in.tif", tissue, Orientation=2)
    apply_to_image(source, tmp_path / "both.tif", aged, side_by_side=True)
    np.testing.assert_array_equal(read(tmp_path / "both.tif").pixels[:, 128:], tissue)


@pytest.mark.parametrize("suffix", [".jpg", ".tif", ".exr", ".png"])
def test_the_orientation_is_kept_or_the_output_refused(
    suffix: str, tissue: Pixels, aged: AgedDisplay, tmp_path: Path
) -> None:
    source, out = write(tmp_path / "in.tif", tissue, Orientation=6), tmp_path / f"out{suffix}"
    if suffix == ".png":
        with pytest.raises(LutgenError, match=r"Orientation 6.*\.png cannot say that.*turn the pixels first"):
            apply_to_image(source, out, aged)
        return
    apply_to_image(source, out, aged)
    with open_source(out) as written:
        assert written.orientation == 6


# The command ----------------------------------------------------------------------------------------------------------


def test_command_prints_json(
    tissue: Pixels, aged: AgedDisplay, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source, out = write(tmp_path / "in.png", tissue), tmp_path / "out.png"
    assert run("apply", source, "--mode", MODE, "--hours", HOURS, "-o", out, "--json") == 0
    content = json.loads(capfd.readouterr().out)
    (image,) = content["images"]
    assert content["schema"] == 1
    assert (image["file"], image["output"]) == (str(source), str(out))
    assert (image["width"], image["height"]) == (128, 128)
    assert image["clipped_share"] == pytest.approx(aged.clipped_share(tissue / 255.0), abs=1e-12)


def test_several_images_go_into_a_folder(tissue: Pixels, tmp_path: Path) -> None:
    sources = [write(tmp_path / name, tissue[:64]) for name in ("a.png", "b.tif")]
    aging = ("--mode", MODE, "--hours", HOURS)
    for folder in (tmp_path / "out", tmp_path / "new" / "deep"):
        (tmp_path / "out").mkdir(exist_ok=True)
        assert run("apply", *sources, *aging, "-o", folder) == 0
        assert sorted(path.name for path in folder.iterdir()) == ["a.png", "b.tif"]
    assert run("apply", sources[0], *aging, "-o", f"{tmp_path}/one/") == 0
    assert run("apply", sources[0], *aging, "-o", tmp_path / "two" / "c.png") == 0
    assert [path.name for name in ("one", "two") for path in (tmp_path / name).iterdir()] == ["a.png", "c.png"]


@pytest.mark.parametrize("output", ["new", "new/deep", "new.png", "a.png", "a.png/deep"])
def test_a_folder_that_an_error_would_leave_empty_is_not_made(tissue: Pixels, output: str, tmp_path: Path) -> None:
    sources = [write(tmp_path / name, tissue[:64]) for name in ("a.png", "b.png")]
    if not output.endswith(".png"):
        sources[1].write_bytes(sources[1].read_bytes()[:-400])
    assert run("apply", *sources, "--mode", MODE, "--hours", HOURS, "-o", tmp_path / output) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png"]


@pytest.mark.parametrize("name", ["IN.PNG", "misnamed.jpg", "odd?x=1.png", "bare", "no-utf-8-\udcff.png"])
def test_the_kind_of_a_file_is_read_from_the_file(name: str, tissue: Pixels, aged: AgedDisplay, tmp_path: Path) -> None:
    source = write(tmp_path / "in.png", tissue[:64]).rename(tmp_path / name)
    apply_to_image(source, tmp_path / "out.png", aged)
    np.testing.assert_array_equal(read(tmp_path / "out.png").pixels, eight_bits(aged.code_to_code(tissue[:64] / 255.0)))


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the peak from /proc")
def test_memory_does_not_grow_with_the_image(tmp_path: Path) -> None:
    script = """
import sys
from lutgen import DisplayModel, apply_to_image, read_measurements
from lutgen.display import default_display
aged = DisplayModel(read_measurements(default_display())).at("chroma", 10000)
apply_to_image(sys.argv[1], sys.argv[2], aged)
print(open("/proc/self/status").read().partition("VmHWM:")[2].split()[0])
"""
    peaks = []
    for width, height in ((3000, 2000), (9000, 6000)):
        row = np.tile(np.asarray(data.immunohistochemistry())[:100], (1, 24, 1))[:, :width]
        source = tmp_path / f"{width}.tif"
        write_rows(source, row, height)
        done = subprocess.run(
            [sys.executable, "-c", script, str(source), str(tmp_path / f"out{width}.tif")],
            capture_output=True,
            text=True,
            check=True,
            cwd=Path(__file__).parents[1],
        )
        peaks.append(int(done.stdout) / 1024)
        source.unlink()
    small, large = peaks
    # The image grows by 137 MB. Bands of whole rows may differ slightly in size.
    assert large - small < 30, peaks


def write_rows(path: Path, rows: Pixels, height: int) -> None:
    """Write an uncompressed TIFF that repeats ``rows``."""
    lib = oiio()
    spec = lib.ImageSpec(rows.shape[1], height, 3, "uint8")
    spec.attribute("compression", "none")
    spec.attribute("tiff:RowsPerStrip", 100)
    out = lib.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    for first in range(0, height, len(rows)):
        assert out.write_scanlines(first, first + len(rows), 0, np.ascontiguousarray(rows)), out.geterror()
    assert out.close()


# Bad input ------------------------------------------------------------------------------------------------------------


def cut(name: str, share: float) -> Callable[[Path], Path]:
    """A valid image of that name, cut after a share of its bytes. A negative number counts bytes from the end."""

    def make(folder: Path) -> Path:
        tissue = np.asarray(data.immunohistochemistry())[:200, :300]
        if name == "pillow.tif":  # the directory and the profile stand at the end
            profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
            Image.fromarray(tissue).save(folder / name, icc_profile=profile)
        else:
            half = (tissue / 255.0).astype(np.float16)
            write(folder / name, half if name.endswith("exr") else tissue, tile=64 if "tiled" in name else 0)
        content = (folder / name).read_bytes()
        kept = int(len(content) * share) if share >= 0 else len(content) + int(share)
        (folder / name).write_bytes(content[:kept])
        return folder / name

    return make


def stored(name: str, **attributes: Any) -> Callable[[Path], Path]:
    """An image written by OpenImageIO. The number in ``name`` is the number of channels."""
    random = np.random.default_rng(2)
    channels = int("".join(filter(str.isdigit, name)) or 3)
    pixels: Pixels = random.random((16, 24, channels)).astype(np.float32)
    pixels = pixels if name.endswith("exr") else eight_bits(pixels)
    return lambda folder: write(folder / name, pixels, **attributes)


def pillow(name: str, mode: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        Image.new(mode, (24, 16)).save(folder / name)
        return folder / name

    return make


def poisoned(name: str, dtype: type, value: float) -> Callable[[Path], Path]:
    pixels: Pixels = np.full((16, 24, 3), 0.5, dtype)
    pixels[9, 5, 2] = value
    return lambda folder: write(folder / name, pixels)


def raw(name: str, content: bytes) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return make


def altered_png(folder: Path) -> Path:
    """A PNG with a changed width and an unchanged checksum: libpng complains on standard error."""
    path = write(folder / "in.png", np.zeros((8, 8, 3), np.uint8))
    content = bytearray(path.read_bytes())
    content[19] = 9
    path.write_bytes(content)
    return path


def no_rows(folder: Path) -> Path:
    """A TIFF of zero rows: tag 257, ImageLength."""
    path = write(folder / "in.tif", np.zeros((8, 8, 3), np.uint8))
    content = bytearray(path.read_bytes())
    at = content.index(b"\x01\x01\x03\x00\x01\x00\x00\x00") if content[:2] == b"II" else -1
    content[at + 8 : at + 10] = b"\0\0"
    path.write_bytes(content)
    return path


SHARES = (4, 0.02, 0.1, 0.5, 0.9, -20, -1)
BAD_IMAGES: dict[str, tuple[Callable[[Path], Path], str]] = {
    "missing": (lambda folder: folder / "none.png", "no such image"),
    "a folder": (lambda folder: folder, "not a file"),
    "empty": (raw("in.png", b""), "0 bytes"),
    "text": (raw("in.png", b"this is no image at all, but some words"), "not an image"),
    "another format": (raw("in.gif", b"GIF89a" + bytes(40)), "not an image"),
    "only magic": (raw("in.jpg", b"\xff\xd8\xff"), "truncated"),
    "noise after magic": (raw("in.exr", b"\x76\x2f\x31\x01" + bytes(range(200))), "truncated"),
    "noise after TIFF magic": (raw("in.tif", b"II*\0" + bytes(range(200))), "truncated"),
    "half a magic": (raw("in.png", b"\x89PN"), "truncated"),
    "altered PNG": (altered_png, "damaged"),
    "zero rows": (no_rows, ""),
    "CMYK JPEG": (pillow("in.jpg", "CMYK"), "CMYK"),
    "CMYK TIFF": (pillow("in.tif", "CMYK"), "CMYK"),
    "Lab TIFF": (pillow("in.tif", "LAB"), "Lab"),
    "grey PNG": (pillow("in.png", "L"), "1 channel"),
    "grey JPEG": (pillow("in.jpg", "L"), "1 channel"),
    "grey TIFF": (pillow("in.tif", "I;16"), "1 channel"),
    "grey and alpha": (pillow("in.png", "LA"), "2 channels"),
    "one channel": (stored("1.exr"), "1 channel"),
    "two channels": (stored("2.tif"), "2 channels"),
    "five channels TIFF": (stored("5.tif"), "5 channels"),
    "five channels EXR": (stored("5.exr"), "5 channels"),
    "depth as a fourth": (stored("4.exr", channelnames=("R", "G", "B", "Z")), "R, G, B, Z"),
    "not RGB": (stored("3.exr", channelnames=("X", "Y", "Z")), "X, Y, Z"),
    "32-bit integers": (lambda folder: write(folder / "in.tif", np.zeros((4, 4, 3), np.uint32)), "uint"),
    "NaN half": (poisoned("in.exr", np.float16, np.nan), "pixel (5, 9)"),
    "NaN float": (poisoned("in.exr", np.float32, np.nan), "pixel (5, 9)"),
    "NaN TIFF": (poisoned("in.tif", np.float32, np.nan), "pixel (5, 9)"),
    "infinite": (poisoned("in.exr", np.float32, np.inf), "pixel (5, 9)"),
    "infinite half": (poisoned("in.exr", np.float16, -np.inf), "pixel (5, 9)"),
    **{
        f"{name} cut at {share}": (cut(name, share / 1000 if share == 4 else share), "truncated")
        for name in ("in.png", "in.jpg", "in.tif", "tiled.tif", "pillow.tif", "in.exr", "tiled.exr")
        for share in SHARES
    },
}


@pytest.mark.parametrize("what", BAD_IMAGES)
def test_bad_image_is_one_sentence_and_nothing_written(
    what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    make, says = BAD_IMAGES[what]
    image = make(tmp_path)
    suffix = image.suffix if image.suffix in {".png", ".jpg", ".tif", ".exr"} else ".png"
    line = refusal([image], tmp_path / "out", f"out{suffix}", capfd)
    assert says in line
    assert str(image) in line


@pytest.mark.parametrize("what", ["grey TIFF", "NaN half", "in.png cut at 0.5", "tiled.exr cut at 0.9"])
def test_a_bad_image_among_good_ones_is_named_and_nothing_written(
    what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    make, says = BAD_IMAGES[what]
    image, good = make(tmp_path), write(tmp_path / "good.tif", np.zeros((8, 8, 3), np.uint8))
    line = refusal([good, image], tmp_path / "out", "", capfd)
    assert says in line
    assert str(image) in line


def refusal(images: list[Path], folder: Path, output: str, capfd: pytest.CaptureFixture[str]) -> str:
    """Return the one line with which apply refuses; nothing may be in the folder afterwards."""
    folder.mkdir()
    assert run("apply", *images, "-o", folder / output, "--mode", MODE, "--hours", HOURS) == 2
    shown = capfd.readouterr()
    assert shown.out == ""
    (line,) = shown.err.splitlines()
    assert line.startswith("lutgen: error: ")
    assert list(folder.iterdir()) == []
    return line


def unwritable(tmp_path: Path) -> Path:
    """A folder in which no file can be created, not even by root."""
    if os.geteuid() == 0:
        return Path("/proc/self")
    folder = tmp_path / "read-only"
    folder.mkdir(mode=0o500)
    return folder


@pytest.mark.parametrize(
    ("name", "output", "says"),
    [
        ("in.png", lambda folder: folder / "in.png" / "out.png", "no folder"),
        ("in.png", lambda folder: unwritable(folder) / "out.png", "cannot write"),
        ("in.png", lambda folder: folder / "out.bmp", ".png, .jpg"),
        (
            "in.png",
            lambda folder: folder / "out",
            "out: has no suffix, which chooses the format. Add one of: .png, .jpg",
        ),
        ("in.png", lambda folder: folder / "in.png", "is an input of this command"),
        ("in.png", lambda folder: folder / "link.png", "is an input of this command"),
        ("in.png", lambda folder: folder / "there.png", "exists already"),
        ("in.png", lambda folder: folder / "z\udcff.png", "no name in UTF-8"),
        ("in.png", lambda folder: folder / "out.jpg", "alpha"),
    ],
)
def test_bad_output_is_one_sentence_and_nothing_written(
    name: str, output: Callable[[Path], Path], says: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = write(tmp_path / name, np.zeros((8, 8, 4), np.uint8))
    (tmp_path / "link.png").symlink_to(source)
    (tmp_path / "there.png").write_bytes(b"someone's")
    out = output(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    force = ["--force"] if "itself" in says else []
    assert run("apply", source, "--mode", MODE, "--hours", HOURS, "-o", out, *force) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert says in line
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 200 kB."""
    yield from mounted(tmp_path / "disk", "size=200k")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".exr"])
def test_a_full_disk_is_one_sentence_and_leaves_nothing(
    suffix: str, tmp_path: Path, tiny_disk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """JPEG needs a separate process: after a write error libjpeg ends its process."""
    source, out = write(tmp_path / "in.tif", np.asarray(data.immunohistochemistry())), tiny_disk / f"out{suffix}"
    words = ["apply", str(source), "--mode", MODE, "--hours", str(HOURS), "-o", str(out)]
    if suffix == ".jpg":
        done = subprocess.run([sys.executable, "-m", "lutgen", *words], capture_output=True, text=True, check=False)
        code, printed, error = done.returncode, done.stdout, done.stderr
    else:
        code = run(*words)
        printed, error = capfd.readouterr()
    assert (code, printed) == (2, "")
    (line,) = error.splitlines()
    assert f"{out}: cannot write: no space left on device. Make room, or choose" in line
    assert list(tiny_disk.iterdir()) == []


def test_force_replaces_an_output(tissue: Pixels, tmp_path: Path) -> None:
    source, out = write(tmp_path / "in.png", tissue[:16]), tmp_path / "out.png"
    out.write_bytes(b"someone's")
    assert run("apply", source, "--mode", MODE, "--hours", HOURS, "-o", out, "--force") == 0
    assert read(out).pixels.shape == (16, 128, 3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.png", "out.png"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "--mode and --hours"),
        (("--mode", "chroma"), "--mode and --hours"),
        (("--mode", "chroma", "--hours", "99999"), "99999"),
        (("--mode", "chroma", "--hours", "nan"), "nan"),
        (("--lut", "none.cube"), "none.cube"),
        (("--lut", "none.png"), ".cube"),
        (("--lut", "bad.cube"), "bad.cube"),
        (("--lut", "bad.cube", "--mode", "chroma"), "--lut"),
        (("--build", "none", "--mode", "chroma", "--hours", "10000"), "none: there is no such folder"),
        (("--build", "none", "--mode", "chroma", "--hours", "10000", "--selection", "nearest"), "--build"),
    ],
)
def test_a_display_that_is_not_there_is_one_sentence(
    words: tuple[str, ...],
    says: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.cube").write_text("LUT_3D_SIZE 2\n0 0 0\n")
    write(Path("in.png"), np.zeros((8, 8, 3), np.uint8))
    assert run("apply", "in.png", *words, "-o", "out.png") == 2
    lines = capfd.readouterr().err.splitlines()
    assert says in [line for line in lines if not line.startswith("Example: ")][-1]
    assert not Path("out.png").exists()


def test_the_help_names_the_kinds_of_luts_that_are_taken(capfd: pytest.CaptureFixture[str]) -> None:
    assert run("apply", "--help") == 0
    first, *others, last = sorted(lut_suffixes())
    assert f"{', '.join([first, *others])} or {last}." in " ".join(capfd.readouterr().out.split())


def test_several_images_of_one_name_are_refused(tmp_path: Path) -> None:
    sources = []
    for name in ("a", "b", "out"):
        (tmp_path / name).mkdir()
        sources.append(write(tmp_path / name / "in.png", np.zeros((8, 8, 3), np.uint8)))
    (tmp_path / "out" / "in.png").unlink()
    assert run("apply", *sources[:2], "--mode", MODE, "--hours", HOURS, "-o", tmp_path / "out") == 2
    assert not list((tmp_path / "out").iterdir())


def test_an_image_of_other_primaries_is_refused_unless_told(aged: AgedDisplay, tmp_path: Path) -> None:
    ap1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
    source = tmp_path / "in.exr"
    lib = oiio()
    spec = lib.ImageSpec(8, 8, 3, "half")
    spec.attribute("chromaticities", lib.TypeDesc("float[8]"), ap1)
    out = lib.ImageOutput.create(str(source))
    assert out.open(str(source), spec), out.geterror()
    assert out.write_image(np.full((8, 8, 3), 0.5, np.float16))
    assert out.close()
    with pytest.raises(LutgenError, match="primaries"):
        apply_to_image(source, tmp_path / "out.exr", aged)
    assert apply_to_image(source, tmp_path / "out.exr", aged, source="linear").encoding == "linear"


def test_no_library_speaks_when_the_process_ends(tmp_path: Path) -> None:
    source = cut("in.exr", 0.5)(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "lutgen", "apply", source, "--mode", MODE, "--hours", "10000", "-o", tmp_path / "o.exr"],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[1],
    )
    assert done.returncode == 2
    assert len((done.stdout + done.stderr).splitlines()) == 1


def test_the_output_says_which_age_it_shows_and_that_the_display_was_not_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write(tmp_path / "in.png", np.zeros((8, 8, 3), np.uint8))
    assert run("apply", source, "--mode", "chroma-luma", "--hours", "10000", "-o", tmp_path / "out.png") == 0
    first, second = capsys.readouterr().out.replace("\N{NO-BREAK SPACE}", " ").splitlines()
    assert ": chroma-luma at 10 000 h, 8 × 8, 0.00 % of the pixels" in first
    assert second == "This display is reconstructed, not measured."
