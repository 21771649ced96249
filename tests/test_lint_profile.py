"""What lint says of ICC profiles, each held to what LittleCMS, Argyll and Chromium do with the file."""

from __future__ import annotations

import base64
import re
import struct
import subprocess
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageCms

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler
from lutgen.display import DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.lint import lint
from lutgen.lint.finding import ARGYLL, CHROMIUM, LCMS_8, LCMS_16, READS, REFUSES, WRONG
from lutgen.measurements import read_measurements
from tests.browser import CHROMIUM as BROWSER
from tests.browser import browser
from tests.consumers import Unavailable, program

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.lint.finding import Linted

pytestmark = pytest.mark.numbers


def made(name: str, hours: float) -> bytes:
    aged = DisplayModel(read_measurements(default_display()), selection="continuous").at("chroma-luma", hours)
    form = format_named(name)
    return form.write(form.bake(Sampler(), aged, 17)[0], Provenance("display", "display", ("lutgen: invented",)))


#: Profiles whose white is the screen's, since what becomes of another is a test of its own.
TABLE, MATRIX, LINK = made("icc", 0), made("icc-matrix", 0), made("devicelink", 0)


def put(data: bytes, place: int, value: bytes) -> bytes:
    return data[:place] + value + data[place + len(value) :]


def row_of(data: bytes, tag: bytes) -> int:
    count = int.from_bytes(data[128:132], "big")
    return next(132 + 12 * row for row in range(count) if data[132 + 12 * row :][:4] == tag)


def moved(data: bytes, tag: bytes, start: int) -> bytes:
    return put(data, row_of(data, tag) + 4, struct.pack(">I", start))


def without(data: bytes, tag: bytes) -> bytes:
    return put(data, row_of(data, tag), b"none")


def in_table(data: bytes, place: int, value: int) -> bytes:
    start = int.from_bytes(data[row_of(data, b"A2B0") + 4 :][:4], "big")
    return put(data, start + place, bytes([value]))


def number(value: int) -> bytes:
    return struct.pack(">I", value)


_EVERYTHING = {LCMS_8: READS, ARGYLL: READS, CHROMIUM: READS}
_NOTHING = {LCMS_8: REFUSES, ARGYLL: REFUSES, CHROMIUM: WRONG}
_COPYRIGHT, _GREEN = row_of(MATRIX, b"cprt"), row_of(MATRIX, b"gXYZ")

