"""Merging aged displays into a user's config: the user's lines stay, and the new views equal the build's views."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from lutgen.bake.build import BuildPlan, build
from lutgen.bindings import file_transforms, ocio
from lutgen.colorimetry import Array
from lutgen.display import DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.merge import Merging, merge
from lutgen.names import MODES
from lutgen.readings import read_measurements
from tests.command import in_process
from tests.schemas import validator

BLENDERS = Path("/usr/share/blender/datafiles/colormanagement/config.ocio")
HOURS = 10_000.0
WANTED = [("chroma", HOURS)]
VIEW = "Aged chroma 10000h"

#: A hand-written config of version 1, with its own LUT file and comments.
FIRST = """\
# my config, do not touch
ocio_profile_version: 1
search_path: luts
strictparsing: true
roles: {default: sRGB, scene_linear: linear, reference: linear}
displays:
  Screen sRGB:  # the left one
    - !<View> {name: Film, colorspace: sRGB}
    - !<View> {name: Raw, colorspace: raw}
active_displays: []
active_views: []
colorspaces:
  - !<ColorSpace>
    name: linear
    bitdepth: 32f
  - !<ColorSpace>
    name: raw
    isdata: true
  - !<ColorSpace>
    name: sRGB
    to_reference: !<FileTransform> {src: curve.spi1d, interpolation: linear}
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("merge") / "aged"
    plan = BuildPlan((0.0, HOURS), tuple(MODES), ("cube", "clf"), cubesize=17, certify=False)
    build(DisplayModel(read_measurements(default_display())), plan, folder, jobs=1)
    return folder


@pytest.fixture
def first(tmp_path: Path) -> Path:
    (tmp_path / "mine/luts").mkdir(parents=True)
    curve = "\n".join(f"{(place / 255) ** 2.2:.7f}" for place in range(256))
    (tmp_path / "mine/luts/curve.spi1d").write_text(
        f"Version 1\nFrom 0.0 1.0\nLength 256\nComponents 1\n{{\n{curve}\n}}\n"
    )
    path = tmp_path / "mine/config.ocio"
    path.write_text(FIRST)
    return path


def shown(config: Path, start: str, display: str, view: str, code: Array) -> Array:
    """Send code values through OpenColorIO, without the proof's own routine."""
    lib = ocio()
    lib.ClearAllCaches()
    loaded = lib.Config.CreateFromFile(str(config))
    pixels = code.astype(np.float32)
    processor = loaded.getProcessor(lib.DisplayViewTransform(start, display, view))
    processor.getOptimizedCPUProcessor(lib.OPTIMIZATION_NONE).applyRGB(pixels)
    return pixels.astype(np.float64)


def code_values() -> Array:
    return np.random.default_rng(8).random((300, 3))


def test_a_config_that_is_not_utf8_is_refused_and_its_comments_need_not_be(
    built: Path, first: Path, tmp_path: Path
) -> None:
    wanted = Merging(WANTED, source_space="sRGB")
    first.write_bytes(FIRST.replace("name: Film", "name: Kühl").encode("latin-1"))
    with pytest.raises(LutgenError, match=r"config\.ocio: has names or texts that are not UTF-8\. Save it as UTF-8"):
        merge(built, first, tmp_path / "merged", wanted)
    assert not (tmp_path / "merged").exists()
    first.write_bytes("# Kühl\n".encode("latin-1") + FIRST.encode())
    merged = merge(built, first, tmp_path / "merged", wanted)
    assert merged.config.read_bytes().startswith("# Kühl\n".encode("latin-1"))


def test_a_role_that_names_a_missing_space_is_a_clear_error(built: Path, first: Path, tmp_path: Path) -> None:
    first.write_text(FIRST.replace("scene_linear: linear", "scene_linear: Gone"))
    with pytest.raises(LutgenError, match="The role 'scene_linear' refers to"):
        merge(built, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))


