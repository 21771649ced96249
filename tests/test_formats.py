"""LUT formats: a contract for every registered format, the syntax of .cube and CLF, and both OpenColorIO bindings.

The contract tests run over ``format_names()``, so they cover each new format automatically.
"""

import hashlib
import importlib.util
import json
import os
import re
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.digits import rows_of_text
from lutgen.bake.fitted_nodes import ramps_at_white
from lutgen.bake.formats import Format, Provenance, format_named, format_names
from lutgen.bake.lut import Lut, MatrixLut, Sampler
from lutgen.bake.readback import apply_lut, table_kind
from lutgen.bake.spaces import lattice
from lutgen.bindings import ocio
from lutgen.colorimetry import Array, code_to_linear, linear_to_code, xyY_to_xyz
from lutgen.display import SELECTIONS, AgedDisplay, DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.lint import lint
from lutgen.lint.finding import READS
from lutgen.readings import Measurements, read_measurements
from tests.quick import mostly_slow

ROOT = Path(__file__).parents[1]
PROVENANCE = Provenance(
    'Aged "display", chroma & more', "lutgen-chroma-10000h", ("lutgen: what <this> shows", "ΔE2000 & more")
)
DRIVES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def additive() -> Measurements:
    """A display whose white is the sum of its primaries at both hours."""
    fresh = np.array([[0.0, 0.0, 0.0], [0.64, 0.33, 54.0], [0.30, 0.60, 180.0], [0.15, 0.06, 18.0]])
    later = fresh + np.array([[0.0, 0.0, 0.0], [-0.01, 0.0, -5.0], [0.0, -0.01, -9.0], [0.0, 0.01, -6.0]])
    xyz = xyY_to_xyz(np.array([fresh, later])[:, 1:])
    xyz = np.concatenate([xyz.sum(axis=1, keepdims=True), xyz], axis=1)
    return Measurements(np.repeat([0.0, 18_000.0], 4), np.tile(DRIVES, (2, 1)), xyz.reshape(-1, 3), np.arange(8.0))


@pytest.fixture(scope="module")
def displays() -> dict[str, AgedDisplay]:
    readings = read_measurements(default_display())
    models = {
        f"{selection}, {mode}, {hours} h, {reference}": DisplayModel(
            readings, selection=selection, reference=reference
        ).at(mode, hours)
        for selection in SELECTIONS
        for mode, hours, reference in (
            ("stable", 0.0, "relative"),
            ("chroma", 18_000.0, "relative"),
            ("chroma", 18_000.0, "absolute"),
            ("chroma-luma", 9_999.0, "relative"),
        )
    }
    models["additive"] = DisplayModel(additive(), reference="absolute").at("chroma", 18_000.0)
    return models


@pytest.fixture(scope="module")
def some(displays: dict[str, AgedDisplay]) -> dict[str, AgedDisplay]:
    """One display for each way in which a format may differ: selection, mode, reference, and additive light."""
    names = ("nearest, chroma, 18000.0 h, absolute", "continuous, chroma-luma, 9999.0 h, relative", "additive")
    return {name: displays[name] for name in names}


@pytest.fixture(scope="module")
def sampler() -> Sampler:
    return Sampler()


@pytest.fixture(scope="module")
def colours() -> Array:
    """Random colours, lattice points, greys and corners, rounded to float32."""
    random = np.random.default_rng(12)
    greys = np.repeat(np.linspace(0, 1, 500)[:, np.newaxis], 3, axis=1)
    code = np.concatenate([random.random((4_000, 3)), lattice(17, "code"), lattice(2, "code"), greys])
    return code.astype(np.float32).astype(np.float64)


def read_back(path: Path, code: Array) -> Array:
    """Send colours through a file: by OpenColorIO if it reads the format, else by lutgen's ``apply_lut``."""
    reads = any(format_named(name).reader and path.name == format_named(name).file for name in format_names())
    return apply_lut(path, code) if reads else through_ocio(path, code)


def through_ocio(path: Path, code: Array, *, optimised: bool = True) -> Array:
    """Send colours through a file with OpenColorIO, without ``apply_lut``."""
    lib = ocio()
    lib.ClearAllCaches()
    transform = lib.FileTransform(src=str(path), interpolation=lib.INTERP_TETRAHEDRAL)
    processor = lib.Config.CreateRaw().getProcessor(transform)
    level = lib.OPTIMIZATION_DEFAULT if optimised else lib.OPTIMIZATION_NONE
    shown = code.astype(np.float32)
    processor.getOptimizedCPUProcessor(level).applyRGB(shown)
    return shown.astype(np.float64)


