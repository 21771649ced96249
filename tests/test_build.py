"""``lutgen build``: the files in the folder, their errors, refused input, and the remains of a killed build."""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from lutgen.bake.build import BuildPlan, Built, build
from lutgen.bake.fidelity import CERTIFIED, certificate_colours
from lutgen.bindings import ocio
from lutgen.display import DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.names import MODES
from lutgen.readings import read_measurements
from tests.command import error_of, here
from tests.disk import mounted
from tests.twin import Twin, nearest_points, rows_of_csv, to_linear

ROOT = Path(__file__).parents[1]
SMALL = BuildPlan((0.0, 10_000.0), modes=("chroma", "chroma-luma"), cubesize=17)
#: The issue states certificate figures for these hours and modes.
HOURS = (10_000.0, 18_000.0)
AGING = ("chroma", "chroma-luma")
JOURNAL = ".lutgen-build.json"


@pytest.fixture(scope="module")
def small(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One build, which no test changes."""
    folder = tmp_path_factory.mktemp("small") / "aged"
    build(model, SMALL, folder, jobs=1)
    return folder


@pytest.fixture
def copy(small: Path, tmp_path: Path) -> Path:
    """A copy of that build for a test to change."""
    return Path(shutil.copytree(small, tmp_path / "aged"))


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, by its relative path."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def manifest_of(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    return content


def refused(done: subprocess.CompletedProcess[str], *says: str) -> None:
    """Check for exit code 2, one sentence on standard error, and no other output."""
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("lutgen: error: ")
    for fragment in says:
        assert fragment in error_of(done.stderr)


# Layout and manifest


def test_the_folder_is_laid_out_as_documented(small: Path) -> None:
    expected = {"manifest.json", "config.ocio"}
    for mode in AGING:
        for hour in ("0h", "10000h"):
            expected |= {f"{mode}/{hour}/{name}" for name in ("config.ocio", "aged.cube", "aged.clf")}
    assert set(contents(small)) == expected


def test_ociocheck_misses_no_role(small: Path) -> None:
    lib = ocio()
    expected = {getattr(lib, name) for name in dir(lib) if name.startswith("ROLE_INTERCHANGE")}
    for path in (small / "config.ocio", small / "chroma/0h/config.ocio"):
        roles = set(lib.Config.CreateFromFile(str(path)).getRoleNames())
        assert roles >= expected | {"default", "scene_linear", "data", "reference", "rendering", "matte_paint"}


def test_hours_with_decimals_have_folders_of_their_own(model: DisplayModel, tmp_path: Path) -> None:
    plan = BuildPlan((562.5, 562.0), modes=("chroma",), formats=("clf",), cubesize=17, certify=False)
    build(model, plan, tmp_path / "aged", jobs=1)
    assert {path.name for path in (tmp_path / "aged" / "chroma").iterdir()} == {"562.5h", "562h"}


def test_the_manifest_knows_every_file_by_hash_and_size(small: Path) -> None:
    files = {record["path"]: record for record in manifest_of(small)["files"]}
    data_of = contents(small)
    del data_of["manifest.json"]
    assert set(files) == set(data_of)
    for path, data in data_of.items():
        assert files[path]["sha256"] == hashlib.sha256(data).hexdigest()
        assert files[path]["bytes"] == len(data)


def test_the_manifest_names_inputs_options_and_a_certificate_for_each_lut(small: Path) -> None:
    content = manifest_of(small)
    assert content["model"]["display"]["sha256"] == hashlib.sha256(default_display().read_bytes()).hexdigest()
    assert content["options"]["hours"] == [0, 10_000]
    assert content["options"]["cubesize"] == 17
    for record in content["files"]:
        is_lut = record["path"].endswith((".cube", ".clf"))
        assert (record["certificate"] is not None) == is_lut
        if is_lut:
            groups = [record["certificate"][group] for group in ("smooth", "gamut", "border")]
            assert sum(group["colours"] for group in groups) == len(certificate_colours())
            assert groups[0]["colours"] > 10_000


def test_the_manifest_has_no_absolute_paths_no_dates_and_no_host(small: Path, tmp_path: Path) -> None:
    shutil.copyfile(default_display(), tmp_path / "mine.csv")
    mine = DisplayModel(read_measurements(tmp_path / "mine.csv"))
    build(mine, BuildPlan((0.0,), modes=("chroma",), cubesize=17, certify=False), tmp_path / "aged", jobs=1)
    for folder in (small, tmp_path / "aged"):
        for name, data in contents(folder).items():
            text = data.decode()
            for secret in (
                str(ROOT),
                str(tmp_path),
                tempfile.gettempdir(),
                os.uname().nodename,
                time.strftime("%Y-%m-%d"),
            ):
                assert secret not in text, name


def test_the_birth_certificate_of_a_lut_says_what_it_is(small: Path) -> None:
    for name in ("aged.cube", "aged.clf"):
        text = (small / "chroma-luma/10000h" / name).read_text(encoding="utf-8")
        for fact in ("RECONSTRUCTED", "mode: chroma-luma", "hours: 10000", "selection nearest", "fidelity: dE2000"):
            assert fact in text, name


# The same bytes


def test_a_second_build_writes_the_same_bytes(small: Path, model: DisplayModel, tmp_path: Path) -> None:
    build(model, SMALL, tmp_path / "again", jobs=1)
    assert contents(tmp_path / "again") == contents(small)


def test_two_processes_write_the_bytes_of_one(small: Path, model: DisplayModel, tmp_path: Path) -> None:
    # A second process starts only for five displays or more.
    plan = BuildPlan((0.0, 10_000.0), modes=tuple(MODES), formats=("clf",), cubesize=17)
    build(model, plan, tmp_path / "one", jobs=1)
    build(model, plan, tmp_path / "two", jobs=2)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    # The content of a LUT does not depend on the other LUTs of the build.
    path = "chroma/10000h/aged.clf"
    assert (tmp_path / "one" / path).read_bytes() == (small / path).read_bytes()


def test_building_again_into_the_same_folder_changes_nothing(copy: Path, small: Path, model: DisplayModel) -> None:
    built = build(model, SMALL, copy, jobs=1)
    assert built.unfinished is None
    assert contents(copy) == contents(small)


def test_an_older_and_damaged_build_is_replaced(copy: Path, small: Path, model: DisplayModel) -> None:
    (copy / "manifest.json").write_text(json.dumps(manifest_of(copy) | {"generator": "lutgen 0.0.1"}), encoding="utf-8")
    (copy / "chroma" / "10000h" / "aged.clf").unlink()
    build(model, SMALL, copy, jobs=1, force=True)
    assert contents(copy) == contents(small)


@pytest.mark.parametrize(
    ("options", "modes"),
    [((), {"chroma", "chroma-luma"}), (("--mode", "stable"), {"stable"}), (("--mode", "all"), {*MODES})],
)
def test_stable_is_built_only_when_asked(options: tuple[str, ...], modes: set[str], tmp_path: Path) -> None:
    asked = ("--hours", "10000", "--format", "cube", "--cubesize", "17", "--no-certificates", "--jobs", "1")
    done = here("build", *asked, *options, "-o", tmp_path / "aged")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "aged").iterdir() if path.is_dir()} == modes
    # Without certificates there is no error to print.
    law = ["Luminance of chroma-luma: the paper's law, 67 % at 10 000 h and 40 % at 18 000 h."]
    written = f"{len(modes)} LUT{'s' if len(modes) > 1 else ''} and {len(modes) + 1} configs in {tmp_path / 'aged'}"
    assert done.stdout.splitlines() == [*(law if "chroma-luma" in modes else []), written]


def test_a_build_prints_one_line_of_worst_error_and_details_when_asked(tmp_path: Path) -> None:
    asked = ("build", "--hours", "10000,18000", "--format", "cube", "--cubesize", "17", "--force", "-o", tmp_path)
    law, first, worst = here(*asked, "--jobs", "1").stdout.splitlines()
    assert first == f"4 LUTs and 5 configs in {tmp_path}"
    records = json.loads((tmp_path / "manifest.json").read_text())["files"]
    certificates = [record["certificate"] for record in records if record["kind"] == "lut"]
    groups = {
        group: max(each[group]["max"] for each in certificates if each[group]["colours"])
        for group in ("smooth", "gamut", "border")
    }
    smooth, gamut, border = groups.values()
    figures = (
        f"{smooth:.2f} where the model is smooth, {gamut:.2f} where the model clips, {border:.2f} where the model jumps"
    )
    assert worst == f"Largest ΔE2000 of the files against the model: {figures} (more with --verbose)."
    verbose = here(*asked, "--jobs", "1", "--verbose").stdout.splitlines()
    assert verbose[:3] == [law, first, worst.replace(" (more with --verbose)", "")]
    assert [line.split()[:4] for line in verbose if line.startswith("chroma")] == [
        [mode, "cube", "2", group] for mode in ("chroma", "chroma-luma") for group in groups
    ]


def test_a_build_that_was_moved_can_be_built_again(tmp_path: Path) -> None:
    shutil.copyfile(default_display(), tmp_path / "mine.csv")
    mine = DisplayModel(read_measurements(tmp_path / "mine.csv"))
    plan = BuildPlan((0.0,), modes=("chroma",), cubesize=17, certify=False)
    build(mine, plan, tmp_path / "aged", jobs=1)
    (tmp_path / "deeper").mkdir()
    moved = (tmp_path / "aged").rename(tmp_path / "deeper" / "aged")
    build(mine, plan, moved, jobs=1)
    assert "chroma/0h/aged.cube" in contents(moved)


# Certificates


@pytest.fixture(scope="module")
def nearest_33(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Built]:
    folder = tmp_path_factory.mktemp("nearest") / "aged"
    return folder, build(model, BuildPlan(HOURS, modes=AGING), folder, jobs=1)


@pytest.fixture(scope="module")
def continuous(tmp_path_factory: pytest.TempPathFactory) -> Built:
    model = DisplayModel(read_measurements(default_display()), selection="continuous")
    folder = tmp_path_factory.mktemp("continuous") / "aged"
    return build(model, BuildPlan(HOURS, modes=AGING, formats=("clf",)), folder, jobs=1)


@pytest.mark.parametrize("mode", AGING)
@pytest.mark.parametrize("hours", HOURS)
def test_certificates_are_as_good_as_expected(
    mode: str, hours: float, nearest_33: tuple[Path, Built], continuous: Built
) -> None:
    records = {
        record.format: record for record in nearest_33[1].manifest.files if (record.mode, record.hours) == (mode, hours)
    }
    cube, clf = records["cube"].certificate, records["clf"].certificate
    (exact,) = (
        record.certificate
        for record in continuous.manifest.files
        if (record.kind, record.mode, record.hours) == ("lut", mode, hours)
    )
    assert cube is not None
    assert clf is not None
    assert exact is not None
    assert cube["smooth"]["mean"] <= 0.02
    assert cube["smooth"]["p99"] <= 0.2
    assert clf["smooth"]["max"] <= 0.02
    # `continuous` has no borders, so every colour counts.
    assert max(exact[group]["max"] for group in ("smooth", "gamut", "border")) <= 0.01


@pytest.mark.slow
@pytest.mark.filterwarnings(
    # At import colour-science warns of missing optional packages. The test needs none of these packages.
    "ignore::colour.utilities.ColourUsageWarning"
)
@pytest.mark.parametrize("name", ["aged.cube", "aged.clf"])
def test_a_certificate_is_what_a_slow_independent_path_finds(name: str, nearest_33: tuple[Path, Built]) -> None:
    """The twin's model, an independent reader of the file, colour-science's Lab and ΔE, and groups in plain Python."""
    import colour

    path = nearest_33[0] / "chroma/18000h" / name
    (record,) = (r for r in nearest_33[1].manifest.files if r.path == f"chroma/18000h/{name}")
    code = certificate_colours()
    twin = Twin(rows_of_csv(default_display().read_text(encoding="utf-8")), mode="chroma", hours=18_000.0)
    model = np.array([twin.linear((r, g, b)) for r, g, b in code.tolist()])

    shown = cube_in_plain_python(path, code) if name == "aged.cube" else by_opencolorio(path, code)
    shown_linear = colour.models.eotf_sRGB(np.clip(shown, 0, 1))
    matrix = colour.normalised_primary_matrix([0.64, 0.33, 0.30, 0.60, 0.15, 0.06], [0.3127, 0.3290])
    lab = [colour.XYZ_to_Lab(linear @ matrix.T, [0.3127, 0.3290]) for linear in (np.clip(model, 0, 1), shown_linear)]
    error = colour.delta_E(lab[0], lab[1], method="CIE 2000")

    group = groups(code, twin, linear_index=name == "aged.clf")
    # The dark colours, which stand before the pairs, count only for the largest error.
    place = np.arange(len(code)) - (len(code) - 2 * CERTIFIED.pairs)
    usual = (place >= 0) | (place < -CERTIFIED.dark)
    certificate = record.certificate
    assert certificate is not None
    for label in ("smooth", "gamut", "border"):
        mine = error[group == label]
        figures = certificate[label]
        assert figures["colours"] == len(mine), label
        if len(mine):
            errors = error[(group == label) & usual]
            statistics = [float(errors.mean()), float(np.quantile(errors, 0.99)), float(mine.max())]
            assert statistics == pytest.approx([figures["mean"], figures["p99"], figures["max"]], abs=1.5e-6), label
    outside = ((model < -1e-6) | (model > 1 + 1e-6)).any(axis=1).mean()
    assert certificate["clipped_share"] == pytest.approx(outside, abs=1e-6)


def by_opencolorio(path: Path, code: Any) -> Any:
    """Send colours through a file, in single precision."""
    lib = ocio()
    lib.ClearAllCaches()
    transform = lib.FileTransform(src=str(path), interpolation=lib.INTERP_TETRAHEDRAL)
    shown = code.astype(np.float32)
    lib.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor().applyRGB(shown)
    return shown.astype(np.float64)


def cube_in_plain_python(path: Path, code: Any) -> Any:
    """Send colours through a .cube of 33³: numbers in single precision, as in programs; sums in double."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    table = np.array([row for row in rows if len(row) == 3 and row[0][0].isdigit()], dtype=np.float32)
    table = table.astype(np.float64)
    shown = np.array(
        [
            sum(share * table[red + 33 * green + 33**2 * blue] for (red, green, blue), share in mixed(colour))
            for colour in code.tolist()
        ]
    )
    np.testing.assert_allclose(shown, by_opencolorio(path, code), atol=1e-6)
    return shown


def groups(code: Any, twin: Twin, *, linear_index: bool) -> Any:
    """The group of every colour for a 33³ table, as the docstring of fidelity defines groups."""
    axis = [i / 32 for i in range(33)]
    axis_linear = axis if linear_index else [to_linear(value) for value in axis]
    points: dict[tuple[int, int, int], tuple[str, str]] = {}

    def at(node: tuple[int, int, int]) -> tuple[str, str]:
        """Region of a lattice point, and the sides of the gamut on which its aged colour lies."""
        if node not in points:
            linear = (axis_linear[node[0]], axis_linear[node[1]], axis_linear[node[2]])
            red, green, blue = code_of(linear) if linear_index else (axis[node[0]], axis[node[1]], axis[node[2]])
            aged = twin.linear((red, green, blue))
            side = "".join("+" if value > 1 else "-" if value < 0 else "0" for value in aged)
            points[node] = region_of(linear), side
        return points[node]

    def region_of(linear: tuple[float, float, float]) -> str:
        """The side of white's border, or the border itself: `nearest` jumps only at this border."""
        nearest = nearest_points(linear)
        return "white" if list(nearest) == ["w"] else "border" if "w" in nearest else "primary"

    def before_clip(node: tuple[int, int, int]) -> bool:
        """Whether a channel exceeds 1 between the point and the next point along the channel's axis."""
        for own in range(3):
            step = (node[0] + (own == 0), node[1] + (own == 1), node[2] + (own == 2))
            if node[own] < 32 and at(node)[1][own] == "0" and at(step)[1][own] == "+":
                return True
        return False

    beside_jump = beside_the_jump(lambda node: at(node)[0])
    result = []
    for place, (red, green, blue) in enumerate(code.tolist()):
        linear = (to_linear(red), to_linear(green), to_linear(blue))
        own = region_of(linear)
        nodes = [node for node, share in mixed(linear if linear_index else (red, green, blue)) if share > 1e-6]
        met = [at(node) for node in nodes]
        jumps = any(region != own for region, _ in met) or any(map(beside_jump, nodes))
        if place >= len(code) - 2 * CERTIFIED.pairs or jumps:
            result.append("border")
        elif not linear_index and (len({side for _, side in met}) > 1 or any(map(before_clip, nodes))):
            result.append("gamut")
        else:
            result.append("smooth")
    return np.array(result)


def beside_the_jump(region: Callable[[tuple[int, int, int]], str]) -> Callable[[tuple[int, int, int]], bool]:
    """Whether a point is fitted: it is a corner of a cell of a 33³ table that white's border cuts."""
    ends = list(product((0, 1), repeat=3))

    @cache
    def jumps_in(cell: tuple[int, int, int]) -> bool:
        red, green, blue = cell
        return len({region((red + x, green + y, blue + z)) for x, y, z in ends}) > 1

    @cache
    def beside(node: tuple[int, int, int]) -> bool:
        cells = [(node[0] - x, node[1] - y, node[2] - z) for x, y, z in ends]
        return any(jumps_in(cell) for cell in cells if min(cell) >= 0 and max(cell) < 32)

    return beside


def code_of(linear: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = (12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055 for value in linear)
    return red, green, blue


def mixed(index: tuple[float, float, float]) -> list[tuple[tuple[int, int, int], float]]:
    """Lattice points that tetrahedral interpolation mixes, and their weights."""
    corner = [min(int(value * 32), 31) for value in index]
    share = [value * 32 - low for value, low in zip(index, corner, strict=True)]
    order = sorted(range(3), key=lambda channel: -share[channel])
    steps = [1.0, *(share[channel] for channel in order), 0.0]
    node, colour = list(corner), []
    for step in range(4):
        colour.append(((node[0], node[1], node[2]), steps[step] - steps[step + 1]))
        if step < 3:
            node[order[step]] += 1
    return colour


def test_tolerance_picks_the_smallest_size_that_keeps_it(model: DisplayModel, tmp_path: Path) -> None:
    plan = BuildPlan((10_000.0,), modes=("chroma",), formats=("cube",))
    reached = {}
    for size in (17, 33, 65):
        sized = BuildPlan(plan.hours, modes=plan.modes, formats=plan.formats, cubesize=size)
        (lut,) = (r for r in build(model, sized, tmp_path / str(size), jobs=1).manifest.files if r.kind == "lut")
        assert lut.certificate is not None
        reached[size] = lut.certificate["smooth"]["max"]
    assert reached[17] > reached[33] > reached[65]
    for size, tolerance in ((17, reached[17] * 1.01), (33, reached[33] * 1.01), (65, reached[33] * 0.99)):
        chosen = BuildPlan(plan.hours, modes=plan.modes, formats=plan.formats, tolerance=tolerance)
        (lut,) = (r for r in build(model, chosen, tmp_path / f"t{size}", jobs=1).manifest.files if r.kind == "lut")
        assert lut.size == size
        assert lut.certificate is not None
        assert lut.certificate["smooth"]["max"] <= tolerance


def test_a_tolerance_that_no_size_keeps_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    out = tmp_path / "aged"
    done = here("build", "--hours", "10000", "--mode", "chroma", "--format", "cube", "--tolerance", "1e-6", "-o", out)
    refused(done, "--tolerance 1e-06", "no table size meets it", "65³")
    assert list(tmp_path.iterdir()) == []


# Bad options


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--hours", "20000"), "outside the measured span 0..18000 h"),
        (("--hours", "18000..0"), "backwards"),
        (("--hours", "0..18000:0"), "does not advance"),
        (("--hours", "1000000000"), "outside the measured span"),
        (("--hours", "0..18000:0.00001"), "more than 10000"),
        (("--cubesize", "1"), "Pick one of: 17, 33, 65"),
        (("--cubesize", "1000"), "Pick one of: 17, 33, 65"),
        (("--mode", "chrome"), "Pick one of: stable, chroma, chroma-luma"),
        (("--mode", ","), "at least one"),
        (("--format", "icc2"), "Pick one of: 3dl, clf"),
        (("--format", ""), "at least one"),
        (("--tolerance", "0"), "--tolerance 0"),
        (("--luminance", "linear"), "Pick one of: paper, measured"),
        (("--luminance", "none.csv"), "none.csv"),
        (("--display", "none.csv"), "none.csv"),
        (("--model", "none.toml"), "none.toml"),
    ],
)
def test_a_bad_option_is_refused_and_nothing_is_written(options: tuple[str, ...], says: str, tmp_path: Path) -> None:
    refused(here("build", *options, "-o", tmp_path / "aged"), says)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "options", [("--cubesize", "big"), ("--jobs", "0"), ("--selection", "some"), ("--hour", "0,x"), ("extra",)]
)
def test_an_option_that_click_refuses_is_exit_2_too(options: tuple[str, ...], tmp_path: Path) -> None:
    done = here("build", *options, "-o", tmp_path / "aged")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