def test_a_config_of_version_1_keeps_its_text_and_its_pixels(built: Path, first: Path, tmp_path: Path) -> None:
    out = tmp_path / "merged"
    merged = merge(built, first, out, Merging(WANTED, source_space="sRGB"))
    assert first.read_text() == FIRST
    text = merged.config.read_text().splitlines()
    # Every line of the user's config is present in its order, also the comments.
    rest = iter(text)
    assert all(line in rest for line in FIRST.splitlines())
    assert "comments" not in " ".join(merged.remarks)
    assert any("no named transforms" in remark for remark in merged.remarks)
    assert (out / "luts/curve.spi1d").is_file()
    for view in ("Film", "Raw"):
        np.testing.assert_array_equal(
            shown(first, "linear", "Screen sRGB", view, code_values()),
            shown(merged.config, "linear", "Screen sRGB", view, code_values()),
        )
    aged = shown(merged.config, "sRGB", "Screen sRGB", VIEW, code_values())
    own = shown(built / "chroma/10000h/config.ocio", "Source signal", "sRGB", "Aged", code_values())
    # The curve is a table of 256 points, and its inverse has the accuracy of the table.
    assert np.abs(np.clip(aged, 0, 1) - np.clip(own, 0, 1)).max() < 3e-3
    assert np.abs(np.clip(aged, 0, 1) - code_values()).max() > 0.02


def test_a_merged_folder_can_be_moved(built: Path, first: Path, tmp_path: Path) -> None:
    merged = merge(built, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))
    before = shown(merged.config, "sRGB", "Screen sRGB", VIEW, code_values())
    moved = shutil.move(tmp_path / "merged", tmp_path / "elsewhere")
    shutil.rmtree(first.parent)
    np.testing.assert_array_equal(before, shown(Path(moved, "config.ocio"), "sRGB", "Screen sRGB", VIEW, code_values()))


def test_a_config_that_cannot_be_edited_is_written_by_opencolorio_and_says_so(
    built: Path, first: Path, tmp_path: Path
) -> None:
    flow = FIRST.replace(
        "displays:\n  Screen sRGB:  # the left one\n    - !<View> {name: Film, colorspace: sRGB}\n"
        "    - !<View> {name: Raw, colorspace: raw}\n",
        "displays: {Screen sRGB: [!<View> {name: Film, colorspace: sRGB}]}\n",
    )
    assert flow != FIRST
    first.write_text(flow)
    merged = merge(built, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))
    assert any("without comments" in remark for remark in merged.remarks)
    assert shown(merged.config, "sRGB", "Screen sRGB", VIEW, code_values()).shape == (300, 3)


def test_a_search_path_outside_the_folder_is_led_there_again(built: Path, first: Path, tmp_path: Path) -> None:
    shutil.move(first.parent / "luts", tmp_path / "shared")
    first.write_text(FIRST.replace("search_path: luts", "search_path: ../shared"))
    merged = merge(built, first, tmp_path / "deep/down/merged", Merging(WANTED, source_space="sRGB"))
    assert shown(merged.config, "linear", "Screen sRGB", "Film", code_values()).shape == (300, 3)


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        (Merging(WANTED), "no role aces_interchange.*--source-space NAME.*linear, raw, sRGB"),
        (Merging(WANTED, source_space="raw"), "holds data"),
        (Merging(WANTED, source_space="linear"), "is linear light, and the LUT takes code values"),
        (Merging(WANTED, source_space="nope"), "unknown colour space 'nope'. Pick one of: linear, raw, sRGB"),
        (Merging([("chroma", 5.0)], source_space="sRGB"), "has no LUT for chroma at 5h. It has chroma at"),
        (Merging(WANTED, source_space="sRGB", onto=("TV",)), "unknown display 'TV'. Pick one of: Screen sRGB"),
    ],
)
def test_what_cannot_be_merged_is_a_clear_error_and_nothing_is_written(
    wanted: Merging, says: str, built: Path, first: Path, tmp_path: Path
) -> None:
    with pytest.raises(LutgenError, match=says):
        merge(built, first, tmp_path / "merged", wanted)
    assert {each.name for each in tmp_path.iterdir()} == {"mine"}


def test_a_folder_in_place_of_the_config_is_named_so(built: Path, first: Path, tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=r"mine: is a folder\. Give the OpenColorIO config itself, .*mine/config"):
        merge(built, first.parent, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))


def test_a_config_too_large_for_one_is_refused_before_it_is_loaded(built: Path, first: Path, tmp_path: Path) -> None:
    with first.open("wb") as file:
        file.truncate(10**9)  # sparse
    with pytest.raises(LutgenError, match=r"has 1000 MB, .* Is it the right file\?"):
        merge(built, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))