# The contract of every format


def test_an_unknown_format_names_the_choices() -> None:
    with pytest.raises(LutgenError, match="unknown format 'icc2'. Pick one of: " + ", ".join(format_names())):
        format_named("icc2")


@pytest.mark.parametrize("name", format_names())
def test_a_format_says_who_it_is(name: str) -> None:
    form = format_named(name)
    assert form.name == name
    assert re.fullmatch(r"\.[a-z0-9]+", form.suffix)


#: Formats that OpenColorIO reads, and formats with a reader of their own, which have separate tests.
OF_OCIO = [name for name in format_names() if format_named(name).reader is None]
OF_OTHERS = sorted(set(format_names()) - set(OF_OCIO))


@pytest.mark.parametrize("name", OF_OCIO)
def test_opencolorio_gives_what_the_lut_gives_by_itself(
    name: str, some: dict[str, AgedDisplay], sampler: Sampler, colours: Array, tmp_path: Path
) -> None:
    form = format_named(name)
    for display, aged in some.items():
        candidates = form.bake(sampler, aged, 17)
        assert candidates
        for lut in candidates:
            path = tmp_path / f"lut{form.suffix}"
            path.write_bytes(form.write(lut, PROVENANCE))
            expected = lut.apply(colours)
            # Rounding to seven decimals and to float32 costs 1e-7 each. In linear light OpenColorIO's sRGB curve has
            # its break at 0.03928 (slope 1/12.9232), where its pieces meet smoothly. The curve of IEC has its break at
            # 0.04045 (slope 1/12.92). The difference is 1.1e-5 near black and 2.6e-4 of the values below 0.
            # OpenColorIO 2.2 and later have fast powers, which cost another 2.5e-5.
            # OpenColorIO resamples the shaper of a .csp at 65536 points.
            exact, fast = {"code": (4e-7, 4e-7), "shaped": (2e-6, 2e-6), "linear": (1.1e-5, 4e-5)}[lut.space]
            below = 2.6e-4 * np.maximum(-expected, 0) if lut.space == "linear" else 0.0
            error = np.abs(through_ocio(path, colours, optimised=False) - expected) - below
            assert error.max() <= exact, f"{display}: {lut.space}"
            error = np.abs(through_ocio(path, colours) - expected) - below
            assert error.max() <= fast, f"{display}: {lut.space}"


@pytest.mark.parametrize("name", OF_OTHERS)
def test_a_format_of_another_reader_gives_what_the_lut_gives_by_itself(
    name: str, some: dict[str, AgedDisplay], sampler: Sampler, colours: Array, tmp_path: Path
) -> None:
    form = format_named(name)
    for display, aged in some.items():
        for lut in form.bake(sampler, aged, 17):
            path = tmp_path / form.file
            path.write_bytes(form.write(lut, PROVENANCE))
            expected = np.clip(lut.apply(colours), 0, 1)
            error = np.abs(np.clip(apply_lut(path, colours), 0, 1) - expected)
            # LittleCMS and the sRGB profile round in steps of 1.5e-5. The slope of sRGB at black (12.92) times the
            # matrix (3.2) enlarges the rounding error to 8e-4. In linear light OpenColorIO's fast powers cost 4e-5, as
            # above. LittleCMS reads curves, straight curves too, at 16 bit.
            profile = form.suffix == ".icc" and name != "devicelink"
            limit = 8.5e-4 if profile else {"linear": 5e-5}.get(lut.space, 3e-5 if name == "devicelink" else 1e-6)
            assert error.max() <= limit, f"{display}: {lut.space}"
            assert table_kind(path, clipped=True)[:2] == (lut.space, lut.size)


def test_each_file_has_a_name_of_its_own() -> None:
    files = [format_named(name).file for name in format_names()]
    assert len(set(files)) == len(files)


