"""A single fault under a manifest that agrees with it is found: a number of a table, a part of a config.

The tests edit a file and write its new hash into the manifest, so that the check can trust neither of them.
"""

import io
import json
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check
from lutgen.bake.formats.ocioz import files_of
from lutgen.bake.manifest import sha256
from lutgen.display import DisplayModel, default_display
from lutgen.readings import read_measurements
from tests.command import in_process
from tests.quick import mostly_slow

HERE = "chroma/9000h"
CONFIG = f"{HERE}/config.ocio"


@pytest.fixture(scope="module")
def pristine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "built"
    plan = BuildPlan((0.0, 9000.0), modes=("chroma",), formats=("cube", "clf", "icc"), cubesize=17)
    build(DisplayModel(read_measurements(default_display())), plan, folder, jobs=1)
    return folder


@pytest.fixture
def built(pristine: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(pristine, tmp_path / "built"))


def problems(folder: Path) -> list[str]:
    return [f"{finding.path}: {finding.problem}" for finding in check(folder, jobs=1).findings]


def rewrite(folder: Path, name: str, data: bytes) -> None:
    """Write a file, and a manifest that agrees with the file."""
    (folder / name).write_bytes(data)

    def agree(content: dict[str, Any]) -> None:
        (record,) = (each for each in content["files"] if each["path"] == name)
        record |= {"sha256": sha256(data), "bytes": len(data)}

    edit_manifest(folder, agree)


