"""ICC profiles and device links: their bytes by the standard, and the values that LittleCMS reads.

``make consumers`` tests Argyll, LittleCMS' own programs and Chromium.
"""

import hashlib
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lutgen.bake.fidelity import tissue_colours
from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.formats.icc import nearest_colorants
from lutgen.bake.littlecms import ABSOLUTE, PERCEPTUAL, RELATIVE, SATURATION, through_profile
from lutgen.bake.lut import MatrixLut, Sampler, table_of
from lutgen.bake.readback import apply_lut, table_kind
from lutgen.bake.spaces import lab_held_to_xyz_d50, xyz_d50_to_linear
from lutgen.colorimetry import D65, Array, code_to_linear, linear_to_code, linear_to_xyz
from lutgen.display import AgedDisplay, DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.readings import read_measurements

pytestmark = pytest.mark.numbers

PROVENANCE = Provenance("Aged display, chroma", "lutgen-chroma", ("lutgen: what it shows", "hours: 18000"))
NAMES = ("icc", "icc-v2", "icc-matrix", "devicelink")
INTENTS = (PERCEPTUAL, RELATIVE, SATURATION, ABSOLUTE)


@pytest.fixture(scope="module")
def aged() -> AgedDisplay:
    return DisplayModel(read_measurements(default_display()), selection="continuous").at("chroma-luma", 18_000)