@pytest.mark.parametrize("name", format_names())
def test_a_format_keeps_colours_outside_srgb_exactly_when_it_says_so(
    name: str, displays: dict[str, AgedDisplay], sampler: Sampler, tmp_path: Path
) -> None:
    form = format_named(name)
    aged = displays["continuous, chroma, 18000.0 h, relative"]
    code = np.random.default_rng(13).random((5000, 3))
    linear = aged.code_to_linear(code)
    assert linear.min() < -0.01
    assert linear.max() > 1.01
    for lut in form.bake(sampler, aged, 33):
        path = tmp_path / form.file
        path.write_bytes(form.write(lut, PROVENANCE))
        shown = read_back(path, code)
        if form.unclipped:
            assert shown.min() < -0.01
            assert shown.max() > 1.001
        else:
            assert shown.min() >= 0
            assert shown.max() < 256 / 255  # the headroom beside the clip is less than one 8-bit code


@pytest.mark.parametrize("name", format_names())
def test_a_format_writes_the_same_bytes_each_time_and_carries_its_provenance(
    name: str, some: dict[str, AgedDisplay]
) -> None:
    form = format_named(name)
    for aged in some.values():
        # Two samplers: the result must not depend on what a sampler baked before.
        first, second = (form.bake(sampler, aged, 17) for sampler in (Sampler(), Sampler()))
        written = [[form.write(lut, PROVENANCE) for lut in luts] for luts in (first, second)]
        assert written[0] == written[1]
        assert all(b"what" in data and b"shows" in data for data in written[0])


@pytest.mark.parametrize("which", mostly_slow(["some", "displays"], "some"))
@pytest.mark.parametrize("name", format_names())
def test_the_best_candidate_is_near_the_model(
    name: str, which: str, sampler: Sampler, colours: Array, request: pytest.FixtureRequest
) -> None:
    """Check that no axis is swapped and no curve is missing. The certificates are tested in test_build."""
    form = format_named(name)
    for aged in request.getfixturevalue(which).values():
        model = aged.code_to_code(colours)
        errors = [np.abs(np.clip(lut.apply(colours), 0, 1) - model).mean() for lut in form.bake(sampler, aged, 33)]
        # A format that does not follow every display has an error of one or two codes of 255.
        assert min(errors) < (5e-4 if form.follows else 6e-3)


@pytest.mark.parametrize("name", format_names())
def test_a_rewritten_file_is_not_answered_from_opencolorios_cache(
    name: str, displays: dict[str, AgedDisplay], sampler: Sampler, colours: Array, tmp_path: Path
) -> None:
    form = format_named(name)
    path = tmp_path / form.file
    shown = []
    for display in ("nearest, stable, 0.0 h, relative", "nearest, chroma, 18000.0 h, relative"):
        path.write_bytes(form.write(form.bake(sampler, displays[display], 17)[0], PROVENANCE))
        shown.append(apply_lut(path, colours))
    assert np.abs(shown[0] - shown[1]).max() > 0.05
    np.testing.assert_array_equal(shown[1], read_back(path, colours))