# The output folder


@pytest.mark.parametrize("name", ["notes.txt", "manifest.json", "chroma/10000h/aged.cube", ".hidden", "chroma"])
@pytest.mark.parametrize("force", [False, True])
def test_a_folder_with_someone_elses_files_is_left_alone(
    name: str, model: DisplayModel, tmp_path: Path, *, force: bool
) -> None:
    path = tmp_path / "aged" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(LutgenError, match=r"choose|Build into another"):
        build(model, SMALL, tmp_path / "aged", jobs=1, force=force)
    assert contents(tmp_path / "aged") == {name: b"mine"}


def test_a_foreign_file_beside_our_own_survives_a_build_over_it(copy: Path, model: DisplayModel) -> None:
    (copy / "chroma" / "notes.txt").write_text("mine")
    other = BuildPlan((5000.0,), modes=("chroma",), formats=("clf",), cubesize=17)
    build(model, other, copy, jobs=1, force=True)
    files = contents(copy)
    assert files.pop("chroma/notes.txt") == b"mine"
    # Files of the last build that this build does not write are removed, with their empty folders.
    assert set(files) == {"manifest.json", "config.ocio", "chroma/5000h/config.ocio", "chroma/5000h/aged.clf"}
    assert not (copy / "chroma-luma").exists()
    assert not (copy / "chroma" / "0h").exists()