#: Name → the profile that is changed, the change, what becomes of it, and the rule that says so.
CASES: dict[str, tuple[bytes, bytes, dict[str, str], str]] = {
    "a table": (TABLE, TABLE, _EVERYTHING, ""),
    "a matrix": (MATRIX, MATRIX, _EVERYTHING, ""),
    "says more bytes": (MATRIX, put(MATRIX, 0, number(len(MATRIX) + 100)), _EVERYTHING, "profile-size"),
    "bytes behind the end": (MATRIX, MATRIX + bytes(101), _EVERYTHING, "profile-size"),
    "says fewer bytes": (
        MATRIX, put(MATRIX, 0, number(len(MATRIX) - 100)), _NOTHING | {CHROMIUM: READS}, "profile-size"
    ),
    "a table cut off": (TABLE, TABLE[:-1000], dict.fromkeys(_NOTHING, WRONG), "profile-tags"),
    "a matrix cut off": (MATRIX, MATRIX[:-1000], _NOTHING, "profile-parts"),
    "a table beyond the end": (TABLE, moved(TABLE, b"A2B0", 2**31), _NOTHING | {LCMS_8: WRONG}, "profile-tags"),
    "a primary beyond the end": (MATRIX, moved(MATRIX, b"rXYZ", 2**31), _NOTHING, "profile-parts"),
    "a title beyond the end": (MATRIX, moved(MATRIX, b"desc", 2**31), _NOTHING | {LCMS_8: READS}, "profile-tags"),
    "no title": (MATRIX, without(MATRIX, b"desc"), _EVERYTHING, "profile-parts"),
    "no copyright": (MATRIX, without(MATRIX, b"cprt"), _EVERYTHING, "profile-parts"),
    "no red": (MATRIX, without(MATRIX, b"rXYZ"), _NOTHING, "profile-parts"),
    "no curve": (MATRIX, without(MATRIX, b"bTRC"), _NOTHING, "profile-parts"),
    "points that are not there": (
        TABLE, in_table(TABLE, 10, 255), {LCMS_8: REFUSES, ARGYLL: WRONG, CHROMIUM: WRONG}, "profile-table"
    ),
    "a single point": (TABLE, in_table(TABLE, 10, 1), _NOTHING, "profile-table"),
    "fewer points": (TABLE, in_table(TABLE, 10, 16), dict.fromkeys(_NOTHING, WRONG), "profile-table"),
    "four inks": (TABLE, in_table(TABLE, 8, 4), {LCMS_8: REFUSES, ARGYLL: WRONG, CHROMIUM: WRONG}, "profile-table"),
    "version 1": (MATRIX, put(MATRIX, 8, b"\1"), _EVERYTHING | {CHROMIUM: WRONG}, "profile-version"),
    "version 4": (MATRIX, put(MATRIX, 8, b"\4"), _EVERYTHING | {ARGYLL: REFUSES}, "profile-version"),
    "version 5": (MATRIX, put(MATRIX, 8, b"\5\0"), _NOTHING | {LCMS_8: READS}, "profile-version"),
    "version 5.4": (MATRIX, put(MATRIX, 8, b"\5\x40"), _NOTHING, "profile-version"),
    "version 9": (MATRIX, put(MATRIX, 8, b"\t"), _NOTHING, "profile-version"),
    "a printer's": (MATRIX, put(MATRIX, 12, b"prtr"), _EVERYTHING, "profile-id"),
    "of no class": (MATRIX, put(MATRIX, 12, b"xxxx"), _NOTHING, "profile-header"),
    "named colours": (MATRIX, put(MATRIX, 12, b"nmcl"), _NOTHING | {CHROMIUM: READS}, "profile-header"),
    "for greys": (MATRIX, put(MATRIX, 16, b"GRAY"), _NOTHING | {ARGYLL: READS}, "profile-header"),
    "another ID": (MATRIX, put(MATRIX, 84, bytes([7] * 16)), _EVERYTHING, "profile-id"),
    "no ID": (MATRIX, put(MATRIX, 84, bytes(16)), _EVERYTHING, ""),
    "no signature": (MATRIX, put(MATRIX, 36, b"xxxx"), _NOTHING, "profile-header"),
    "101 tags": (MATRIX, put(MATRIX, 128, number(101)), _NOTHING | {CHROMIUM: READS}, "profile-tags"),
    "4 thousand million tags": (MATRIX, put(MATRIX, 128, number(2**32 - 1)), _NOTHING, "profile-tags"),
    "no tags": (MATRIX, put(MATRIX, 128, number(0)), _NOTHING, "profile-parts"),
    "a tag twice": (
        MATRIX, put(MATRIX, _COPYRIGHT, MATRIX[_GREEN : _GREEN + 12]), _NOTHING | {ARGYLL: READS, CHROMIUM: READS},
        "profile-tags",
    ),
    "a tag twice, elsewhere": (
        MATRIX, put(MATRIX, _COPYRIGHT, b"rXYZ" + MATRIX[_GREEN + 4 : _GREEN + 12]), _NOTHING | {CHROMIUM: READS},
        "profile-tags",
    ),
    "tags across each other": (
        MATRIX, moved(MATRIX, b"cprt", int.from_bytes(MATRIX[row_of(MATRIX, b"desc") + 4 :][:4], "big") + 4),
        _EVERYTHING, "profile-tags",
    ),
    "empty": (MATRIX, b"", _NOTHING, "profile-header"),
}  # fmt: skip

PIXELS = np.random.default_rng(41).integers(0, 256, (16, 16, 3), dtype=np.uint8)


def linted(folder: Path, data: bytes) -> Linted:
    path = folder / "display.icc"
    path.write_bytes(data)
    return lint(path)


@pytest.mark.parametrize("name", CASES)
def test_the_rules_say_what_becomes_of_a_profile(name: str, tmp_path: Path) -> None:
    _, data, outcomes, rule = CASES[name]
    found = linted(tmp_path, data)
    assert {reader: found.fate(reader)[0].outcome for reader in outcomes} == outcomes
    assert found.fate(LCMS_16) == found.fate(LCMS_8)
    assert {each.rule for each in found.findings} >= ({rule} if rule else set())
    assert bool(found.findings) == bool(rule)


def by_littlecms(data: bytes) -> NDArray[np.uint8] | None:
    try:
        profile = ImageCms.ImageCmsProfile(BytesIO(data))
        shown = ImageCms.profileToProfile(Image.fromarray(PIXELS), profile, ImageCms.createProfile("sRGB"))
    except (ImageCms.PyCMSError, OSError):
        return None
    return np.asarray(shown)


@pytest.mark.parametrize("name", CASES)
def test_littlecms_does_what_the_rules_say(name: str) -> None:
    whole, data, outcomes, _ = CASES[name]
    shown, meant = by_littlecms(data), by_littlecms(whole)
    assert meant is not None
    if shown is None:
        assert outcomes[LCMS_8] == REFUSES
    else:
        same = np.abs(shown.astype(int) - meant).max() <= 1
        # At hour 0 the matrix beside a table is the table: only the bytes tell that it is gone.
        assert outcomes[LCMS_8] == (READS if same else WRONG) or "cut off" in name or "beyond" in name