@pytest.mark.parametrize("name", format_names())
@pytest.mark.parametrize("fault", [b"", b"nothing of the kind\n", b"\x00\xff\x00"])
def test_a_file_that_cannot_be_read_is_a_clear_error(name: str, fault: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"lut{format_named(name).suffix}"
    path.write_bytes(fault)
    with pytest.raises(LutgenError, match=re.escape(str(path))) as error:
        apply_lut(path, np.zeros((1, 3)))
    assert "\n" not in str(error.value)


#: A file's name and its metadata may hold any text that a user typed.
NASTY = Provenance(
    'a "b"\nLUT_3D_SIZE 2 </ProcessList>', 'id "<&>', ("one\nLUT_3D_SIZE 2", "ΔE\r0 0 0", "\x07 ]]> --> &amp;")
)


class Plain(NamedTuple):
    """A table, and the colours that its file shows with an ordinary provenance."""

    form: Format
    lut: Lut | MatrixLut
    path: Path
    shown: Array


@pytest.fixture(params=format_names())
def plain(
    request: pytest.FixtureRequest, displays: dict[str, AgedDisplay], sampler: Sampler, colours: Array, tmp_path: Path
) -> Plain:
    form = format_named(request.param)
    (lut, *_) = form.bake(sampler, displays["nearest, chroma, 18000.0 h, relative"], 17)
    path = tmp_path / form.file
    path.write_bytes(form.write(lut, PROVENANCE))
    return Plain(form, lut, path, read_back(path, colours))


def test_no_text_of_the_provenance_can_break_a_file(plain: Plain, colours: Array) -> None:
    plain.path.write_bytes(plain.form.write(plain.lut, NASTY))
    np.testing.assert_array_equal(read_back(plain.path, colours), plain.shown)


#: Names of displays in scripts whose letters take two, three and four bytes. One byte of Í is not in Windows-1252.
SCRIPTS = "Büro, Íslenska, Дисплей, 显示器, 𝒟"


def test_a_displays_name_in_any_script_survives_in_a_file(plain: Plain, colours: Array) -> None:
    words = Provenance("Aged display", "lutgen", ("lutgen: words", f"display: {SCRIPTS}.csv"))
    data = plain.form.write(plain.lut, words)
    # A profile's text is ASCII: each other letter stands as its number.
    held = SCRIPTS.encode("ascii", "backslashreplace") if plain.form.suffix == ".icc" else SCRIPTS.encode()
    assert b"display: %s.csv" % held in data
    plain.path.write_bytes(data)
    np.testing.assert_array_equal(read_back(plain.path, colours), plain.shown)
    assert not any(trial.outcome != READS for trial in lint(plain.path, ask_readers=True).trials if trial.version)


# .cube: the form that every program reads

CUBE = re.compile(
    rb'TITLE "[^"\n]*"\n'
    rb"(#[^\n]*\n)*"
    rb"LUT_3D_SIZE ([0-9]+)\n"
    rb"(([01]\.[0-9]{7} [01]\.[0-9]{7} [01]\.[0-9]{7}\n)+)"
)


@pytest.mark.parametrize("size", [17, 33, 65])
def test_a_cube_has_the_one_form_that_every_reader_takes(
    size: int, displays: dict[str, AgedDisplay], sampler: Sampler
) -> None:
    form = format_named("cube")
    for aged in list(displays.values())[1:4] if size == 33 else list(displays.values())[1:2]:
        (lut,) = form.bake(sampler, aged, size)
        data = form.write(lut, PROVENANCE)
        # A comment may hold letters of any script, for the display's name.
        assert "# ΔE2000 & more\n".encode() in data
        assert data.replace("Δ".encode(), b"").isascii()
        assert b"\r" not in data
        assert b"\t" not in data
        match = CUBE.fullmatch(data)
        assert match is not None
        assert int(match[2]) == size
        rows = np.array(match[3].split(), dtype=float).reshape(-1, 3)
        assert len(rows) == size**3
        assert rows.min() >= 0
        # three.js converts the numbers to bytes without clipping: 256 would become 0.
        assert (rows.max() * 255) // 1 <= 255
        # Values below float32's smallest normal number would break readers. Seven decimals leave no such value.
        assert rows[rows > 0].min() >= 1e-7


def test_in_a_cube_red_is_fastest_and_the_index_is_a_code_value(displays: dict[str, AgedDisplay]) -> None:
    form = format_named("cube")
    aged = displays["continuous, stable, 0.0 h, relative"]
    (lut,) = form.bake(Sampler(), aged, 17)
    data = form.write(lut, PROVENANCE).split(b"LUT_3D_SIZE 17\n")[1]
    rows = np.array(data.split(), dtype=float).reshape(-1, 3)
    for place, row in enumerate(rows):  # the identity, at hour 0
        expected = (place % 17 / 16, place // 17 % 17 / 16, place // 289 / 16)
        assert row == pytest.approx(expected, abs=6e-8)


def test_a_cube_holds_the_model_at_its_lattice_points(displays: dict[str, AgedDisplay], sampler: Sampler) -> None:
    form = format_named("cube")
    aged = displays["nearest, chroma, 18000.0 h, relative"]
    (lut,) = form.bake(sampler, aged, 33)
    rows = np.array(form.write(lut, PROVENANCE).split(b"LUT_3D_SIZE 33\n")[1].split(), dtype=float).reshape(-1, 3)
    grid = [(r / 32, g / 32, b / 32) for b in range(33) for g in range(33) for r in range(33)]
    away = np.abs(np.minimum(rows, 1) - aged.code_to_code(np.array(grid)))
    jump, _ = ramps_at_white("code", 33)
    assert (np.delete(away, jump, axis=0) > 5.1e-8).mean() < 0.02  # the nodes that are fitted beside the clip
    assert away.max() < 1.5 / 255


def test_a_title_with_quotes_or_line_ends_cannot_break_the_header_of_a_cube(displays: dict[str, AgedDisplay]) -> None:
    form = format_named("cube")
    (lut,) = form.bake(Sampler(), displays["additive"], 17)
    match = CUBE.fullmatch(form.write(lut, NASTY))
    assert match is not None
    assert int(match[2]) == 17


# Digits


@given(arrays(np.float64, st.tuples(st.integers(1, 40), st.integers(1, 4)), elements=st.floats(-9.9999998, 9.9999998)))
def test_rows_of_text_are_what_percent_7f_gives(values: Array) -> None:
    check_digits(values)


def check_digits(values: Array) -> None:
    # One routine rounds an exact half of the last digit by the binary value, the other rounds it to even.
    tenth = np.abs(values) * 1e8
    values = np.where(np.abs(tenth % 10 - 5) < 1e-3, 0.25, values)
    signed = bool((values < -0.5e-7).any())
    expected = []
    for row in values.tolist():
        cells = ["%.7f" % value for value in row]  # noqa: UP031 - the oracle itself
        cells = [cell.removeprefix("-") if float(cell) == 0 else cell for cell in cells]
        expected.append(" ".join(cell if cell.startswith("-") or not signed else f" {cell}" for cell in cells))
    assert bytes(rows_of_text(values)).decode() == "".join(f"{line}\n" for line in expected)


@pytest.mark.parametrize("span", [(0.0, 1.0), (-0.6, 1.1), (-9.0, 9.0), (0.0, 1e-6), (-1e-6, 1e-6)])
def test_many_rows_of_text_are_what_percent_7f_gives(span: tuple[float, float]) -> None:
    random = np.random.default_rng(14)
    check_digits(random.uniform(*span, (8_000, 3)))


def test_carries_and_zeros_are_written_right() -> None:
    values = np.array([[0.99999999, 0.9999999, 1.0], [0.0, -0.0, -1e-9], [1e-320, 0.00000005001, 9.9999998]])
    expected = b"1.0000000 0.9999999 1.0000000\n0.0000000 0.0000000 0.0000000\n0.0000000 0.0000001 9.9999998\n"
    assert rows_of_text(values) == expected


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 10.0, -10.0, 9.99999999, 10 - 1e-7, 1e-7 - 10])
def test_numbers_that_do_not_fit_are_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="NaN, infinity or a number of 10 or more"):
        rows_of_text(np.array([[0.5, wrong, 0.5]]))


