"""The syntax of .cube for Resolve, .csp, .spi3d, .3dl, Hald images and .ocioz, and files with false claims."""

import re
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check, check_lut
from lutgen.bake.fidelity import CERTIFIED, Budget, Judge
from lutgen.bake.formats import Provenance, format_named, format_names, lut_suffixes
from lutgen.bake.lut import Lut, Sampler
from lutgen.bake.readback import TableKind, apply_lut, table_kind
from lutgen.bake.spaces import SPACES, lattice
from lutgen.bake.table_picture import read_table
from lutgen.bindings import LARGEST_LUT, ocio
from lutgen.colorimetry import Array
from lutgen.display import AgedDisplay, AppliedEffect, DisplayModel, default_display
from lutgen.effects import catalogue
from lutgen.errors import LutgenError
from lutgen.lint import lint
from lutgen.pictures.engines import engine_for
from lutgen.readings import read_measurements
from tests.command import Done
from tests.quick import mostly_slow

PROVENANCE = Provenance("Aged display, chroma", "lutgen-chroma", ("lutgen: what it shows", "hours: 18000"))
SIZE = 17

#: A table of 17 points has a larger error than the budget for 33 points allows.
COARSE = Budget(max_delta_e=2.0, p99=1.0)


def model(**parameters: float) -> DisplayModel:
    leak = AppliedEffect.of(catalogue()["black-level"], {**NEUTRAL, **parameters})
    effects = (leak,) if parameters else ()
    return DisplayModel(read_measurements(default_display()), selection="continuous", effects=effects)


NEUTRAL = {"new": 0.0, "grown": 0.0, "power": 1.0, "saturation": 0.0, "tint_x": 0.0, "tint_z": 0.0}


@pytest.fixture(scope="module")
def aged() -> AgedDisplay:
    return model().at("chroma", 18_000)


def written(name: str, aged: AgedDisplay, folder: Path, *, candidate: int = 0, size: int = SIZE) -> Path:
    form = format_named(name)
    path = folder / form.file
    path.write_bytes(form.write(form.bake(Sampler(), aged, size)[candidate], PROVENANCE))
    return path


def at_nodes(aged: AgedDisplay, *, clip: bool = True) -> Array:
    """The model on the lattice with axes red, green, blue: shape (n, n, n, 3)."""
    axis = np.linspace(0, 1, SIZE)
    code = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    if clip:
        return aged.code_to_code(code)
    return SPACES["code"].held(aged.code_to_linear(code))


def test_spaces_there_and_back_are_the_same() -> None:
    code = np.random.default_rng(31).random((1000, 3))
    for space in SPACES.values():
        assert space.code(space.index(code)) == pytest.approx(code, abs=1e-12)
        assert (space.index(np.array([0.0, 1.0])) == [0.0, 1.0]).all()
    linear = np.random.default_rng(32).random((1000, 3))
    for name, space in SPACES.items():
        shown = space.shown(space.held(linear))
        assert shown == pytest.approx(SPACES["code"].held(linear), abs=1e-9), name


# Resolve's .cube


ROWS = rb"([01]\.[0-9]{7} [01]\.[0-9]{7} [01]\.[0-9]{7}\n)"


def test_a_cube_for_resolve_has_its_curve_first_and_no_title(aged: AgedDisplay, tmp_path: Path) -> None:
    data = written("resolve", aged, tmp_path, candidate=1).read_bytes()
    pattern = (
        rb"(#[^\n]*\n)+LUT_1D_SIZE 4096\nLUT_1D_INPUT_RANGE 0.0 1.0\nLUT_3D_SIZE 17\nLUT_3D_INPUT_RANGE 0.0 1.0\n"
        rb"%s{%d}" % (ROWS, 4096 + SIZE**3)
    )
    assert re.fullmatch(pattern, data)
    curve = np.array(data.split(b"INPUT_RANGE 0.0 1.0\n")[2].split()[: 4096 * 3], dtype=float).reshape(-1, 3)
    assert np.abs(curve - np.log2(1 + np.linspace(0, 1, 4096))[:, np.newaxis]).max() < 1e-7


