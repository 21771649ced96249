"""``lutgen check`` finds each kind of fault in a built folder."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check, check_lut
from lutgen.bake.fidelity import Budget
from lutgen.display import DisplayModel, default_display
from lutgen.errors import LutgenError
from lutgen.readings import read_measurements
from tests.command import here

CUBE, CLF, CONFIG = "chroma/10000h/aged.cube", "chroma/10000h/aged.clf", "chroma/10000h/config.ocio"


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's own measurements: a copy of the default's."""
    path = tmp_path_factory.mktemp("display") / "mine.csv"
    shutil.copyfile(default_display(), path)
    return path


@pytest.fixture(scope="module")
def pristine(display: Path) -> Path:
    folder = display.parent / "built"
    build(DisplayModel(read_measurements(display)), BuildPlan((0.0, 10_000.0), modes=("chroma",)), folder, jobs=1)
    return folder


@pytest.fixture(scope="module")
def coarse(display: Path) -> Path:
    """The same build with small tables: most of the time of a check is the time to read the tables."""
    folder = display.parent / "coarse"
    build(
        DisplayModel(read_measurements(display)), BuildPlan((0.0, 10_000.0), ("chroma",), cubesize=17), folder, jobs=1
    )
    return folder


@pytest.fixture
def rough(coarse: Path, tmp_path: Path, display: Path) -> Path:
    shutil.copyfile(display, tmp_path / "mine.csv")
    return Path(shutil.copytree(coarse, tmp_path / "built"))


@pytest.fixture
def built(pristine: Path, tmp_path: Path, display: Path) -> Path:
    shutil.copyfile(display, tmp_path / "mine.csv")
    return Path(shutil.copytree(pristine, tmp_path / "built"))


def edit(name: str, pattern: str, replacement: str, *, reseal: bool = False) -> Callable[[Path], None]:
    """A fault: replace the first match of a pattern in a file. ``reseal`` makes the manifest agree with the file."""

    def fault(folder: Path) -> None:
        path = folder / name
        text, count = re.subn(pattern, replacement, path.read_text(), count=1)
        assert count == 1
        path.write_text(text)
        if reseal:
            _reseal(folder, name)

    return fault


def edit_all(name: str, old: str, new: str) -> Callable[[Path], None]:
    def fault(folder: Path) -> None:
        path = folder / name
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
        _reseal(folder, name)

    return fault


def _reseal(folder: Path, name: str) -> None:
    """Falsify the manifest too: the check must not trust the manifest."""
    from lutgen.bake.manifest import sha256

    manifest = json.loads((folder / "manifest.json").read_text())
    for record in manifest["files"]:
        if record["path"] == name:
            record["sha256"] = sha256((folder / name).read_bytes())
    (folder / "manifest.json").write_text(json.dumps(manifest))


def another_hours_lut(folder: Path) -> None:
    shutil.copyfile(folder / "chroma/0h/aged.cube", folder / CUBE)


def forgotten(start: str) -> Callable[[Path], None]:
    """A fault: the manifest lists no file whose path begins with ``start``."""

    def fault(folder: Path) -> None:
        manifest = json.loads((folder / "manifest.json").read_text())
        manifest["files"] = [record for record in manifest["files"] if not record["path"].startswith(start)]
        (folder / "manifest.json").write_text(json.dumps(manifest))

    return fault


def another_folder(folder: Path) -> None:
    shutil.copytree(folder / "chroma/0h", folder / "chroma/5h")


def a_folder_instead(folder: Path) -> None:
    (folder / CUBE).unlink()
    (folder / CUBE).mkdir()


def interrupted(folder: Path) -> None:
    (folder / ".lutgen-build.json").write_text("{}")