@pytest.fixture(scope="module")
def files(aged: AgedDisplay, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("icc")
    for name in NAMES:
        form = format_named(name)
        (folder / form.file).write_bytes(form.write(form.bake(Sampler(), aged, 33)[0], PROVENANCE))
    return {name: folder / format_named(name).file for name in NAMES}


@pytest.fixture(scope="module")
def code() -> Array:
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    return np.concatenate([corners, np.random.default_rng(21).random((40, 3))])


def tags_of(data: bytes) -> dict[str, bytes]:
    (count,) = struct.unpack_from(">I", data, 128)
    rows = [struct.unpack_from(">4sII", data, 132 + 12 * row) for row in range(count)]
    assert all(start % 4 == 0 and start >= 132 + 12 * count for _, start, _ in rows)
    return {name.decode(): data[start : start + size] for name, start, size in rows}


@pytest.mark.parametrize(
    ("name", "device_class", "space", "tags"),
    [
        ("icc", b"mntr", b"Lab ", "desc cprt targ wtpt chad rXYZ gXYZ bXYZ rTRC gTRC bTRC A2B0"),
        ("icc-v2", b"mntr", b"Lab ", "desc cprt targ wtpt chad rXYZ gXYZ bXYZ rTRC gTRC bTRC A2B0"),
        ("icc-matrix", b"mntr", b"XYZ ", "desc cprt targ wtpt chad rXYZ gXYZ bXYZ rTRC gTRC bTRC"),
        ("devicelink", b"link", b"RGB ", "desc cprt targ pseq A2B0"),
    ],
)
def test_a_profile_is_what_the_standard_says(
    name: str, device_class: bytes, space: bytes, tags: str, files: dict[str, Path]
) -> None:
    data = files[name].read_bytes()
    assert struct.unpack_from(">I", data) == (len(data),)
    assert data[8:12] == bytes([4, 0x30, 0, 0] if name == "icc" else [2, 0x40, 0, 0])
    assert (data[12:16], data[16:20], data[20:24], data[36:40]) == (device_class, b"RGB ", space, b"acsp")
    # The standard's own D50: every profile has these bytes (ICC.1, 7.2.16).
    assert data[68:80].hex() == "0000f6d6000100000000d32d"
    by_signature = tags_of(data)
    assert list(by_signature) == tags.split()
    assert all(struct.unpack_from(">I", content, 4) == (0,) for content in by_signature.values())
    blank = data[:44] + bytes(4) + data[48:64] + bytes(4) + data[68:84] + bytes(16) + data[100:]
    assert data[84:100] == hashlib.md5(blank, usedforsecurity=False).digest()


def test_a_table_has_blue_fastest_and_16_bit_in_big_endian(aged: AgedDisplay) -> None:
    form = format_named("devicelink")
    (lut,) = form.bake(Sampler(), aged, 17)
    table = tags_of(form.write(lut, PROVENANCE))["A2B0"]
    assert table[:12] == b"mft2" + bytes(4) + bytes([3, 3, 17, 0])
    assert struct.unpack_from(">HH", table, 48) == (2, 2)
    values = np.frombuffer(table, ">u2", 17**3 * 3, 52 + 12).reshape(17, 17, 17, 3)
    for red, green, blue in ((0, 0, 16), (16, 0, 0), (3, 5, 7)):
        expected = aged.code_to_code(np.array([red, green, blue]) / 16) * 65_535
        assert values[red, green, blue] == pytest.approx(expected, abs=0.5)


def test_a_table_of_version_4_lies_between_straight_curves(aged: AgedDisplay) -> None:
    """ICC.1:2010, 10.10: A curves, table, B curves; no matrix, no M curves; steps of L*a*b* as in 6.3.4.2."""
    form = format_named("icc")
    (lut,) = form.bake(Sampler(), aged, 17)
    table = tags_of(form.write(lut, PROVENANCE))["A2B0"]
    assert table[:12] == b"mAB " + bytes(4) + bytes([3, 3, 0, 0])
    b_curves, matrix, m_curves, clut, a_curves = struct.unpack_from(">5I", table, 12)
    assert matrix == m_curves == 0
    straight = (b"curv" + bytes(8)) * 3
    assert table[b_curves : b_curves + 36] == table[a_curves:] == straight
    assert table[clut : clut + 20] == bytes([17, 17, 17] + [0] * 13 + [2, 0, 0, 0])
    assert a_curves % 4 == 0
    values = np.frombuffer(table, ">u2", 17**3 * 3, clut + 20).reshape(17, 17, 17, 3)
    for red, green, blue in ((0, 0, 16), (16, 0, 0), (3, 5, 7), (16, 16, 16)):
        lab = lab_of(aged.code_to_linear(np.array([red, green, blue]) / 16))
        assert values[red, green, blue] == pytest.approx(np.add(lab, [0, 128, 128]) / [100, 255, 255] * 65_535, abs=3)


def test_the_words_of_a_profile_of_version_4_are_unicode(aged: AgedDisplay) -> None:
    form = format_named("icc")
    data = form.write(form.bake(Sampler(), aged, 17)[0], Provenance("Büro 显示器", "lutgen", ("lutgen: words",)))
    described = tags_of(data)["desc"]
    assert described[:28] == b"mluc" + struct.pack(">4xII4sII", 1, 12, b"enUS", 16, 28)
    assert described[28:].decode("utf-16-be") == "Büro 显示器"


def test_both_versions_hold_the_same_colours(files: dict[str, Path], code: Array) -> None:
    for intent in INTENTS:
        shown = [np.clip(through_profile(files[name], code, intent=intent), 0, 1) for name in ("icc", "icc-v2")]
        assert np.abs(shown[0] - shown[1]).max() < 8.5e-4


def test_the_matrix_beside_a_table_shows_its_white_and_is_nearer_than_its_primaries(aged: AgedDisplay) -> None:
    """Programs without tables use the matrix. Chromium uses the matrix if it hardly differs from the table."""
    (lut,) = format_named("icc").bake(Sampler(), aged, 17)
    xyz = lab_held_to_xyz_d50(table_of(lut))
    fitted, corners = nearest_colorants(xyz), np.array([xyz[0, 0, -1], xyz[0, -1, 0], xyz[-1, 0, 0]])
    assert fitted.sum(axis=0) == pytest.approx(xyz[-1, -1, -1], abs=1e-12)
    code = tissue_colours(np.random.default_rng(23), 2000)
    errors = []
    for colorants in (fitted, corners):
        shown = linear_to_code(np.clip(code_to_linear(code) @ xyz_d50_to_linear(colorants), 0, 1))
        errors.append(np.abs(shown - aged.code_to_code(code)).mean())
    assert errors[0] < 0.75 * errors[1]


@pytest.mark.parametrize("name", ["icc", "icc-v2"])
def test_every_intent_shows_the_aged_white_and_the_model(
    name: str, aged: AgedDisplay, files: dict[str, Path], code: Array
) -> None:
    model = aged.code_to_code(code)
    for intent in INTENTS:
        shown = np.clip(through_profile(files[name], code, intent=intent), 0, 1)
        assert np.abs(shown - model).max() < 3e-3
        white = shown[(code == 1).all(axis=1)]
        assert white == pytest.approx(aged.code_to_code(np.ones((1, 3))), abs=5e-4)
        assert white.max() < 0.71


def test_a_profile_whose_white_is_the_aged_one_would_show_no_aging_of_white(aged: AgedDisplay, tmp_path: Path) -> None:
    """The reason for the profile's form: LittleCMS' own description of a display loses the aging of white."""
    import imagecodecs

    x, y, z = linear_to_xyz(aged.code_to_linear(np.ones(3)))
    primaries = [0.64, 0.33, 1.0, 0.30, 0.60, 1.0, 0.15, 0.06, 1.0]
    white = [x / (x + y + z), y / (x + y + z), 1.0]
    path = tmp_path / "usual.icc"
    path.write_bytes(imagecodecs.cms_profile("rgb", whitepoint=white, primaries=primaries, gamma=2.2))
    assert through_profile(path, np.ones((1, 3))) == pytest.approx(np.ones((1, 3)), abs=1e-3)


def test_littlecms_gives_what_a_literal_reading_of_the_profile_gives(files: dict[str, Path], code: Array) -> None:
    """CIE's formulas for single numbers, and colour-science's adaptation, from the bytes of the file."""
    import colour

    table = tags_of(files["icc-v2"].read_bytes())["A2B0"]
    held = np.frombuffer(table, ">u2", 33**3 * 3, 52 + 12).reshape(33, 33, 33, 3)
    d50 = np.array([0.9642, 1.0, 0.8249])
    on_nodes = np.rint(code * 32).astype(int)
    light = []
    for red, green, blue in on_nodes:
        lightness, a, b = held[red, green, blue] / np.array([652.8, 256.0, 256.0]) - np.array([0.0, 128.0, 128.0])
        middle = (lightness + 16) / 116
        ratios = [
            f**3 if f > 6 / 29 else 3 * (6 / 29) ** 2 * (f - 4 / 29)
            for f in (middle + a / 500, middle, middle - b / 200)
        ]
        light.append(ratios * d50)
    xyz = colour.adaptation.chromatic_adaptation_VonKries(np.array(light), d50, D65, transform="Bradford")
    expected = colour.XYZ_to_RGB(xyz, "sRGB", apply_cctf_encoding=True)
    shown = through_profile(files["icc-v2"], on_nodes / 32)
    # colour-science's matrix has the four decimals of IEC 61966-2-1.
    assert np.abs(np.clip(shown, 0, 1) - np.clip(expected, 0, 1)).max() < 2e-3


def test_littlecms_computes_the_same_matrix_and_its_white_is_the_models(
    aged: AgedDisplay, files: dict[str, Path], code: Array
) -> None:
    (lut,) = format_named("icc-matrix").bake(Sampler(), aged, 33)
    assert isinstance(lut, MatrixLut)
    expected = lut.apply(code)
    for intent in INTENTS:
        shown = through_profile(files["icc-matrix"], code, intent=intent)
        assert np.abs(np.clip(shown, 0, 1) - np.clip(expected, 0, 1)).max() < 8.5e-4
    assert lut.apply(np.ones((1, 3)))[0] == pytest.approx(aged.code_to_code(np.ones(3)), abs=5e-5)


def shortened(data: bytes) -> bytes:
    return data[:-1000]


def with_tags(count: int) -> Callable[[bytes], bytes]:
    return lambda data: data[:128] + struct.pack(">I", count) + data[132:]


def with_tag(offset: int, size: int) -> Callable[[bytes], bytes]:
    return lambda data: data[:136] + struct.pack(">II", offset, size) + data[144:]


def with_grid(points: int) -> Callable[[bytes], bytes]:
    def change(data: bytes) -> bytes:
        place = data.index(b"mft2") + 10 if b"mft2" in data else data.index(b"mAB ") + 68
        return data[:place] + bytes([points]) + data[place + 1 :]

    return change


#: The fault, a function that makes the fault, and the words of the error.
LIES: list[tuple[str, Callable[[bytes], bytes], str]] = [
    ("it is empty", lambda _: b"", "is empty"),
    ("it is no profile", lambda _: b"not a profile", "is no ICC profile"),
    ("it is cut off", shortened, "says that it has"),
    ("it has 4 thousand million tags", with_tags(2**32 - 1), "claims 4294967295 tags"),
    ("a tag begins beyond its end", with_tag(2**31, 100), "lies outside the file"),
    ("a tag is longer than the file", with_tag(400, 2**31), "lies outside the file"),
    ("its table is larger than the file", with_grid(255), "LittleCMS cannot use it"),
    ("its table has one point", with_grid(1), "LittleCMS cannot use it"),
    ("it is for a printer", lambda data: data[:16] + b"CMYK" + data[20:], "displays are RGB"),
]


@pytest.mark.parametrize("name", ["icc", "icc-v2", "devicelink"])
@pytest.mark.parametrize(("change", "says"), [lie[1:] for lie in LIES], ids=[fault for fault, _, _ in LIES])
def test_a_profile_that_lies_is_a_clear_error(
    name: str, change: Callable[[bytes], bytes], says: str, files: dict[str, Path], tmp_path: Path
) -> None:
    path = tmp_path / "lies.icc"
    path.write_bytes(change(files[name].read_bytes()))
    with pytest.raises(LutgenError, match=says) as error:
        apply_lut(path, np.zeros((1, 3)))
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_the_kind_of_others_profiles_is_found(files: dict[str, Path], tmp_path: Path) -> None:
    import imagecodecs

    assert table_kind(files["icc"], clipped=False) == ("lab", 33, False)
    assert table_kind(files["icc-v2"], clipped=False) == ("lab-v2", 33, False)
    assert table_kind(files["devicelink"], clipped=True) == ("code", 33, True)
    plain = tmp_path / "srgb.icc"
    plain.write_bytes(imagecodecs.cms_profile("srgb"))
    assert table_kind(plain, clipped=True) == ("linear", 0, True)
    assert apply_lut(plain, np.full((1, 3), 0.4)) == pytest.approx(np.full((1, 3), 0.4), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "steps"), [("icc", [655.35, 257, 257]), ("icc-v2", [652.8, 256, 256])], ids=["version 4", "version 2"]
)
def test_the_profiles_table_holds_what_was_baked(name: str, steps: list[float], aged: AgedDisplay) -> None:
    (lut,) = format_named(name).bake(Sampler(), aged, 17)
    numbers = table_of(lut) * 65_535
    assert np.abs(numbers - np.rint(numbers)).max() < 1e-9
    # White in 16-bit L*a*b*.
    lab = lab_of(aged.code_to_linear(np.ones(3)))
    assert numbers[-1, -1, -1] / steps - [0, 128, 128] == pytest.approx(lab, abs=0.01)


def lab_of(linear: Array) -> Array:
    """L*a*b* under D50, by colour-science."""
    import colour

    d50 = np.array([0.9642, 1.0, 0.8249])
    adapted = colour.adaptation.chromatic_adaptation_VonKries(linear_to_xyz(linear), D65, d50, transform="Bradford")
    return np.asarray(colour.XYZ_to_Lab(adapted, colour.XYZ_to_xy(d50)))