def test_a_cube_for_resolve_whose_curve_would_be_straight_has_none_and_no_input_range(
    aged: AgedDisplay, tmp_path: Path
) -> None:
    """Readers that know no curves mistake the numbers of LUT_3D_INPUT_RANGE and a curve's rows for table rows."""
    path = written("resolve", aged, tmp_path, candidate=0)
    assert re.fullmatch(rb"(#[^\n]*\n)+LUT_3D_SIZE 17\n%s{%d}" % (ROWS, SIZE**3), path.read_bytes())
    report = lint(path, ask_readers=True)
    assert report.clean
    assert not report.findings
    plain = written("cube", aged, tmp_path)
    code = np.random.default_rng(34).random((500, 3))
    np.testing.assert_array_equal(apply_lut(path, code), apply_lut(plain, code))


def test_the_shaper_helps_where_black_leaks() -> None:
    aged = model(new=0.0015, grown=0.0015).at("chroma", 18_000)
    judge, largest = Judge(), {}
    for space in ("code", "shaped"):
        lut = judge.sampler.lut(aged, 33, space, clip=True)
        largest[space] = judge.compare(lut.apply(judge.code), aged, TableKind(space, 33, clipped=True)).smooth.max
    assert largest["shaped"] < 0.65 * largest["code"]


@pytest.mark.parametrize("name", ["resolve", "csp"])
def test_a_shaper_is_recognised(name: str, aged: AgedDisplay, tmp_path: Path) -> None:
    for candidate, space in enumerate(("code", "shaped")):
        path = written(name, aged, tmp_path, candidate=candidate)
        assert table_kind(path, clipped=True) == (space, SIZE, True)


# Order and numbers, read by a few plain lines for each format


def test_an_spi3d_says_its_indices(aged: AgedDisplay, tmp_path: Path) -> None:
    head, three, sizes, *rows = written("spi3d", aged, tmp_path).read_text().splitlines()
    assert (head, three, sizes) == ("SPILUT 1.0", "3 3", "17 17 17")
    model = at_nodes(aged, clip=False)
    values = np.array([row.split() for row in rows[: SIZE**3]], dtype=float)
    red, green, blue = values[:, :3].astype(int).T
    assert len({*zip(red, green, blue, strict=True)}) == SIZE**3
    assert np.abs(values[:, 3:] - model[red, green, blue]).max() < 6e-8
    assert rows[SIZE**3 :] == ["# Aged display, chroma", "# lutgen: what it shows", "# hours: 18000"]


def test_a_3dl_has_12_bit_and_blue_fastest(aged: AgedDisplay, tmp_path: Path) -> None:
    lines = [line for line in written("3dl", aged, tmp_path).read_text().splitlines() if not line.startswith("#")]
    assert lines[0].split() == [str(place * 64) for place in range(17)]
    values = np.array([line.split() for line in lines[1:]], dtype=int).reshape(SIZE, SIZE, SIZE, 3)
    away, unclipped = np.abs(values / 4095 - at_nodes(aged)), at_nodes(aged, clip=False)
    # The last nodes before the clip, along the channel's own axis, are raised by at most half an 8-bit code.
    fitted = np.zeros(away.shape, dtype=bool)
    for channel in range(3):
        own, before = (np.moveaxis(each[..., channel], channel, -1) for each in (unclipped, fitted))
        before[..., :-1] = (own[..., :-1] < 1) & (own[..., 1:] > 1)
    assert fitted.any()
    assert away[~fitted].max() <= 0.5001 / 4095
    assert away[fitted].max() <= 0.5 / 255 + 0.5001 / 4095


def test_a_3dl_that_readers_would_show_twice_as_bright_is_refused() -> None:
    class Dim:
        """A sampler of a display whose white has code value 0.4."""

        def candidates(self, *_: object, **__: object) -> list[Lut]:
            return [Lut("code", np.full((2, 2, 2, 3), 0.4))]

    aged = model().at("chroma-luma", 18_000)
    with pytest.raises(LutgenError, match=r"a \.3dl cannot hold a display whose brightest code value is 40 %"):
        format_named("3dl").bake(Dim(), aged, 17)  # type: ignore[arg-type]