FAULTS: list[tuple[str, Callable[[Path], None], str, str]] = [
    ("a LUT is missing", lambda folder: (folder / CUBE).unlink(), CUBE, "missing"),
    ("a config is missing", lambda folder: (folder / CONFIG).unlink(), CONFIG, "missing"),
    ("a config's LUT is missing", lambda folder: (folder / CLF).unlink(), CONFIG, "no such file"),
    ("one digit is altered", edit(CUBE, r"0\.5(\d{6}) ", r"0.6\1 "), CUBE, "altered"),
    ("one digit is altered, manifest too", edit(CUBE, r"\n0\.2(\d{6}) ", "\n0.9\\1 ", reseal=True), CUBE, "worse than"),
    ("NaN in a .cube", edit(CUBE, r"\n0\.\d{7} ", "\nnan ", reseal=True), CUBE, "holds 'nan'"),
    ("a decimal comma in a .cube", edit(CUBE, r"\n0\.(\d{7}) ", "\n0,\\1 ", reseal=True), CUBE, "holds '0,"),
    ("NaN in a .clf", edit(CLF, r"\n ?0\.\d{7} ", "\nnan ", reseal=True), CLF, "nan"),
    ("a table interpolated trilinearly", edit_all(CLF, "tetrahedral", "trilinear"), CLF, "wrong interpolation"),
    ("a config that interpolates linearly", edit_all(CONFIG, "tetrahedral", "linear"), CONFIG, "wrong interpolation"),
    ("a config that points elsewhere", edit_all(CONFIG, "aged.clf", "../0h/aged.clf"), CONFIG, "points elsewhere"),
    ("a config without a view", edit(CONFIG, r"    - !<View> \{name: Un-aged.*\n", "", reseal=True), CONFIG, "missing"),
    ("a config without its look", edit_all(CONFIG, "name: Aged display look", "name: Other"), CONFIG, "look"),
    ("a viewer with another matrix", edit_all(CONFIG, "2.49349691194", "2.59349691194"), CONFIG, "pixels differ"),
    ("a config of another version", edit(CONFIG, "2.1", "9.9", reseal=True), CONFIG, "does not load"),
    ("contexts without their LUT", lambda folder: (folder / CLF).unlink(), "config.ocio", "AGING_MODE=chroma"),
    ("a truncated LUT", edit(CUBE, r"(?s)\n0\.9.*", "", reseal=True), CUBE, "cannot read"),
    ("another hour's LUT", another_hours_lut, CUBE, "over the budget"),
    ("measurements changed", edit("../mine.csv", r"0\.31270", "0.31280"), "manifest.json", "stale"),
    ("measurements became unreadable", edit("../mine.csv", "hour", "what"), "manifest.json", "stale"),
    ("a manifest that is no JSON", edit("manifest.json", r"\{", "["), "manifest.json", "manifest"),
    ("a manifest that points outside", edit("manifest.json", CUBE, "../" + CUBE), "manifest.json", "outside"),
    ("a manifest of another model", edit("manifest.json", '"nearest"', '"fastest"'), "manifest.json", "selection"),
    ("another model in the manifest", edit("manifest.json", '"relative"', '"absolute"'), CUBE, "over the budget"),
    (
        "a model without the way to its file",
        edit("manifest.json", r'"path": "../mine.csv",', ""),
        "manifest.json",
        "path",
    ),
    ("a model with a number for a path", edit("manifest.json", r'"../mine.csv"', "5"), "manifest.json", "path"),
    (
        "a model with text for hours",
        edit("manifest.json", r'"hours": \[\s*0.0', '"hours": ["x"'),
        "manifest.json",
        "model",
    ),
    (
        "a file with text for its hour",
        edit("manifest.json", r'"hours": 10000.0', '"hours": "x"'),
        "manifest.json",
        "hours",
    ),
    ("a file that the manifest forgot", forgotten(CUBE), CUBE, "does not list it"),
    ("a manifest without files", forgotten(""), CONFIG, "does not list it"),
    ("a LUT that nobody asked for", another_folder, "chroma/5h/aged.cube", "the manifest does not list this file"),
    ("a folder for a LUT", a_folder_instead, CUBE, "no file any more"),
    ("an unknown mode", edit("manifest.json", r'"mode": "chroma"', '"mode": "sepia"'), "config.ocio", "sepia"),
    (
        "an unknown format",
        edit("manifest.json", r'"format": "cube"', '"format": "jpg"'),
        "chroma/0h/aged.cube",
        "'jpg'",
    ),
    ("an hour beyond the model", edit("manifest.json", r'"hours": 10000.0', '"hours": 1e9'), CUBE, "outside"),
    ("no options", edit("manifest.json", r'"options"', '"choices"'), "manifest.json", "options"),
    ("an interrupted build", interrupted, ".lutgen-build.json", "interrupted"),
]