@pytest.mark.parametrize("force", [False, True])
def test_a_foreign_file_where_ours_would_go_is_refused_even_with_force(
    copy: Path, model: DisplayModel, *, force: bool
) -> None:
    path = copy / "chroma/5000h/aged.clf"
    path.parent.mkdir()
    path.write_text("mine")
    before = contents(copy)
    other = BuildPlan((5000.0,), modes=("chroma",), formats=("clf",), cubesize=17)
    with pytest.raises(LutgenError, match=r"did not write, such as aged\.clf"):
        build(model, other, copy, jobs=1, force=force)
    assert contents(copy) == before


def test_another_build_of_ours_needs_force(copy: Path, model: DisplayModel) -> None:
    before = contents(copy)
    others = [
        (DisplayModel(model.measurements, selection="continuous"), SMALL),
        (DisplayModel(model.measurements, reference="absolute"), SMALL),
        (model, BuildPlan((0.0, 10_000.0), modes=("chroma", "chroma-luma"), cubesize=33)),
        (model, BuildPlan((0.0, 5000.0), modes=("chroma", "chroma-luma"), cubesize=17)),
    ]
    for other, plan in others:
        with pytest.raises(LutgenError, match="Add --force"):
            build(other, plan, copy, jobs=1)
    assert contents(copy) == before