def test_a_csp_has_red_fastest_behind_three_curves(aged: AgedDisplay, tmp_path: Path) -> None:
    text = written("csp", aged, tmp_path).read_text()
    head, rest = text.split("END METADATA\n\n")
    assert head.startswith("CSPLUTV100\n3D\n\nBEGIN METADATA\n# Aged display, chroma\n")
    numbers = rest.split()
    assert numbers[:15] == ["2", "0.0000000", "1.0000000", "0.0000000", "1.0000000"] * 3
    assert numbers[15:18] == ["17"] * 3
    values = np.array(numbers[18:], dtype=float).reshape(SIZE, SIZE, SIZE, 3).transpose(2, 1, 0, 3)
    assert np.abs(values - at_nodes(aged, clip=False)).max() < 6e-8


# Hald


@pytest.mark.parametrize(("size", "side"), [(17, 64), (33, 216), (65, 512)])
def test_a_hald_is_an_untagged_png_of_16_bit_that_pillow_reads(
    size: int, side: int, aged: AgedDisplay, tmp_path: Path
) -> None:
    from PIL import Image

    path = written("hald", aged, tmp_path, size=size)
    data = path.read_bytes()
    # Width, height, depth and colour type of IHDR: colour type 2 is RGB.
    assert struct.unpack_from(">II2B", data, 16) == (side, side, 16, 2)
    with Image.open(path) as image:
        assert image.size == (side, side)
        assert not {"icc_profile", "gamma", "srgb", "chromaticity"} & set(image.info)
        assert image.info["Title"] == PROVENANCE.title
        top = np.asarray(image.convert("RGB")).reshape(-1, 3)
    points = round(side ** (2 / 3))
    model = aged.code_to_code(lattice(points, "code"))
    # Pillow keeps the upper byte of each 16-bit number.
    assert np.abs(top - np.floor(model * 65_535 / 256)).max() <= 1


def test_the_picture_for_obs_has_a_tile_for_each_step_of_blue(aged: AgedDisplay, tmp_path: Path) -> None:
    """The layout of OBS' filter: eight tiles a row, red to the right, green downwards, 8 bit."""
    from PIL import Image

    path = written("obs", aged, tmp_path)
    assert struct.unpack_from(">II2B", path.read_bytes(), 16) == (512, 512, 8, 2)
    with Image.open(path) as image:
        assert not {"icc_profile", "gamma", "srgb", "chromaticity"} & set(image.info)
        assert image.info["Title"] == PROVENANCE.title
        pixels = np.asarray(image)
    for red, green, blue in ((0, 0, 0), (63, 0, 0), (0, 63, 0), (0, 0, 63), (5, 20, 9), (63, 63, 63)):
        row, tile = divmod(blue, 8)
        expected = aged.code_to_code(np.array([red, green, blue]) / 63) * 255
        assert pixels[64 * row + green, 64 * tile + red] == pytest.approx(expected, abs=0.5001)


def mixed(code: Array) -> Array:
    """Colours that depend on all channels."""
    return np.asarray(np.clip(code @ np.array([[0.2, 0.5, 0.0], [0.1, 0.4, 0.6], [0.7, 0.0, 0.4]]), 0, 1))


@pytest.mark.parametrize(
    "change",
    mostly_slow([np.array, np.sqrt, lambda code: 1 - code, lambda code: code[:, ::-1], mixed], np.sqrt, mixed),
)
def test_the_two_layouts_of_512_pixels_are_told_apart_by_their_pixels(
    change: Callable[[Array], Array], tmp_path: Path
) -> None:
    lut, path = Lut("code", change(lattice(64, "code")).reshape(64, 64, 64, 3)), tmp_path / "table.png"
    code = np.random.default_rng(35).random((500, 3))
    for name, tiles, limit in (("obs", True, 0.51 / 255), ("hald", False, 1e-5)):
        path.write_bytes(format_named(name).write(lut, PROVENANCE))
        assert read_table(path)[1] == tiles
        assert np.abs(apply_lut(path, code) - lut.apply(code)).max() < limit