# CLF


def clf_of(aged: AgedDisplay, size: int = 17) -> list[tuple[Lut | MatrixLut, ET.Element]]:
    form = format_named("clf")
    luts = form.bake(Sampler(), aged, size)
    return [(lut, ET.fromstring(form.write(lut, PROVENANCE))) for lut in luts]  # noqa: S314 - our own


def test_a_clf_is_the_plain_version_3_form_with_its_birth_certificate(displays: dict[str, AgedDisplay]) -> None:
    for aged in displays.values():
        for _, root in clf_of(aged):
            # No namespace: colour-clf-io refuses the namespace of SMPTE 2136.
            assert root.tag == "ProcessList"
            assert root.attrib["compCLFversion"] in {"3", "3.0"}
            assert root.attrib["id"] == PROVENANCE.identifier
            assert root.attrib["name"] == PROVENANCE.title
            assert [node.text for node in root.findall("Description")] == list(PROVENANCE.lines)
            assert "source signal" in (root.findtext("InputDescriptor") or "")
            assert "aged display" in (root.findtext("OutputDescriptor") or "")


def nodes(root: ET.Element) -> list[str]:
    about = {"Description", "InputDescriptor", "OutputDescriptor", "Info"}
    return [node.tag for node in root if node.tag not in about]


def test_a_clf_has_the_most_exact_form_that_the_model_admits(displays: dict[str, AgedDisplay]) -> None:
    (matrix, root), *more = clf_of(displays["additive"])
    assert (more, nodes(root)) == ([], ["Exponent", "Matrix", "Exponent"])
    assert isinstance(matrix, MatrixLut)
    for name, aged in displays.items():
        tables = clf_of(aged)
        if name.startswith(("continuous, stable, 0.0 h, relative", "nearest, stable, 0.0 h, relative")):
            assert [nodes(root) for _, root in tables] == [["Exponent", "Matrix", "Exponent"]]
        elif name.startswith("continuous"):
            assert [nodes(root) for _, root in tables] == [["Exponent", "LUT3D", "Exponent"]]
            assert tables[0][0].size == 2
        elif name.startswith("nearest"):
            assert [nodes(root) for _, root in tables] == [["LUT3D"], ["Exponent", "LUT3D", "Exponent"]]
            assert [lut.space for lut, _ in tables] == ["code", "linear"]
            assert [lut.size for lut, _ in tables] == [17, 17]