@pytest.mark.parametrize("name", CASES)
def test_argyll_does_what_the_rules_say(name: str, tmp_path: Path) -> None:
    try:
        tool = program("xicclu", "argyll")
    except Unavailable as reason:
        pytest.skip(str(reason))
    (tmp_path / "display.icc").write_bytes(CASES[name][1])
    command = [tool, "-ff", "-ir", "-px", "display.icc"]
    done = subprocess.run(command, input=b"0.2 0.4 0.6\n", cwd=tmp_path, capture_output=True, check=False, timeout=60)
    assert bool(re.search(rb"-> \w+ -> [\d.]+ ", done.stdout)) == (CASES[name][2][ARGYLL] != REFUSES)


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="Chromium is not installed (Debian: chromium)")
def test_chromium_does_what_the_rules_say(tmp_path: Path) -> None:
    """Pictures below each other, each with a profile of an aged display, so that an ignored one is told from it."""
    bad = {name: case for name, case in CASES.items() if case[2][CHROMIUM] == READS or not case[3].endswith("table")}
    aged = {id(TABLE): made("icc", 18_000), id(MATRIX): made("icc-matrix", 18_000)}
    pictures = []
    for whole, data, _, _ in bad.values():
        changes = [place for place in range(min(len(data), len(whole))) if data[place] != whole[place]]
        profile = bytearray(aged[id(whole)])
        for place in changes:
            profile[place] = data[place]
        profile = profile[: len(data)] + bytes(max(0, len(data) - len(whole)))
        file = BytesIO()
        Image.fromarray(PIXELS).save(file, "PNG", icc_profile=bytes(profile))
        pictures.append(f'<img src="data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}">')
    page_file = tmp_path / "page.html"
    page_file.write_text(f'<style>img{{display:block}}</style><body style="margin:0">{"".join(pictures)}')
    with browser(tmp_path / "profile") as page:
        page.size(100, 16 * len(bad))
        page.open(page_file)
        page.wait("[...document.images].every(image => image.complete && image.naturalWidth)")
        shown = np.asarray(Image.open(BytesIO(page.picture())).convert("RGB"))[:, :16]
    for place, (name, (_, _, outcomes, _)) in enumerate(bad.items()):
        ignored = np.array_equal(shown[16 * place : 16 * place + 16], PIXELS)
        assert ignored == (outcomes[CHROMIUM] == WRONG), name


# White


@pytest.mark.parametrize(
    ("name", "wrong"), [("icc", {LCMS_8, LCMS_16}), ("devicelink", {LCMS_8, LCMS_16}), ("icc-matrix", {LCMS_16})]
)
def test_white_that_littlecms_would_not_show_is_told(name: str, wrong: set[str], tmp_path: Path) -> None:
    data = made(name, 18_000)
    found = linted(tmp_path, data)
    assert {reader for reader in found.readers if found.fate(reader)[0].outcome != READS} == wrong
    (told,) = (each for each in found.findings if each.rule == "profile-white")
    assert "180 168 150" in told.what
    options = ("-l", "display.icc") if name == "devicelink" else ("-i", "display.icc", "-o*sRGB")
    Image.fromarray(np.full_like(PIXELS, 255)).save(tmp_path / "white.tif")
    try:
        tool = program("tificc", "liblcms2-utils")
    except Unavailable as reason:
        pytest.skip(str(reason))
    command = [tool, "-w8", "-t1", *options, "white.tif", "shown.tif"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True, timeout=60)
    shown = np.asarray(Image.open(tmp_path / "shown.tif"))
    assert bool((shown == 255).all()) == (LCMS_8 in wrong)


def test_profiles_of_common_spaces_are_clean(tmp_path: Path) -> None:
    import imagecodecs

    for space in ("srgb", "adobergb"):
        found = linted(tmp_path, imagecodecs.cms_profile(space))
        assert {each.rule for each in found.findings} <= {"profile-version", "profile-parts"}


def test_a_link_is_told_to_be_none_for_viewers(tmp_path: Path) -> None:
    found = linted(tmp_path, LINK)
    assert found.kind == "link"
    assert CHROMIUM not in found.readers
    assert [each.rule for each in found.findings] == ["profile-table"]


def test_without_littlecms_white_is_said_to_be_unknown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(__import__("sys").modules, "imagecodecs", None)
    found = linted(tmp_path, made("icc", 18_000))
    assert "was not checked for its white" in found.findings[0].what
    assert found.clean


def changes(size: int) -> st.SearchStrategy[list[tuple[int, bytes]]]:
    places = st.integers(0, 300) | st.integers(0, size)
    return st.lists(st.tuples(places, st.binary(min_size=1, max_size=8)), min_size=1, max_size=5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("profiles")


@given(st.sampled_from([TABLE, MATRIX, LINK]), changes(3000), st.integers(0, 3000))
@settings(max_examples=150)
def test_no_mutation_of_a_profile_brings_lint_down(
    folder: Path, data: bytes, edits: list[tuple[int, bytes]], end: int
) -> None:
    for place, value in edits:
        data = put(data, place, value)
    for content in (data, data[:end]):
        try:
            found = linted(folder, content)
        except LutgenError as error:
            assert "\n" not in str(error)  # noqa: PT017 - either is right
            continue
        assert all("\n" not in each.what for each in found.findings)


def test_a_gigabyte_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "large.icc"
    path.write_bytes(MATRIX)
    with path.open("r+b") as file:
        file.truncate(1 << 30)  # sparse
    found = lint(path)
    assert "has 1024 MiB, more than any profile" in {each.what for each in found.findings}