@pytest.mark.parametrize("name", ["chroma/10000h/aged.cube", "chroma/10000h/aged.clf", "config.ocio"])
def test_a_file_that_was_altered_is_noticed_and_replaced_by_force(
    name: str, copy: Path, small: Path, model: DisplayModel
) -> None:
    path = copy / name
    path.write_bytes(path.read_bytes() + b"\n")
    with pytest.raises(LutgenError, match="altered since lutgen wrote it"):
        build(model, SMALL, copy, jobs=1)
    build(model, SMALL, copy, jobs=1, force=True)
    assert contents(copy) == contents(small)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "null",
        '{"schema": 2}',
        '{"schema": 1}',
        '{"schema": 1, "files": null}',
        '{"schema": 1, "files": 3}',
        '{"schema": 1, "files": [1]}',
        '{"schema": 1, "files": [{"path": "x"}]}',
        '{"schema": 1, "files": [{"path": 5, "kind": "lut", "mode": null, "hours": 0, "sha256": "", "bytes": 0}]}',
        '{"schema": 1, "files": [{"path": "../x", "kind": "lut", "mode": null, "hours": 0, "sha256": "", "bytes": 0}]}',
        '{"schema": 1, "files": [{"path": "/x", "kind": "lut", "mode": null, "hours": 0, "sha256": "", "bytes": 0}]}',
        "[" * 100_000,
    ],
)
def test_a_manifest_that_is_not_ours_is_refused(text: str, model: DisplayModel, tmp_path: Path) -> None:
    folder = tmp_path / "aged"
    folder.mkdir()
    (folder / "manifest.json").write_text(text)
    (tmp_path / "x").write_text("mine")
    with pytest.raises(LutgenError, match=r"manifest\.json"):
        build(model, SMALL, folder, jobs=1, force=True)
    assert contents(tmp_path) == {"aged/manifest.json": text.encode(), "x": b"mine"}


