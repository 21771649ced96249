"""``lutgen build --direction compensate``: the folder's files, their errors, and faults that ``check`` finds."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check
from lutgen.bake.config import CORRECTION
from lutgen.bake.fidelity import Counts, Judge, certificate_colours
from lutgen.bake.formats import format_named, format_names
from lutgen.bake.lut import Sampler
from lutgen.bake.manifest import sha256
from lutgen.bake.readback import apply_lut
from lutgen.bindings import ocio
from lutgen.colorimetry import Array
from lutgen.display import DisplayModel, default_display
from lutgen.errors import LutgenError
from tests.command import Done
from tests.twin import PAPER_LAW, Twin, rows_of_csv

HOURS, MODES = (10_000.0, 18_000.0), ("chroma", "chroma-luma")
CORRECTIONS = BuildPlan(HOURS, modes=MODES, direction="compensate")


@pytest.fixture(scope="module")
def clipped(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("clip") / "correction"
    build(model, CORRECTIONS, folder, jobs=1)
    return folder


@pytest.fixture(scope="module")
def simulated(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("simulated") / "aged"
    build(model, BuildPlan(HOURS, modes=MODES, formats=("clf",)), folder, jobs=1)
    return folder


def manifest_of(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    return content


def away_from_the_jump(one_in: int) -> Array:
    """The certificate's colours without the pairs beside the border of ``nearest``, which no table can follow."""
    return certificate_colours(Counts(50_000 // one_in, 4_096 // one_in, 32_000 // one_in, 0))


@pytest.mark.slow
def test_names_tell_the_direction(clipped: Path) -> None:
    expected = {"manifest.json", "config.ocio"}
    for mode in MODES:
        for hour in ("10000h", "18000h"):
            expected |= {f"{mode}/{hour}/{name}" for name in ("config.ocio", "compensate.cube", "compensate.clf")}
    assert {str(path.relative_to(clipped)) for path in clipped.rglob("*") if path.is_file()} == expected
    assert manifest_of(clipped)["options"]["direction"] == "compensate"
    assert manifest_of(clipped)["options"]["unreachable"] == "clip"


def test_a_simulation_says_nothing_of_directions_and_graphics_cards(simulated: Path) -> None:
    """The manifest of a simulation has the same bytes as before directions existed."""
    content = manifest_of(simulated)
    assert not {"direction", "unreachable", "gpu"} & set(content["options"])
    assert not any("gpu" in record for record in content["files"])
    assert not {"reached", "scale", "round_trip"} & set(content["files"][1]["certificate"])


def test_the_configs_show_the_signal_for_one_display_alone(clipped: Path) -> None:
    lib = ocio()
    for path in clipped.rglob("config.ocio"):
        config = lib.Config.CreateFromFile(str(path))
        config.validate()
        assert list(config.getDisplays()) == ["Aged display"]
        assert list(config.getViews("Aged display")) == ["Compensated", "Uncompensated", "Raw"]
        assert "Other displays show it wrong." in config.getDescription()
        assert [look.getName() for look in config.getLooks()] == [CORRECTION.look]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("hour", ["10000h", "18000h"])
def test_through_both_files_the_new_display_comes_back(mode: str, hour: str, clipped: Path, simulated: Path) -> None:
    """Compensate, clip like a display, and simulate, by OpenColorIO. Errors in 8-bit steps where drives are inside."""
    code = away_from_the_jump(one_in=8)
    sent = apply_lut(clipped / mode / hour / "compensate.clf", code)
    back = apply_lut(simulated / mode / hour / "aged.clf", np.clip(sent, 0.0, 1.0))
    inside = (sent >= 0.0).all(axis=1) & (sent <= 1.0).all(axis=1)
    steps = np.abs(back - code).max(axis=1) * 255.0
    assert inside.mean() > 0.1
    assert np.quantile(steps[inside], 0.95) < 0.1
    assert np.quantile(steps[~inside], 0.5) > 1.0


@pytest.mark.parametrize("unreachable", ["clip", "scale"])
def test_the_files_figures_are_those_of_the_literal_twin(unreachable: str, model: DisplayModel, tmp_path: Path) -> None:
    """Send the certificate's reached colours through the file to the twin: the same light, times the factor."""
    plan = BuildPlan((10_000.0,), modes=("chroma",), formats=("clf",), direction="compensate", unreachable=unreachable)
    build(model, plan, tmp_path / "out", jobs=1)
    certificate = manifest_of(tmp_path / "out")["files"][1]["certificate"]
    rows = rows_of_csv(default_display().read_text(encoding="utf-8"))
    twin = Twin(rows, mode="chroma", hours=10_000.0, selection="nearest", reference="relative", law=PAPER_LAW)
    fresh = Twin(rows, mode="stable", hours=0.0, selection="nearest", reference="relative", law=PAPER_LAW)
    code = away_from_the_jump(one_in=400)
    sent = apply_lut(tmp_path / "out/chroma/10000h/compensate.clf", code)
    inside = (sent >= 0.0).all(axis=1) & (sent <= 1.0).all(axis=1)
    light = np.array([twin.xyz((r, g, b)) for r, g, b in sent[inside]])
    expected = certificate["scale"] * np.array([fresh.xyz((r, g, b)) for r, g, b in code[inside]])
    assert np.quantile(np.abs(light - expected).max(axis=1), 0.95) < 2e-4
    assert (certificate["scale"] < 1.0) == (unreachable == "scale")
    assert certificate["reached"]["p99"] < 0.05
    assert certificate["inverse"]["max"] < 1e-3
    if unreachable == "scale":
        assert certificate["unreachable_tissue_share"] == 0.0
    else:
        assert certificate["unreachable"]["max"] > 1.0


def test_certificates_tell_apart_what_the_display_and_what_the_table_loses(clipped: Path) -> None:
    for record in manifest_of(clipped)["files"]:
        if record["kind"] == "lut":
            figures = record["certificate"]
            assert figures["reached"]["mean"] < 0.01
            assert figures["unreachable"]["mean"] > 0.5
            groups = ("reached", "reached_border", "unreachable")
            assert sum(figures[group]["colours"] for group in groups) == len(Judge().code)
            assert 0.0 < figures["unreachable_tissue_share"] < 1.0
            assert figures["clipped_share"] == pytest.approx(
                figures["unreachable"]["colours"] / len(Judge().code), abs=1e-6
            )


def test_a_cube_keeps_to_0_and_1_and_a_clf_does_not(clipped: Path) -> None:
    white = np.ones((1, 3))
    assert apply_lut(clipped / "chroma-luma/18000h/compensate.cube", white).max() == 1.0
    assert apply_lut(clipped / "chroma-luma/18000h/compensate.clf", white).max() > 1.3


def test_stable_displays_need_no_correction(model: DisplayModel, tmp_path: Path) -> None:
    build(model, BuildPlan((10_000.0,), modes=("stable",), direction="compensate"), tmp_path / "out", jobs=1)
    code = certificate_colours(Counts(500, 40, 320, 163))
    np.testing.assert_allclose(apply_lut(tmp_path / "out/stable/10000h/compensate.clf", code), code, atol=2e-5)
    assert manifest_of(tmp_path / "out")["files"][1]["certificate"]["clipped_share"] == 0.0


@pytest.mark.slow
def test_check_passes_and_finds_a_swapped_hour(clipped: Path, tmp_path: Path) -> None:
    assert check(clipped, jobs=1).passed
    copy = Path(shutil.copytree(clipped, tmp_path / "correction"))
    wrong = (copy / "chroma/10000h/compensate.clf").read_bytes()
    (copy / "chroma/18000h/compensate.clf").write_bytes(wrong)
    content = manifest_of(copy)
    for record in content["files"]:
        if record["path"] == "chroma/18000h/compensate.clf":
            record["sha256"] = sha256(wrong)
    (copy / "manifest.json").write_text(json.dumps(content))
    problems = [finding.problem for finding in check(copy).findings if finding.path == "chroma/18000h/compensate.clf"]
    assert any("over the budget" in problem for problem in problems)
    assert any("reached ΔE2000 is worse than certified" in problem for problem in problems)


def test_a_simulation_is_no_correction(model: DisplayModel, tmp_path: Path) -> None:
    copy = tmp_path / "aged"
    build(model, BuildPlan((18_000.0,), modes=("chroma",), formats=("clf",)), copy, jobs=1)
    content = manifest_of(copy)
    content["options"] |= {"direction": "compensate", "unreachable": "clip"}
    (copy / "manifest.json").write_text(json.dumps(content))
    assert not check(copy).passed


def test_the_same_correction_gives_the_same_bytes(model: DisplayModel, tmp_path: Path) -> None:
    plan = BuildPlan(HOURS[:1], modes=MODES[:1], direction="compensate", cubesize=17)
    for name in ("once", "again"):
        build(model, plan, tmp_path / name, jobs=1)
    assert (tmp_path / "again/manifest.json").read_bytes() == (tmp_path / "once/manifest.json").read_bytes()


def test_progress_moves_with_every_display(model: DisplayModel, tmp_path: Path) -> None:
    plan = BuildPlan((5_000.0, 10_000.0), MODES, ("cube",), 17, certify=False, direction="compensate")
    calls: list[tuple[int, int]] = []
    build(model, plan, tmp_path / "out", jobs=1, progress=lambda done, whole: calls.append((done, whole)))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_a_correction_is_searched_once_for_all_that_ask(model: DisplayModel) -> None:
    sampler, plan = Sampler(), CORRECTIONS
    first, other = (plan.display(model, "chroma", hours) for hours in HOURS)
    drives = sampler.linear(first, 17, "code")
    assert sampler.linear(first, 17, "code") is drives
    changed = sampler.linear(other, 17, "code")
    assert np.abs(changed - drives).max() > 1e-3
    np.testing.assert_array_equal(sampler.linear(first, 17, "code"), drives)


def test_the_command_tells_what_is_out_of_reach(lutgen: Callable[..., Done], tmp_path: Path) -> None:
    arguments = ("build", "--direction", "compensate", "--hours", "18000", "--mode", "chroma-luma", "--format", "clf")
    short = lutgen(*arguments, "-o", str(tmp_path / "clip"), "--jobs", "1")
    assert short.code == 0
    assert len(short.lines) == 3
    done = lutgen(*arguments, "-o", str(tmp_path / "clip"), "--jobs", "1", "--force", "--verbose")
    assert done.code == 0
    row = next(re.split(r"  +", line) for line in done.lines if line.startswith("chroma-luma  18000"))
    certificate = manifest_of(tmp_path / "clip")["files"][1]["certificate"]
    assert row[2] == f"{certificate['unreachable_lattice_share'] * 100:.1f} %"
    assert row[3] == f"{certificate['unreachable_tissue_share'] * 100:.1f} %"
    assert f"; up to {row[2]} of the colours out of reach (more with --verbose)." in short.lines[2]
    assert row[4] == "100.0 %"
    assert "clipped by channels of the drive" in done.out
    scaled = lutgen(*arguments, "--unreachable", "scale", "-o", str(tmp_path / "scale"), "--jobs", "1", "--verbose")
    row = next(re.split(r"  +", line) for line in scaled.lines if line.startswith("chroma-luma  18000"))
    assert row[3:5] == ["0.0 %", "30.9 %"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--unreachable", "scale"), "--unreachable goes with --direction compensate"),
        (("--direction", "backwards"), "is not one of"),
        (("--direction", "compensate", "--unreachable", "stretch"), "is not one of"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    arguments: tuple[str, ...], says: str, lutgen: Callable[..., Done], tmp_path: Path
) -> None:
    done = lutgen("build", *arguments, "-o", str(tmp_path / "out"))
    assert done.code == 2
    assert says in done.err
    assert not (tmp_path / "out").exists()


def test_unknown_directions_are_refused() -> None:
    with pytest.raises(LutgenError, match=r"'sideways'\. Pick one of: simulate, compensate\."):
        BuildPlan((0.0,), direction="sideways")
    with pytest.raises(LutgenError, match=r"'no'\. Pick one of: clip, scale\."):
        BuildPlan((0.0,), direction="compensate", unreachable="no")


CORRECTING = tuple(name for name in format_names() if format_named(name).corrects)


@pytest.fixture(scope="module")
def of_all_formats(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("formats")
    build(model, BuildPlan((18_000.0,), ("chroma",), CORRECTING, cubesize=17, direction="compensate"), folder, jobs=1)
    return folder


def test_every_format_that_can_carries_the_correction_and_checks(of_all_formats: Path) -> None:
    tables = [each for each in manifest_of(of_all_formats)["files"] if each["kind"] == "lut"]
    assert {each["format"] for each in tables} == set(CORRECTING)
    assert all(Path(each["path"]).name.startswith("compensate") for each in tables)
    assert check(of_all_formats, jobs=1).findings == ()


def test_a_profile_describes_a_display_and_corrects_none() -> None:
    with pytest.raises(LutgenError, match=r"--format icc: describes a display.*Pick from: 3dl, clf"):
        BuildPlan((0.0,), formats=("clf", "icc"), direction="compensate")
