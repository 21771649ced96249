"""``icc-matrix``: white in LittleCMS where ``icc`` keeps it un-aged, and how far a matrix is from the display."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.littlecms import ABSOLUTE, PERCEPTUAL, RELATIVE, SATURATION
from lutgen.bake.lut import Lut, MatrixLut, Sampler
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab
from lutgen.display import DisplayModel, default_display
from lutgen.measurements import read_measurements
from tests.consumers import Unavailable, program, read_image, write_image

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay

PROVENANCE = Provenance("Aged display, chroma", "lutgen-chroma", ("lutgen: what it shows", "hours: 18000"))


@pytest.fixture(scope="module")
def aged() -> AgedDisplay:
    return DisplayModel(read_measurements(default_display()), selection="continuous").at("chroma-luma", 18_000)


@pytest.fixture(scope="module")
def files(aged: AgedDisplay, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("white")
    for name in ("icc", "icc-matrix"):
        form = format_named(name)
        (folder / form.file).write_bytes(form.write(form.bake(Sampler(), aged, 33)[0], PROVENANCE))
    return {name: folder / format_named(name).file for name in ("icc", "icc-matrix")}


@pytest.mark.parametrize("mode", ["chroma", "chroma-luma"])
@pytest.mark.parametrize(("name", "kept"), [("icc", False), ("icc-matrix", True)])
def test_littlecms_shows_white_as_the_display_does_where_there_is_no_table(
    name: str, mode: str, *, kept: bool, tmp_path: Path
) -> None:
    """README warns of it: with whole numbers, a table's white is set on white, unless it is told not to."""
    from PIL import Image, ImageCms

    aged = DisplayModel(read_measurements(default_display()), selection="continuous").at(mode, 18_000)
    form = format_named(name)
    path = tmp_path / form.file
    path.write_bytes(form.write(form.bake(Sampler(), aged, 33)[0], PROVENANCE))
    white, srgb = Image.new("RGB", (1, 1), "white"), ImageCms.createProfile("sRGB")
    model = aged.code_to_code(np.ones(3)) * 255

    def shown(intent: int, flags: ImageCms.Flags) -> Array:
        way = ImageCms.buildTransform(str(path), srgb, "RGB", "RGB", ImageCms.Intent(intent), flags)
        pixels = np.asarray(ImageCms.applyTransform(white, way), dtype=np.float64)
        return np.asarray(pixels[0, 0])

    for intent in (PERCEPTUAL, RELATIVE):
        assert shown(intent, ImageCms.Flags.NONE) == pytest.approx(model if kept else [255] * 3, abs=0.6)
    assert shown(RELATIVE, ImageCms.Flags.NOOPTIMIZE) == pytest.approx(model, abs=1)
    assert shown(ABSOLUTE, ImageCms.Flags.NONE) == pytest.approx(model, abs=1)


def tificc(profile: Path, depth: int, intent: int, folder: Path) -> Array:
    """White of a picture of 8 or 16 bit, as LittleCMS' own program converts it to the same, in 0..1."""
    try:
        tool = program("tificc", "liblcms2-utils")
    except Unavailable as reason:
        pytest.skip(str(reason))
    source, result = folder / "white.tif", folder / "shown.tif"
    white = np.full((8, 8, 3), 2**depth - 1)
    write_image(source, white.astype(np.uint8) if depth == 8 else white.astype(np.uint16))
    options = (f"-w{depth}", f"-t{intent}", f"-i{profile}", "-o*sRGB")
    subprocess.run([tool, *options, source, result], check=True, capture_output=True, timeout=60)
    return np.asarray(read_image(result)[0, 0] / white[0, 0])


@pytest.mark.parametrize("intent", [PERCEPTUAL, RELATIVE, SATURATION, ABSOLUTE])
def test_littlecms_own_program_shows_white_without_a_table_in_8_bit(
    intent: int, aged: AgedDisplay, files: dict[str, Path], tmp_path: Path
) -> None:
    model = aged.code_to_code(np.ones(3))
    assert tificc(files["icc-matrix"], 8, intent, tmp_path) == pytest.approx(model, abs=0.6 / 255)


def test_at_16_bit_littlecms_shows_white_in_absolute_terms_alone(
    aged: AgedDisplay, files: dict[str, Path], tmp_path: Path
) -> None:
    """README says so: 16-bit pictures are resampled, without a table too."""
    for name in ("icc", "icc-matrix"):
        assert tificc(files[name], 16, RELATIVE, tmp_path) == pytest.approx([1.0] * 3)
        absolute = tificc(files[name], 16, ABSOLUTE, tmp_path)
        assert absolute == pytest.approx(aged.code_to_code(np.ones(3)), abs=1e-3)


@pytest.mark.parametrize("selection", ["nearest", "continuous"])
@pytest.mark.parametrize("mode", ["chroma", "chroma-luma"])
def test_the_matrix_errs_by_as_much_as_the_readme_says(selection: str, mode: str) -> None:
    """And no matrix that shows the primaries instead, scaled to white, errs less."""
    aged = DisplayModel(read_measurements(default_display()), selection=selection).at(mode, 18_000)
    (lut,) = format_named("icc-matrix").bake(Sampler(), aged, 33)
    code = np.random.default_rng(31).random((4000, 3))
    aim = linear_to_lab(np.clip(aged.code_to_linear(code), 0, 1))
    *primaries, white = aged.code_to_linear(np.vstack([np.eye(3), np.ones(3)]))
    columns = np.transpose(primaries)
    scaled = columns * np.linalg.solve(columns, white)

    def error(matrix: Array) -> Array:
        return delta_e_2000(aim, linear_to_lab(np.clip(code_to_linear(code) @ matrix.T, 0, 1)))

    assert isinstance(lut, MatrixLut)
    assert np.quantile(error(lut.matrix), 0.99) < 1.0
    assert (error(lut.matrix) ** 2).mean() < 0.95 * (error(scaled) ** 2).mean()


def test_a_display_that_is_a_matrix_is_kept_as_it_is() -> None:
    fresh = DisplayModel(read_measurements(default_display())).at("stable", 0)
    (lut,) = format_named("icc-matrix").bake(Sampler(), fresh, 33)
    assert isinstance(lut, MatrixLut)
    # Steps of 1/65536 in XYZ, through the inverse matrix.
    assert lut.matrix == pytest.approx(np.eye(3), abs=5e-5)


def test_a_matrix_is_no_table() -> None:
    with pytest.raises(TypeError, match="holds a matrix"):
        format_named("icc-matrix").write(Lut("code", np.zeros((2, 2, 2, 3))), PROVENANCE)