@pytest.mark.parametrize("name", ["file", "file/below", "/dev/full", "/dev/null"])
def test_an_output_that_is_a_file_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    done = here("build", "--hours", "0", "--mode", "chroma", "-o", tmp_path / name)
    refused(done)
    assert "manifest" not in done.stderr
    assert contents(tmp_path) == {"file": b"mine"}


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 300 kB."""
    yield from mounted(tmp_path / "disk", "size=300k")


@pytest.fixture
def read_only_disk(tmp_path: Path) -> Iterator[Path]:
    yield from mounted(tmp_path / "disk", "ro")


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_full_disk_is_one_sentence_and_leaves_nothing(jobs: str, tiny_disk: Path) -> None:
    options = ("--hours", "0,10000", "--mode", "chroma,chroma-luma", "--cubesize", "17")
    done = here("build", *options, "--jobs", jobs, "-o", tiny_disk / "aged")
    refused(done, "no space left on device")
    assert list(tiny_disk.iterdir()) == []


def test_a_read_only_folder_is_one_sentence(read_only_disk: Path) -> None:
    for output in (read_only_disk, read_only_disk / "aged"):
        refused(here("build", "--hours", "0", "--mode", "chroma", "-o", output), "read-only", str(output))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_one_sentence(tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    folder.chmod(0o555)
    refused(here("build", "--hours", "0", "--mode", "chroma", "-o", folder / "aged"), "permission denied")
    folder.chmod(0o000)
    refused(here("build", "--hours", "0", "--mode", "chroma", "-o", folder), str(folder))
    folder.chmod(0o755)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no /proc here")
def test_a_folder_that_cannot_be_made_is_one_sentence() -> None:
    refused(
        here("build", "--hours", "0", "--mode", "chroma", "-o", "/proc/lutgen/aged"), "/proc/lutgen", "cannot write"
    )


# Killed builds


def check_whole(folder: Path, reference: dict[str, bytes]) -> None:
    """Check that every file is complete: each LUT equals the reference, and other files are readable."""
    lib = ocio()
    for path in folder.rglob("*"):
        relative = str(path.relative_to(folder))
        if path.is_dir() or path.name.endswith(".lutgen-partial"):
            continue
        if path.suffix == ".clf":
            ET.fromstring(path.read_bytes())  # noqa: S314 - our own
        if path.suffix == ".ocio":
            lib.Config.CreateFromFile(str(path)).validate()
        if path.suffix == ".json":
            json.loads(path.read_bytes())
        if relative != JOURNAL:
            assert path.read_bytes() == reference[relative], relative


def still_running(group: int) -> list[int]:
    """Running processes of a process group. Zombies, which this process may be unable to reap, do not count."""
    processes = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, pgrp = stat.read_text().rpartition(")")[2].split()[:3]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(pgrp) == group and state != "Z":
            processes.append(int(stat.parent.name))
    return processes


KILLED = ("build", "--hours", "0,500,10000,18000", "--mode", "chroma,chroma-luma", "--cubesize", "17", "--jobs", "2")


class Killable:
    """That build in its own process group, so that a test can kill it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "lutgen", *KILLED, "-o", str(folder)]
        nowhere = subprocess.DEVNULL
        self.process = subprocess.Popen(command, cwd=ROOT, stdout=nowhere, stderr=nowhere, start_new_session=True)

    def wait_until_it_writes(self) -> None:
        while not (self.folder / JOURNAL).exists():
            assert self.process.poll() is None, "the build ended before it wrote"
            time.sleep(0.001)

    def wait_until_there_are(self, files: int, named: Iterable[str]) -> None:
        """Wait until this number of the named files exists, or the build ends."""
        while self.process.poll() is None and sum((self.folder / name).exists() for name in named) < files:
            time.sleep(0.001)

    def kill(self) -> None:
        """Kill only the main process, not its workers, like `kill -9` and the kernel's out-of-memory killer."""
        self.process.kill()
        self.process.wait()

    def running(self) -> list[int]:
        return still_running(self.process.pid)

    def clear(self) -> None:
        for orphan in self.running():
            os.kill(orphan, signal.SIGKILL)
        self.process.wait()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of that build if no process kills it."""
    build = Killable(tmp_path_factory.mktemp("undisturbed") / "aged")
    assert build.process.wait() == 0
    return contents(build.folder)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="watches processes through /proc")
@pytest.mark.parametrize("seed", range(8))
def test_kill_9_leaves_whole_files_and_the_next_build_completes(
    seed: int, undisturbed: dict[str, bytes], tmp_path: Path
) -> None:
    reference = undisturbed
    build = Killable(tmp_path / "aged")
    try:
        build.wait_until_it_writes()
        # One moment in each eighth of the files; the last moment may be the end.
        written = int(len(reference) * (seed + random.Random(seed).random()) / 8)  # noqa: S311 - no secret
        build.wait_until_there_are(written, reference)
        build.kill()
        check_whole(build.folder, reference)
        interrupted = (build.folder / JOURNAL).exists()
        assert interrupted or seed > 3, "not killed while it wrote"
        while build.running():  # a worker finishes its file before it sees that its parent is gone
            time.sleep(0.002)
        missing = len(set(reference) - set(contents(build.folder)) - {"manifest.json"})
        done = here(*KILLED, "-o", build.folder)
        assert done.returncode == 0, done.stderr
        assert contents(build.folder) == reference
        assert ("interrupted" in done.stdout) == interrupted
        if interrupted:
            assert int(done.stdout.split(" of its ")[0].rsplit(" ", 1)[1]) == missing
    finally:
        build.clear()


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="watches processes through /proc")
def test_the_workers_of_a_killed_build_do_not_outlive_it(tmp_path: Path) -> None:
    """A surviving worker would write into the folder of the next build, and then wait for ever."""
    build = Killable(tmp_path / "aged")
    try:
        build.wait_until_it_writes()
        while len(build.running()) < 3:
            assert build.process.poll() is None, "two workers never started"
            time.sleep(0.002)
        build.kill()
        end = time.monotonic() + 60
        while build.running() and time.monotonic() < end:
            time.sleep(0.05)
        assert build.running() == []
    finally:
        build.clear()


def test_what_a_killed_build_half_wrote_is_cleared_away(copy: Path, small: Path, model: DisplayModel) -> None:
    """The state of a folder after `kill -9`, made by hand: a journal, some files, a partial file, no manifest."""
    (copy / "manifest.json").rename(copy / JOURNAL)
    (copy / "chroma/10000h/aged.clf").unlink()
    (copy / "config.ocio").unlink()
    (copy / "chroma/10000h/.aged.clf.lutgen-partial").write_text("half")
    built = build(model, SMALL, copy, jobs=1)
    assert built.unfinished == (2, 13)
    assert contents(copy) == contents(small)