@pytest.mark.parametrize("shape", [(64, 63, 3), (60, 60, 3), (64, 64, 1), (1, 1, 3)])
def test_a_picture_that_is_no_hald_is_a_clear_error(shape: tuple[int, int, int], tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "picture.png"
    Image.fromarray(np.zeros(shape, np.uint8).squeeze()).save(path) if shape != (1, 1, 3) else Image.new(
        "RGB", (1, 1)
    ).save(path)
    with pytest.raises(LutgenError, match="is no Hald image"):
        apply_lut(path, np.zeros((1, 3)))


def png(width: int, height: int, rows: bytes) -> bytes:
    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


# Archives


def test_an_archive_holds_a_config_and_its_table_without_dates(aged: AgedDisplay, tmp_path: Path) -> None:
    path = written("ocioz", aged, tmp_path)
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["config.ocio", "lut.clf"]
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        form = format_named("clf")
        assert archive.read("lut.clf") == form.write(form.bake(Sampler(), aged, SIZE)[0], PROVENANCE)


def test_opencolorio_opens_an_archive_where_it_can(aged: AgedDisplay, tmp_path: Path) -> None:
    lib = ocio()
    path = written("ocioz", aged, tmp_path)
    if not hasattr(lib, "ExtractOCIOZArchive"):
        pytest.skip(f"OpenColorIO {lib.__version__} reads no archives; 2.2 does")
    config = lib.Config.CreateFromFile(str(path))
    config.validate()
    processor = config.getProcessor(lib.DisplayViewTransform("Source signal", "sRGB", "Aged"))
    code = np.random.default_rng(33).random((500, 3))
    shown = code.astype(np.float32)
    processor.getDefaultCPUProcessor().applyRGB(shown)
    assert np.abs(np.clip(shown, 0, 1) - aged.code_to_code(code)).max() < 1e-4


def test_an_archive_that_unpacks_to_more_than_any_lut_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.ocioz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("config.ocio", "x")
        with archive.open("lut.clf", "w") as entry:
            for _ in range(LARGEST_LUT // 1_000_000 + 1):
                entry.write(bytes(1_000_000))
    assert path.stat().st_size < 200_000
    with pytest.raises(LutgenError, match=r"unpacks to \d+ MB, more than any LUT"):
        apply_lut(path, np.zeros((1, 3)))


@pytest.mark.parametrize("names", [(), ("config.ocio",), ("lut.clf",), ("../config.ocio", "lut.clf")])
def test_an_archive_without_its_two_files_is_a_clear_error(names: tuple[str, ...], tmp_path: Path) -> None:
    held = BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        for name in names:
            archive.writestr(name, "nothing")
    path = tmp_path / "wrong.ocioz"
    path.write_bytes(held.getvalue())
    with pytest.raises(LutgenError, match=r"is no archive with config\.ocio and lut\.clf"):
        apply_lut(path, np.zeros((1, 3)))


# False claims

CONTENT = b"".join(b"%d " % number for number in range(500))
PACKED = zlib.compress(CONTENT)[2:-4]


def archive() -> bytes:
    """An archive with the file names of lutgen's archives."""
    data = BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as file:
        for name in ("config.ocio", "lut.clf"):
            file.writestr(name, CONTENT)
    return data.getvalue()


#: File name, content, and the expected words of the error.
LIES = {
    "empty.cube": (b"", "is empty"),
    "claims.cube": (b"LUT_3D_SIZE 100000\n0 0 0\n", "claims 100000 points in 3D; OpenColorIO takes at most 129"),
    "claims-more.cube": (b"LUT_3D_SIZE 9" + b"0" * 9000 + b"\n0 0 0\n", "claims 900000000000 points in 3D"),
    "claims-a-curve.cube": (b"LUT_1D_SIZE 2147483647\nLUT_3D_SIZE 2\n0 0 0\n", "claims 2147483647 points in 1D"),
    "short.cube": (b"LUT_3D_SIZE 129\n0 0 0\n", "cannot read it"),
    "claims.spi3d": (b"SPILUT 1.0\n3 3\n100000 100000 100000\n0 0 0 0 0 0\n", "cannot read it"),
    "claims.csp": (b"CSPLUTV100\n3D\n\n" + b"2\n0 1\n0 1\n" * 3 + b"\n100000 100000 100000\n0 0 0\n", "cannot read it"),
    "claims-a-prelut.csp": (b"CSPLUTV100\n3D\n\n2147483647\n0 1\n0 1\n", "cannot read it"),
    "short.3dl": (b"0 64 128 192 256\n0 0 0\n4095 4095 4095\n", "cannot read it"),
    "claims.clf": (
        b'<ProcessList id="a" compCLFversion="3.0"><LUT3D inBitDepth="32f" outBitDepth="32f">%s</LUT3D></ProcessList>'
        % b'<Array dim="100000 100000 100000 3">0 0 0</Array>',
        "cannot read it",
    ),
}
OF_OTHERS = {
    "empty.png": (b"", "is empty"),
    # Older versions of OpenImageIO can open the file, but then it is no Hald image.
    "claims.png": (png(100_000, 100_000, b""), "claims.png: "),
    "claims-hald.png": (png(512, 512, b"\0" * 100), "cannot read all of it"),
    "empty.icc": (b"", "is empty"),
    "empty.ocioz": (b"", "is empty"),
    "none.ocioz": (b"PK\x03\x04 and no more", "is no archive"),
    "damaged.ocioz": (archive().replace(PACKED[:20], b"\xff" * 20), "is no archive"),
    "elsewhere.ocioz": (archive()[:-6] + (10_000).to_bytes(4, "little") + b"\0\0", "is no archive"),
}


@pytest.mark.parametrize("name", LIES | OF_OTHERS)
def test_a_file_that_lies_is_a_clear_error(name: str, tmp_path: Path) -> None:
    content, says = (LIES | OF_OTHERS)[name]
    path = tmp_path / name
    path.write_bytes(content)
    for call in (lambda: apply_lut(path, np.zeros((1, 3))), lambda: table_kind(path, clipped=True)):
        with pytest.raises(LutgenError, match=re.escape(says)) as error:
            call()
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", LIES)
def test_apply_refuses_it_and_writes_nothing(name: str, lutgen: Callable[..., Done], tmp_path: Path) -> None:
    from PIL import Image

    path, image = tmp_path / name, tmp_path / "image.png"
    path.write_bytes(LIES[name][0])
    Image.new("RGB", (4, 4)).save(image)
    before = sorted(tmp_path.iterdir())
    done = lutgen("apply", str(image), "--lut", str(path), "-o", str(tmp_path / "out.png"))
    assert done.code == 2
    assert LIES[name][1] in " ".join(done.err.split())
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("suffix", sorted({*lut_suffixes(), ".icc", ".png", ".ocioz"}))
def test_a_file_of_a_gigabyte_is_refused_unread(suffix: str, aged: AgedDisplay, tmp_path: Path) -> None:
    path = tmp_path / f"huge{suffix}"
    with path.open("wb") as file:
        file.truncate(1_000_000_000)
    with pytest.raises(LutgenError, match="has 1000 MB, and a LUT has at most 100 MB"):
        check_lut(path, aged)
    if suffix in lut_suffixes():
        with pytest.raises(LutgenError, match="has 1000 MB"):
            engine_for(path)


# The commands


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("formats") / "built"
    build(
        model(), BuildPlan((18_000.0,), modes=("chroma",), formats=tuple(format_names()), cubesize=17), folder, jobs=1
    )
    return folder


def test_a_build_of_every_format_is_certified_and_checked(built: Path) -> None:
    result = check(built, budget=COARSE, jobs=1)
    assert result.passed, result.findings
    assert len(result.certificates) == len(format_names())
    for path, certificate in result.certificates.items():
        # In a clipped table the cells before the clip belong to the gamut group.
        assert certificate.smooth.colours > 0.55 * sum(CERTIFIED), path
        assert certificate.smooth.max < 2.0, path


@pytest.mark.parametrize("name", mostly_slow(format_names(), "cube", "icc", "spi3d", "hald"))
def test_a_file_of_another_hour_fails_the_check(name: str, built: Path, lutgen: Callable[..., Done]) -> None:
    path = built / "chroma/18000h" / format_named(name).file
    display = ("--mode", "chroma", "--selection", "continuous")
    budget = ("--max-delta-e", f"{COARSE.max_delta_e}", "--p99", f"{COARSE.p99}")
    assert lutgen("check", str(path), *display, "--hours", "18000", *budget).code == 0
    done = lutgen("check", str(path), *display, "--hours", "0", *budget)
    assert done.code == 1
    assert "over the budget" in done.out


def test_a_profile_without_a_table_is_held_to_its_own_certificate(lutgen: Callable[..., Done], tmp_path: Path) -> None:
    folder = tmp_path / "built"
    options = ("--hours", "18000", "--mode", "chroma", "--selection", "continuous", "--jobs", "1")
    assert lutgen("build", *options, "--format", "icc-matrix", "-o", str(folder)).code == 0
    assert lutgen("check", str(folder)).code == 0
    done = lutgen("check", str(folder), "--max-delta-e", "1")
    assert done.code == 1
    assert "over the budget of 1 (--max-delta-e)" in done.out
    # A single file has no certificate, so the usual budget applies.
    profile = folder / "chroma/18000h/aged-matrix.icc"
    assert lutgen("check", str(profile), "--mode", "chroma", "--hours", "18000").code == 1
    manifest = folder / "manifest.json"
    text = manifest.read_text()
    certified = re.search(r'"smooth": \{[^}]*"max": ([0-9.]+)', text)
    assert certified
    manifest.write_text(text.replace(certified[1], "0.5"))
    assert "worse than certified" in lutgen("check", str(folder)).out


def test_a_build_that_opencolorio_cannot_read_has_no_configs(lutgen: Callable[..., Done], tmp_path: Path) -> None:
    options = ("--hours", "18000", "--mode", "chroma", "--cubesize", "17", "--jobs", "1")
    done = lutgen("build", *options, "--format", "icc,hald", "-o", str(tmp_path / "built"))
    assert done.code == 0, done.err
    assert "2 LUTs and 0 configs" in done.out
    assert not [*(tmp_path / "built").rglob("*.ocio")]
    assert check(tmp_path / "built", budget=COARSE, jobs=1).passed


def test_profiles_without_the_binding_are_made_uncertified_or_refused(
    lutgen: Callable[..., Done], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "imagecodecs", None)
    # This hour occurs nowhere else, because a certificate stays valid within one process.
    options = ("--hours", "12345", "--mode", "chroma", "--cubesize", "17", "--jobs", "1", "--format", "icc")
    done = lutgen("build", *options, "-o", str(tmp_path / "refused"))
    assert done.code == 2
    assert "pip install lutgen[icc]" in " ".join(done.err.split())
    assert not [*(tmp_path / "refused").rglob("*.icc")]
    assert lutgen("build", *options, "--no-certificates", "-o", str(tmp_path / "made")).code == 0
    assert (tmp_path / "made/chroma/12345h/aged.icc").stat().st_size > 20_000


@pytest.mark.parametrize("name", [name for name in format_names() if format_named(name).reader is None])
def test_apply_takes_any_built_table_that_opencolorio_reads(
    name: str, built: Path, lutgen: Callable[..., Done], tmp_path: Path
) -> None:
    from PIL import Image

    only, form = tmp_path / "built/chroma/18000h", format_named(name)
    only.mkdir(parents=True)
    (only / form.file).write_bytes((built / "chroma/18000h" / form.file).read_bytes())
    image, output = tmp_path / "white.png", tmp_path / "out.png"
    Image.new("RGB", (2, 2), "white").save(image)
    which = ("--build", str(tmp_path / "built"), "--mode", "chroma", "--hours", "18000")
    done = lutgen("apply", str(image), *which, "-o", str(output))
    assert done.code == 0, done.err
    white = model().at("chroma", 18_000).code_to_code(np.ones(3)) * 255
    with Image.open(output) as shown:
        assert np.asarray(shown)[0, 0] == pytest.approx(white, abs=0.6)
    assert form.suffix in lut_suffixes()