def test_names_that_are_taken_are_refused_and_another_prefix_helps(built: Path, first: Path, tmp_path: Path) -> None:
    once = merge(built, first, tmp_path / "once", Merging(WANTED, source_space="sRGB")).config
    with pytest.raises(LutgenError, match=f"has a colour space '{VIEW}' already. Choose another --prefix"):
        merge(built, once, tmp_path / "twice", Merging(WANTED, source_space="sRGB"))
    twice = merge(built, once, tmp_path / "twice", Merging(WANTED, "Worn", "sRGB")).config
    assert VIEW in twice.read_text()
    assert "Worn chroma 10000h" in twice.read_text()


#: A config of version 2 with names that can be interpreted in several ways.
SECOND = """\
ocio_profile_version: 2
search_path: luts
strictparsing: true
roles: {default: sRGB, scene_linear: linear}
displays:
  sRGB:
    - !<View> {name: Film, colorspace: sRGB}
    - !<View> {name: Raw, colorspace: linear}
active_displays: []
active_views: [Film, Raw]
colorspaces:
  - !<ColorSpace> {name: linear}
  - !<ColorSpace>  # theirs
    name: sRGB
    to_scene_reference: !<ExponentTransform> {value: 2.2}
"""
NAMED = f"named_transforms:\n  - !<NamedTransform> {{name: {VIEW}, transform: !<ExponentTransform> {{value: 2}}}}\n"
SHARED = f"\nshared_views:\n  - !<View> {{name: {VIEW}, colorspace: sRGB}}\n"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{name: linear}", f"{{name: linear, aliases: [{VIEW}]}}"),
        ("colorspaces:", f"{NAMED}colorspaces:"),
        ("roles: {", f"roles: {{{VIEW}: sRGB, "),
        ("\ndisplays:\n", f"{SHARED}displays:\n  Wide: [!<Views> [{VIEW}]]\n"),
    ],
    ids=["an alias", "a named transform", "a role", "a shared view"],
)
def test_a_name_that_is_taken_by_something_else_is_refused_too(
    old: str, new: str, built: Path, first: Path, tmp_path: Path
) -> None:
    first.write_text(SECOND.replace(old, new))
    wanted = Merging(WANTED, source_space="sRGB", onto=["Wide" if "Wide" in new else "sRGB"])
    with pytest.raises(LutgenError, match=rf"{VIEW}.*Choose another --prefix\."):
        merge(built, first, tmp_path / "merged", wanted)
    assert not (tmp_path / "merged").exists()


@pytest.mark.parametrize("prefix", ["", " Aged", "Aged, old", "Aged\nold"])
def test_a_prefix_that_would_hide_the_views_is_refused(prefix: str, built: Path, first: Path, tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match="give a word that new names begin with"):
        merge(built, first, tmp_path / "merged", Merging(WANTED, prefix, "sRGB"))


@pytest.mark.parametrize(
    ("old", "new"),
    [("", ""), ("value: 2.2}\n", "value: 2.2}\n...\n"), ("[Film, Raw]", "[ Film, Raw, ]"), ("\n", "\r\n")],
    ids=["plain", "an end of the document", "a last comma", "CRLF"],
)
def test_all_that_was_added_is_there_and_lines_end_as_they_did(
    old: str, new: str, built: Path, first: Path, tmp_path: Path
) -> None:
    text = SECOND.replace(old, new) if old else SECOND
    first.write_text(text, newline="")
    merged = merge(built, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))
    config = ocio().Config.CreateFromFile(str(merged.config))
    assert list(config.getLookNames()) == [f"{VIEW} look"]
    assert list(config.getNamedTransformNames()) == [f"{VIEW} transform"]
    assert list(config.getViews("sRGB")) == ["Film", "Raw", VIEW]
    assert "null" not in str(config.getActiveViews())
    written = merged.config.read_bytes()
    assert written.count(b"\n") == (written.count(b"\r\n") or written.count(b"\n"))
    assert (b"\r" in written) == ("\r" in new)
    # The merge cannot edit the text only if a document ends in it: then the comments are lost.
    assert (b"# theirs" in written) == ("..." not in new)
    assert any("without comments: keep" in remark for remark in merged.remarks) == ("..." in new)


def test_a_lut_of_theirs_that_nobody_comes_back_from_is_refused(built: Path, first: Path, tmp_path: Path) -> None:
    (first.parent / "luts/curve.spi1d").write_text("CSPLUTV100\n3D\nBEGIN METADATA\n")
    with pytest.raises(LutgenError, match=r"curve\.spi1d, which opens its metadata and never closes them"):
        merge(built, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))