def test_a_display_of_a_wide_gamut_is_true(tmp_path: Path) -> None:
    """Bright green absorbs the light of a viewer's dark red: the rounding of green is as large as the red light."""
    red, green, blue = (0.4866, 0.2290, 0.0), (0.2657, 0.6917, 0.0451), (0.1982, 0.0793, 1.0439)
    rows = [
        (1, 1, 1, *map(sum, zip(red, green, blue, strict=True))),
        (1, 0, 0, *red),
        (0, 1, 0, *green),
        (0, 0, 1, *blue),
    ]
    lines = [",".join([*map(str, row[:3]), *(f"{110 * each:.4f}" for each in row[3:])]) for row in rows]
    path = tmp_path / "p3.csv"
    path.write_text("\n".join(["# drive: 0..1", "R,G,B,X_cdm2,Y_cdm2,Z_cdm2", *lines]))
    model = DisplayModel(read_measurements(path), reference="absolute")
    build(model, BuildPlan((0.0,), modes=("chroma",)), tmp_path / "built", jobs=1)
    result = check(tmp_path / "built", jobs=1)
    assert result.passed, result.findings


def test_a_fresh_build_passes(built: Path) -> None:
    result = check(built, jobs=1)
    assert result.findings == ()
    assert result.files == 2 * 3 + 1
    assert set(result.certificates) == {record for record in result.certificates if record.endswith((".cube", ".clf"))}
    assert len(result.certificates) == 4


@pytest.mark.parametrize(
    ("name", "fault", "file", "why"),
    FAULTS,
    ids=[fault[0] for fault in FAULTS],
)
def test_a_fault_is_found_and_its_file_named(
    rough: Path, name: str, fault: Callable[[Path], None], file: str, why: str
) -> None:
    fault(rough)
    result = check(rough, jobs=1)
    assert not result.passed, name
    assert any(finding.path == file and why in finding.problem for finding in result.findings), result.findings


def test_the_budget_decides(built: Path) -> None:
    assert check(built, budget=Budget(max_delta_e=0.2, p99=0.05), jobs=1).passed
    failed = check(built, budget=Budget(max_delta_e=0.01), jobs=1)
    assert {finding.path for finding in failed.findings} == {CUBE}
    assert all("--max-delta-e" in finding.problem for finding in failed.findings)


@pytest.mark.parametrize("limit", ["nan", "inf", "-1"])
@pytest.mark.parametrize("option", ["--max-delta-e", "--p99"])
def test_a_budget_that_decides_nothing_is_bad_input(option: str, limit: str, built: Path) -> None:
    done = here("check", built, option, limit)
    assert done.returncode == 2
    assert option in done.stderr
    assert limit in done.stderr


def test_files_of_the_users_own_are_no_fault(built: Path) -> None:
    (built / "notes.txt").write_text("mine")
    (built / "chroma/10000h/view.png").write_text("mine")
    assert check(built, jobs=1).passed


def test_measurements_that_are_gone_are_remarked_on_and_their_copy_used(built: Path) -> None:
    (built.parent / "mine.csv").unlink()
    result = check(built, jobs=1)
    assert result.passed
    assert "not found" in result.remarks[0]