def test_in_a_clf_blue_is_fastest_interpolation_tetrahedral_and_depths_are_float(
    displays: dict[str, AgedDisplay],
) -> None:
    for _, root in clf_of(displays["nearest, chroma, 18000.0 h, relative"], 5):
        table = root.find("LUT3D")
        assert table is not None
        assert table.attrib == {"inBitDepth": "32f", "outBitDepth": "32f", "interpolation": "tetrahedral"}
        array = table.find("Array")
        assert array is not None
        assert array.attrib["dim"] == "5 5 5 3"
        values = np.array((array.text or "").split(), dtype=float).reshape(5, 5, 5, 3)
        # Blue grows along the last axis but one, red along the first axis.
        assert (np.diff(values[0, 0, :, 2]) > 0).all()
        assert (np.diff(values[:, 0, 0, 0]) > 0).all()


def test_the_clf_of_continuous_is_the_model_to_float_precision(
    displays: dict[str, AgedDisplay], tmp_path: Path
) -> None:
    aged = displays["continuous, chroma, 18000.0 h, relative"]
    form = format_named("clf")
    (lut,) = form.bake(Sampler(), aged, 33)
    path = tmp_path / "lut.clf"
    path.write_bytes(form.write(lut, PROVENANCE))
    assert path.stat().st_size < 3000
    # Above the curve's straight piece, where OpenColorIO's break differs from IEC's. The seventh decimal is 6e-7 after
    # the curve's slope of 12.
    code = np.random.default_rng(15).uniform(0.05, 1.0, (20_000, 3))
    code = code.astype(np.float32).astype(np.float64)
    model = aged.code_to_linear(code)
    bright = model > 0.0035
    shown = through_ocio(path, code, optimised=False)
    assert np.abs(shown - linear_to_code(model))[bright].max() < 1e-6


def test_the_matrix_of_an_additive_display_is_the_model_to_float_precision(
    displays: dict[str, AgedDisplay], tmp_path: Path
) -> None:
    aged = displays["additive"]
    form = format_named("clf")
    (lut,) = form.bake(Sampler(), aged, 33)
    path = tmp_path / "lut.clf"
    path.write_bytes(form.write(lut, PROVENANCE))
    code = np.random.default_rng(16).uniform(0.05, 1.0, (20_000, 3)).astype(np.float32).astype(np.float64)
    model = aged.code_to_linear(code)
    assert np.ptp(model - code_to_linear(code)) > 0.01
    bright = model > 0.0035
    assert np.abs(through_ocio(path, code, optimised=False) - linear_to_code(model))[bright].max() < 1e-6


# Both bindings

#: Builds, then prints what it wrote, and the output of every display and view of every given config.
WORKER = """
import copy, json, os, sys
import numpy as np
import PyOpenColorIO as ocio
task = json.loads(sys.argv[1])
if task["build"]:
    from lutgen.bake.build import BuildPlan, build
    from lutgen.display import DisplayModel, default_display
    from lutgen.readings import read_measurements
    from lutgen.bake.formats import format_names
    from lutgen.names import MODES
    every = ("cube", "clf", *(name for name in format_names() if name not in ("cube", "clf")))
    for name, selection, formats in (("nearest", "nearest", every), ("cube", "nearest", ("cube",)),
                                     ("continuous", "continuous", ("cube", "clf"))):
        model = DisplayModel(read_measurements(default_display()), selection=selection)
        plan = BuildPlan((0.0, 2750.5, 18000.0), tuple(MODES), formats, cubesize=17, certify=False)
        build(model, plan, os.path.join(task["build"], name), jobs=1)
code = np.random.default_rng(17).random((500, 3)).astype(np.float32)
shown = {}
for path in task["configs"]:
    config = ocio.Config.CreateFromFile(path)
    config.validate()
    places = [({}, "")]
    if "AGING_MODE" in config.getEnvironmentVarNames():
        places = [({"AGING_MODE": m, "AGING_HOURS": h}, f"{m} {h} ") for m in ("stable", "chroma", "chroma-luma")
                  for h in ("0", "2750.5", "18000")]
    for variables, prefix in places:
        context = copy.deepcopy(config.getCurrentContext())
        for key, value in variables.items():
            context[key] = value
        for display in config.getDisplays():
            for view in config.getViews(display):
                transform = ocio.DisplayViewTransform(src="Source signal", display=display, view=view)
                processor = config.getProcessor(context, transform, ocio.TRANSFORM_DIR_FORWARD)
                pixels = code.copy()
                processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_NONE).applyRGB(pixels)
                shown[f"{path}|{prefix}{display}|{view}"] = pixels.astype(float).tolist()
with open(task["answer"], "w") as file:
    json.dump({"version": ocio.__version__, "shown": shown}, file)
"""