def test_a_folder_that_is_there_is_left_alone_without_force(built: Path, first: Path) -> None:
    wanted = Merging(WANTED, source_space="sRGB")
    with pytest.raises(LutgenError, match="exists already"):
        merge(built, first, first.parent, wanted)
    assert first.read_text() == FIRST
    merge(built, first, first.parent, wanted, force=True)
    assert VIEW in first.read_text()


def test_a_lut_that_is_not_the_builds_fails_the_proof(built: Path, first: Path, tmp_path: Path) -> None:
    """The proof fails if the copied LUT is not the LUT of the build's config."""
    broken = tmp_path / "broken"
    shutil.copytree(built, broken)
    config = broken / "chroma/10000h/config.ocio"
    config.write_text(config.read_text().replace("aged.clf", "../../stable/0h/aged.clf"))
    with pytest.raises(LutgenError, match="would differ from the build's own by"):
        merge(broken, first, tmp_path / "merged", Merging(WANTED, source_space="sRGB"))
    assert not (tmp_path / "merged").exists()


@pytest.mark.slow
@pytest.mark.skipif(not BLENDERS.is_file(), reason="Blender's config is not installed (Debian: blender-data)")
@pytest.mark.parametrize("source", [None, "sRGB", "Filmic sRGB"])
def test_blenders_config_takes_aged_views(source: str | None, built: Path, tmp_path: Path) -> None:
    if "Filmic sRGB" not in BLENDERS.read_text(encoding="utf-8"):
        pytest.skip("Blender's config has no Filmic sRGB in this version")
    merged = merge(built, BLENDERS, tmp_path / "merged", Merging(WANTED, source_space=source))
    assert merged.views == (("sRGB", VIEW),)
    assert merged.compared > 30
    assert merged.remarks == ()
    np.testing.assert_array_equal(
        shown(BLENDERS, "Linear", "sRGB", "Filmic", code_values()),
        shown(merged.config, "Linear", "sRGB", "Filmic", code_values()),
    )
    lib = ocio()
    loaded = lib.Config.CreateFromFile(str(merged.config))
    pixels = code_values().astype(np.float32)
    loaded.getProcessor(
        lib.ColorSpaceTransform(src="Linear", dst=merged.source_space)
    ).getDefaultCPUProcessor().applyRGB(pixels)
    own = shown(built / "chroma/10000h/config.ocio", "Source signal", "sRGB", "Aged", pixels.astype(np.float64))
    aged = shown(merged.config, "Linear", "sRGB", VIEW, code_values())
    assert np.abs(np.clip(aged, 0, 1) - np.clip(own, 0, 1)).max() < 1e-4


@pytest.mark.skipif(
    not hasattr(ocio(), "BuiltinConfigRegistry"), reason="OpenColorIO before 2.2 has no built-in configs"
)
@pytest.mark.parametrize("name", ["cg-config-v1.0.0_aces-v1.3_ocio-v2.1", "studio-config-v1.0.0_aces-v1.3_ocio-v2.1"])
def test_the_built_in_aces_configs_take_aged_views(name: str, built: Path, tmp_path: Path) -> None:
    (tmp_path / "aces").mkdir()
    path = tmp_path / "aces/config.ocio"
    path.write_text(ocio().Config.CreateFromBuiltinConfig(name).serialize())
    merged = merge(built, path, tmp_path / "merged", Merging(WANTED))
    assert merged.views == (("sRGB - Display", VIEW),)
    assert merged.compared > 30
    assert any(
        each.getSrc().endswith("aged.clf") for each in file_transforms(ocio().Config.CreateFromFile(str(merged.config)))
    )


def test_the_command_says_what_was_added(
    built: Path, first: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lutgen = in_process(monkeypatch, capsys, "merge", str(built), "--into", str(first), "--hours", "10000")
    done = lutgen("-o", str(tmp_path / "a"), "--source-space", "sRGB")
    assert (done.code, done.err) == (0, "")
    assert f"display Screen sRGB, view {VIEW}" in done.out
    assert "the same pixels as before" in " ".join(done.out.split())
    done = lutgen("-o", str(tmp_path / "b"), "--source-space", "sRGB", "--json", "-")
    validator("merge").validate(json.loads(done.out))
    assert lutgen("-o", str(tmp_path / "a"), "--source-space", "sRGB").code == 2
    assert lutgen("-o", str(tmp_path / "c")).code == 2