def edit_manifest(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    content = json.loads((folder / "manifest.json").read_text())
    change(content)
    (folder / "manifest.json").write_text(json.dumps(content))


def rows(text: str) -> list[int]:
    lines = text.splitlines()
    return [place for place, line in enumerate(lines) if re.fullmatch(r"(\s*-?[0-9]\.[0-9]+){3}", line)]


def test_a_coarse_build_that_certifies_passes_and_says_so_when_it_is_built(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert problems(built) == []
    lutgen = in_process(monkeypatch, capsys)
    options = ("--hours", "10000", "--cubesize", "17", "--format", "icc", "--mode", "chroma")
    done = lutgen("build", *options, "-o", str(tmp_path / "icc"))
    assert "17³ is coarse for 1 of 1 files: chroma/10000h/aged.icc errs by up to 1." in done.out
    assert lutgen("check", str(tmp_path / "icc")).code == 0


@pytest.mark.parametrize("share", mostly_slow([0.0, 0.21, 0.5, 0.83, 1.0], 0.21, 1.0))
@pytest.mark.parametrize("name", [f"{HERE}/aged.cube", f"{HERE}/aged.clf"])
def test_one_number_of_a_table_that_is_off_by_two_thousandths_is_found(built: Path, name: str, share: float) -> None:
    text = (built / name).read_text()
    places, lines = rows(text), text.splitlines(keepends=True)
    place = places[round(share * (len(places) - 1))]
    first = lines[place].split()[0]
    changed = float(first) + (0.002 if float(first) < 0.5 else -0.002)
    lines[place] = lines[place].replace(first, f"{changed:.7f}", 1)
    rewrite(built, name, "".join(lines).encode())
    assert any(each.startswith(f"{name}: is not what lutgen writes") for each in problems(built))


def test_one_number_of_a_profiles_table_is_found(built: Path) -> None:
    name = f"{HERE}/aged.icc"
    data = bytearray((built / name).read_bytes())
    data[len(data) // 2 & ~1] ^= 0x04
    rewrite(built, name, bytes(data))
    assert any(each.startswith(f"{name}: is not what the model gives") for each in problems(built))


def test_a_last_digit_that_another_processor_rounds_otherwise_is_no_fault(built: Path) -> None:
    name = f"{HERE}/aged.cube"
    text = (built / name).read_text()
    lines = text.splitlines(keepends=True)
    place = rows(text)[1000]
    first = lines[place].split()[0]
    lines[place] = lines[place].replace(first, f"{float(first) + 1e-7:.7f}", 1)
    rewrite(built, name, "".join(lines).encode())
    assert problems(built) == []


EDITS = {
    "a role": (r"texture_paint: Source signal", "texture_paint: Linear sRGB"),
    "an alias": (r"lin_srgb", "lin_other"),
    "a number of the matrix of ACES": (r"matrix: \[3\.2409", "matrix: [3.2509"),
    "a bit depth": (r"bitdepth: 32f", "bitdepth: 16f"),
    "an encoding": (r"encoding: sdr-video", "encoding: log"),
    "a file rule": (r"extension|pattern|regex: ", "regex: x"),
    "the active views": (r"active_views: \[Aged", "active_views: [Raw, Aged"),
    "the family": (r"family: Viewer", "family: Other"),
    "bytes that are no UTF-8": (r"lin_srgb", "lin_\udcff"),
}


@pytest.mark.parametrize(
    ("what", "name"),
    [
        *((what, CONFIG) for what in EDITS),
        *mostly_slow(((what, "config.ocio") for what in EDITS), "a role", "a file rule"),
    ],
)
def test_every_part_of_a_config_is_compared(built: Path, name: str, what: str) -> None:
    pattern, replacement = EDITS[what]
    text, count = re.subn(pattern, replacement, (built / name).read_text(), count=1)
    assert count == 1
    rewrite(built, name, text.encode(errors="surrogateescape"))
    assert any(each.startswith(f"{name}: ") for each in problems(built))


@pytest.mark.parametrize(("variable", "value"), [("AGING_MODE", "sepia"), ("AGING_HOURS", "0")])
def test_the_default_of_a_context_variable_is_compared(built: Path, variable: str, value: str) -> None:
    text, count = re.subn(rf"{variable}: .*", f"{variable}: {value}", (built / "config.ocio").read_text(), count=1)
    assert count == 1
    rewrite(built, "config.ocio", text.encode())
    assert any(each.startswith("config.ocio: is not what lutgen writes") for each in problems(built))


def test_the_config_in_an_archive_is_compared(tmp_path: Path) -> None:
    """Remove one role, which changes no colour."""
    plan = BuildPlan((9000.0,), modes=("chroma",), formats=("ocioz",), cubesize=17)
    build(DisplayModel(read_measurements(default_display())), plan, tmp_path / "built", jobs=1)
    name = f"{HERE}/aged.ocioz"
    assert problems(tmp_path / "built") == []
    files = files_of((tmp_path / "built" / name).read_bytes())
    files["config.ocio"] = re.sub(rb"  matte_paint: .*\n", b"", files["config.ocio"])
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for each, data in files.items():
            archive.writestr(each, data)
    rewrite(tmp_path / "built", name, buffer.getvalue())
    assert any(
        each.startswith(f"{name}: config.ocio in it is not what lutgen writes") for each in problems(tmp_path / "built")
    )


CERTIFICATES: dict[str, Callable[[dict[str, Any]], object]] = {
    "a smaller error": lambda it: it["smooth"].update(max=it["smooth"]["max"] - 0.05),
    "a larger error": lambda it: it["border"].update(p99=it["border"]["p99"] + 0.05),
    "more colours": lambda it: it["smooth"].update(colours=it["smooth"]["colours"] + 5000),
    "another share": lambda it: it.update(clipped_share=it["clipped_share"] + 0.1),
    "a group less": lambda it: it.pop("gamut"),
    "a group more": lambda it: it.update(bright={"max": 0.0}),
    "a text": lambda it: it["smooth"].update(max="small"),
}


@pytest.mark.parametrize("what", CERTIFICATES)
def test_a_certificate_is_compared_with_a_new_one(built: Path, what: str) -> None:
    name = f"{HERE}/aged.cube"

    def change(content: dict[str, Any]) -> None:
        (record,) = (each for each in content["files"] if each["path"] == name)
        CERTIFICATES[what](record["certificate"])

    edit_manifest(built, change)
    assert any(each.startswith(f"{name}: ") and "certificate" in each for each in problems(built))


RECORDS: dict[str, Callable[[dict[str, Any]], object]] = {
    "no certificate": lambda content: content["files"][2].update(certificate=None),
    "another size": lambda content: content["files"][2].update(size=33),
    "another space": lambda content: content["files"][2].update(space="elsewhere"),
    "another format": lambda content: content["files"][2].update(format="spi3d"),
    "clipped or not": lambda content: content["files"][2].update(clipped=not content["files"][2]["clipped"]),
    "another mode": lambda content: content["files"][2].update(mode="stable"),
    "an option of nobody's": lambda content: content["options"].update(colour="blue"),
    "another size for all": lambda content: content["options"].update(cubesize=33),
    "a direction": lambda content: content["options"].update(direction="compensate"),
    "an hour of the model": lambda content: content["model"]["display"]["hours"].__setitem__(1, 501.0),
    "a colour of the model": lambda content: content["model"]["display"]["xyY"][1][0].__setitem__(0, 0.314),
    "a word on the display": lambda content: content["model"]["display"]["metadata"].update(display="another"),
    "the law of luminance": lambda content: content["model"]["luminance"]["table"][1].__setitem__(1, 0.7),
    "no certificates asked for": lambda content: content["options"].update(certify=False),
    "an hour more": lambda content: content["options"]["hours"].append(18_000.5),
}


@pytest.mark.parametrize("what", RECORDS)
def test_a_manifest_that_says_otherwise_is_found(built: Path, what: str) -> None:
    edit_manifest(built, RECORDS[what])
    assert problems(built)


PUT_IN = ("chroma/9000h/aged.spi3d", "chroma/9000h/other.cube", "extra.clf", "sub/config.ocio", "aged.icc", "a.ocioz",
          "chroma/.aged.cube.lutgen-partial", "chroma/9000h/compensate.cube")  # fmt: skip


@pytest.mark.parametrize("name", PUT_IN)
def test_a_file_that_programs_take_for_the_builds_is_a_fault(built: Path, name: str) -> None:
    (built / name).parent.mkdir(exist_ok=True)
    shutil.copyfile(built / "chroma/0h/aged.cube", built / name)
    assert problems(built) == [f"{name}: the manifest does not list this file, so it cannot be checked"]


def test_every_other_file_that_does_not_belong_is_named(built: Path) -> None:
    (built / "notes.txt").write_text("mine")
    (built / "chroma/9000h/view.png").write_text("mine")
    result = check(built, jobs=1)
    assert result.passed
    assert result.remarks == ("chroma/9000h/view.png is not of this build", "notes.txt is not of this build")


def test_an_unknown_context_value_is_told_with_the_values_there_are(
    built: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("AGING_MODE", "sepia")
    monkeypatch.setenv("AGING_HOURS", "9001")
    remarks = check(built, jobs=1).remarks
    assert "AGING_MODE=sepia, which this build does not have; it has chroma" in remarks[0]
    assert "AGING_HOURS=9001, which this build does not have; it has 0, 9000" in remarks[1]
    lutgen = in_process(monkeypatch, capsys)
    shown = ("apply", "x.png", "--build", str(built), "-o", "y.png")
    assert "it has chroma: 0h, 9000h" in lutgen(*shown, "--mode", "chroma-luma", "--hours", "0").err
    assert "it has chroma: 0h, 9000h" in lutgen(*shown, "--mode", "chroma", "--hours", "1").err