def run_worker(task: dict[str, Any], environment: dict[str, str]) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-c", WORKER, json.dumps(task)],
        cwd=ROOT,
        env={**os.environ, **environment, "OCIO_LOGGING_LEVEL": "warning"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(Path(task["answer"]).read_text(encoding="utf-8"))
    # Standard error holds OpenColorIO's log and Python's own warnings.
    return {**answer, "logged": done.stderr}


@pytest.fixture(scope="session")
def other_binding(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment with the other PyOpenColorIO: Debian's if the current one is a wheel, else a wheel."""
    folder = tmp_path_factory.mktemp("other_binding")
    here = importlib.util.find_spec("PyOpenColorIO")
    assert here is not None
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    debian = Path("/usr/lib/python3/dist-packages") / f"PyOpenColorIO{suffix}"
    if here.origin and Path(here.origin).resolve() == debian.resolve():
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
        done = subprocess.run(
            [*pip, "--target", str(folder), "opencolorio>=2.2"], capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            pytest.skip(f"the opencolorio wheel cannot be installed here: {done.stderr.strip()[-200:]}")
    elif debian.is_file():
        # Only the binding comes from Debian: numpy must be this environment's.
        (folder / debian.name).symlink_to(debian)
    else:
        pytest.skip("python3-pyopencolorio is not installed for this Python")
    return {"PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)}


BINDINGS = ("this", "other")


class BothBindings:
    """The same small build made with either binding and read with either binding, on demand."""

    def __init__(self, folder: Path, environment: Callable[[str], dict[str, str]]) -> None:
        self.folder, self.environment = folder, environment
        self.answers: dict[tuple[str, str], dict[str, Any]] = {}

    def built(self, writer: str) -> Path:
        folder = self.folder / writer
        if not folder.exists():
            task = {"build": str(folder), "configs": [], "answer": str(self.folder / "built.json")}
            run_worker(task, self.environment(writer))
        return folder

    def read(self, writer: str, reader: str) -> dict[str, Any]:
        if (writer, reader) not in self.answers:
            configs = sorted(str(path) for path in self.built(writer).rglob("config.ocio"))
            task = {"build": "", "configs": configs, "answer": str(self.folder / "read.json")}
            self.answers[writer, reader] = run_worker(task, self.environment(reader))
        return self.answers[writer, reader]

    def shown(self, writer: str, reader: str) -> dict[str, Array]:
        """Return the pixels by config, display and view. The config's path is relative to its build."""
        root = str(self.built(writer))
        return {key.removeprefix(root): np.array(value) for key, value in self.read(writer, reader)["shown"].items()}


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> BothBindings:
    def environment(binding: str) -> dict[str, str]:
        return {} if binding == "this" else request.getfixturevalue("other_binding")

    return BothBindings(tmp_path_factory.mktemp("both"), environment)


@pytest.mark.slow
def test_the_two_bindings_are_two(both: BothBindings) -> None:
    assert both.read("this", "this")["version"] != both.read("this", "other")["version"]


@pytest.mark.slow(every=True)
def test_both_bindings_give_the_same_luts_byte_for_byte(both: BothBindings) -> None:
    hashes = []
    for folder in map(both.built, BINDINGS):
        # The text of a config differs between versions, and an archive holds a config.
        others = {"config.ocio", "manifest.json", "aged.ocioz"}
        luts = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in others]
        hashes.append({str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in luts})
    assert len(hashes[0]) == 3 * 3 * (len(format_names()) - 1 + 1 + 2)
    assert hashes[0] == hashes[1]


@pytest.mark.slow
@pytest.mark.parametrize("writer", BINDINGS)
@pytest.mark.parametrize("reader", BINDINGS)
def test_configs_of_either_binding_load_in_both_without_a_warning(writer: str, reader: str, both: BothBindings) -> None:
    answer = both.read(writer, reader)
    assert answer["logged"] == ""
    # Three builds, each with nine displays and a common config of nine context values; three viewers, three views.
    assert len(answer["shown"]) == 3 * (9 + 9) * 3 * 3


@pytest.mark.slow
@pytest.mark.parametrize("reader", BINDINGS)
def test_configs_of_either_binding_mean_the_same(reader: str, both: BothBindings) -> None:
    one, other = both.shown("this", reader), both.shown("other", reader)
    assert one.keys() == other.keys()
    for key, pixels in one.items():
        np.testing.assert_allclose(pixels, other[key], rtol=0, atol=1e-6, err_msg=key)


@pytest.mark.slow
def test_both_bindings_show_a_config_alike(both: BothBindings) -> None:
    one, other = both.shown("this", "this"), both.shown("this", "other")
    assert one.keys() == other.keys()
    for key, pixels in one.items():
        # The power of Rec.1886 is infinitely steep at black: float32's last bit becomes 4e-4 of code value there.
        power = 2.4 if "Rec.1886|" in key else 1.0
        light = [np.sign(shown) * np.abs(shown) ** power for shown in (pixels, other[key])]
        # Each version rounds its intermediate results to float32. A test above compares the configs within one version.
        np.testing.assert_allclose(light[0], light[1], rtol=0, atol=3e-6, err_msg=key)
    views = {key.rpartition("|")[2] for key in one}
    assert views == {"Aged", "Un-aged", "Raw"}
    aged = {key: pixels for key, pixels in one.items() if key.endswith("|Aged") and "18000" in key and "chroma" in key}
    for key, pixels in aged.items():
        unaged = one[key.replace("|Aged", "|Un-aged")]
        assert np.abs(pixels - unaged).max() > 0.02, key


def test_the_views_of_an_hours_config_show_what_their_names_say(tmp_path: Path) -> None:
    """The same for one hour's config, on the sRGB viewer and in this process."""
    plan = BuildPlan((18_000.0,), ("chroma",), ("clf",), cubesize=17, certify=False)
    build(DisplayModel(read_measurements(default_display())), plan, tmp_path, jobs=1)
    (path,) = tmp_path.glob("chroma/*h/config.ocio")
    lib, code = ocio(), np.random.default_rng(17).random((500, 3))
    config = lib.Config.CreateFromFile(str(path))
    shown = {}
    for view in config.getViews("sRGB"):
        processor = config.getProcessor(lib.DisplayViewTransform("Source signal", "sRGB", view))
        shown[view] = code.astype(np.float32)
        processor.getOptimizedCPUProcessor(lib.OPTIMIZATION_NONE).applyRGB(shown[view])
    assert shown.keys() == {"Aged", "Un-aged", "Raw"}
    for view in ("Un-aged", "Raw"):
        np.testing.assert_allclose(shown[view], code, rtol=0, atol=2e-6, err_msg=view)
    expected = through_ocio(path.with_name("aged.clf"), code, optimised=False)
    np.testing.assert_allclose(shown["Aged"], expected, rtol=0, atol=5e-6)
    assert np.abs(shown["Aged"] - code).max() > 0.02


@pytest.mark.slow
@pytest.mark.parametrize("binding", BINDINGS)
def test_the_views_of_a_config_show_what_their_names_say(binding: str, both: BothBindings) -> None:
    """On the sRGB viewer: Aged is the tetrahedral LUT, Raw the source signal, Un-aged the source signal too."""
    code = np.random.default_rng(17).random((500, 3)).astype(np.float32).astype(np.float64)
    shown = both.shown(binding, binding)
    for key, pixels in shown.items():
        config, display, view = key.split("|")
        if view == "Raw" or (view == "Un-aged" and display.endswith("sRGB")):
            np.testing.assert_allclose(pixels, code, rtol=0, atol=2e-6, err_msg=key)
        if view == "Aged" and display.endswith("sRGB"):
            mode, hours = display.split(" ")[:2] if " " in display else (None, None)
            folder = both.built(binding) / config.strip("/").removesuffix("config.ocio")
            lut = folder / (f"{mode}/{hours}h" if mode else "") / f"aged{'.cube' if '/cube/' in config else '.clf'}"
            expected = through_ocio(lut, code, optimised=False)
            # Through the sRGB curve and back. A trilinear reading of these tables has an error of 1e-3 or more.
            np.testing.assert_allclose(pixels, expected, rtol=0, atol=5e-6, err_msg=key)