def test_a_lut_of_somebody_else_is_checked_against_a_model(built: Path) -> None:
    model = DisplayModel(read_measurements(default_display()))
    theirs = built / "theirs.cube"
    rows = [f"{r / 8} {g / 8} {b / 8}" for b in range(9) for g in range(9) for r in range(9)]
    theirs.write_text("LUT_3D_SIZE 9\n" + "\n".join(rows) + "\n")
    assert check_lut(theirs, model.at("stable", 0)).passed
    failed = check_lut(theirs, model.at("chroma", 10_000))
    assert "over the budget" in failed.findings[0].problem
    assert check_lut(built / CUBE, model.at("chroma", 10_000)).passed


def test_a_table_of_two_points_is_judged_though_no_colour_is_smooth(tmp_path: Path) -> None:
    corners = ((red, green, blue) for blue in (0, 1) for green in (0, 1) for red in (0, 1))
    for name, rows in {"black": ["0 0 0"] * 8, "identity": [f"{r} {g} {b}" for r, g, b in corners]}.items():
        path = tmp_path / f"{name}.cube"
        path.write_text("LUT_3D_SIZE 2\n" + "\n".join(rows) + "\n", encoding="utf-8")
        result = check_lut(path, DisplayModel(read_measurements(default_display())).at("chroma", 10_000))
        assert not result.passed
        assert "no colour of this table is smooth" in result.findings[0].problem


def test_a_folder_that_lutgen_did_not_make_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match="no folder that `lutgen build` made"):
        check(tmp_path)


def test_a_path_that_holds_nothing_is_bad_input_and_named_once(tmp_path: Path) -> None:
    none = here("check", tmp_path / "none")
    assert (none.returncode, none.stdout) == (2, "")
    assert f"{tmp_path / 'none'}: there is no such file or folder." in " ".join(none.stderr.split())
    age = ("--mode", "chroma", "--hours", "10000")
    (tmp_path / "l.cube").touch()
    empty = here("check", tmp_path / "l.cube", *age)
    assert (empty.returncode, empty.stdout, empty.stderr.count("l.cube")) == (2, "", 1)
    assert "is empty" in empty.stderr
    (tmp_path / "l.cube").write_text("hello\n")
    other = here("check", tmp_path / "l.cube", *age)
    assert other.returncode == 1
    assert f"{tmp_path / 'l.cube'}: OpenColorIO" in other.stdout


def test_exit_codes_say_what_happened(built: Path, tmp_path: Path) -> None:
    passed = here("check", built)
    assert passed.returncode == 0
    figures = [re.findall(r"\d\.\d{4}", text) for text in passed.stdout.split(" where it is smooth, and ")]
    (smooth,), (edges,) = figures
    certificates = check(built, jobs=1).certificates.values()
    assert float(smooth) == pytest.approx(max(each.smooth.max for each in certificates), abs=1e-4)
    assert float(edges) == pytest.approx(max(max(each.gamut.max, each.border.max) for each in certificates), abs=1e-4)
    (built / CUBE).unlink()
    failed = here("check", built)
    assert (failed.returncode, failed.stderr) == (1, "")
    assert f"{CUBE}: missing" in failed.stdout
    assert here("check", tmp_path).returncode == 2
    assert here("check", built / CLF).returncode == 2
    assert here("check", built / CLF, "--mode", "chroma", "--hours", "10000").returncode == 0
    assert here("check", built / CLF, "--mode", "chroma", "--hours", "0").returncode == 1


def test_a_model_file_replaces_the_manifests_model(built: Path, tmp_path: Path) -> None:
    model = tmp_path / "model.toml"
    model.write_text('schema = 1\n[display]\nfile = "mine.csv"\n[model]\nreference = "relative"\n')
    assert here("check", built, "--model", model).returncode == 0
    model.write_text('schema = 1\n[display]\nfile = "mine.csv"\n[model]\nreference = "absolute"\n')
    failed = here("check", built, "--model", model, "--json")
    assert failed.returncode == 1
    content = json.loads(failed.stdout)
    assert content["passed"] is False
    assert CUBE in {finding["file"] for finding in content["findings"]}
