"""Findings of lint on a ``.cube``, against OpenColorIO's treatment of the file; ``make consumers`` tests others."""

import inspect
import json
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import lutgen
from lutgen.bindings import ocio
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError
from lutgen.lint import KINDS, lint, programs
from lutgen.lint.cube_scan import scan_cube
from lutgen.lint.finding import OCIO_21, READS, REFUSES, WRONG, Fate, Linted, LintFinding, Trial
from lutgen.lint.formats import formats
from lutgen.lint.programs import OPENCOLORIO, PROGRAMS, Absent, Program, Refusal, read_as_meant, refusal
from lutgen.lint.stream import TableStatistics, blocks
from lutgen.merge import Merging
from tests.command import Done, in_process
from tests.lint_cases import BAD, CURVES, GOOD, MARK, PLAIN, SIZE, N, R, curved, lines, rows
from tests.quick import draws
from tests.schemas import validator

ROOT = Path(__file__).parents[1]


def linted(folder: Path, data: bytes, *, ask: bool = False, suffix: str = ".cube") -> Linted:
    path = folder / f"lut{suffix}"
    path.write_bytes(data)
    return lint(path, ask_readers=ask)


# The rules against OpenColorIO


@pytest.fixture
def ask_opencolorio(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask only OpenColorIO, the one reader that lutgen depends on."""
    monkeypatch.setattr(programs, "PROGRAMS", (OPENCOLORIO,))


@pytest.mark.usefixtures("ask_opencolorio")
@pytest.mark.parametrize("name", GOOD)
def test_a_form_that_all_readers_take_is_clean_and_opencolorio_takes_it(name: str, tmp_path: Path) -> None:
    report = linted(tmp_path, GOOD[name], ask=True)
    assert report.clean, (report.findings, report.trials)
    assert [each.outcome for each in report.trials] == [READS]


@pytest.mark.usefixtures("ask_opencolorio")
@pytest.mark.parametrize("name", BAD)
def test_opencolorio_does_what_the_rules_say(name: str, tmp_path: Path) -> None:
    rule, data = BAD[name]
    report = linted(tmp_path, data, ask=True)
    assert rule in {finding.rule for finding in report.findings}
    assert not report.clean
    assert [each.reader for each in report.trials] == [OPENCOLORIO.reader()]
    assert report.disagreements() == ()


def test_every_rule_for_cubes_has_a_case() -> None:
    rules = {rule for rule, _ in BAD.values()}
    silent = {"grey-axis"}  # a note, tested below
    kinds = ("config-", "clf-", "table-", "archive-", "profile-", "hald-")
    names = {rule.__name__.replace("_", "-") for form in formats() for rule in form.rules}
    others = {name for name in names if name.startswith(kinds)} | {"loads"}
    assert names == rules | silent | others


def test_every_function_that_yields_findings_is_among_the_rules_of_its_format() -> None:
    for form in formats():
        module = import_module(form.lint.__module__)
        written = {
            name
            for name, each in vars(module).items()
            if inspect.isgeneratorfunction(each) and each.__module__ == module.__name__ and not name.startswith("_")
        }
        assert written == {rule.__name__ for rule in form.rules}


def test_the_packages_can_be_called_like_the_functions_whose_names_they_have(tmp_path: Path) -> None:
    (tmp_path / "lut.cube").write_bytes(PLAIN)
    import_module("lutgen.lint.stream")
    import_module("lutgen.merge.additions")
    assert lutgen.lint(tmp_path / "lut.cube").clean
    with pytest.raises(LutgenError, match="prefix"):
        lutgen.merge(tmp_path, tmp_path, tmp_path, Merging([], prefix=""))


def test_a_trial_tells_what_a_reader_did(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path, _code: NDArray[np.uint8]) -> Array:
        raise Refusal(f"no domain in {path}")

    def as_meant(path: Path, code: NDArray[np.uint8]) -> Array:
        meant = read_as_meant(scan_cube(path, keep=True), code / 255)
        assert meant is not None
        return meant

    def absent() -> str:
        raise Absent("is not here")

    def reader(name: str, apply: Callable[..., Array], version: Callable[[], str] = lambda: "1.0") -> Program:
        return Program(lambda: name, version, apply, tolerance=1e-5, clips=False)

    readers = [
        reader("right", as_meant),
        reader("wrong", lambda _path, code: code / 255),
        reader("empty", lambda _path, code: code * np.nan),
        reader("strict", refuse),
        reader("missing", refuse, absent),
    ]
    monkeypatch.setattr(programs, "PROGRAMS", readers)
    report = linted(tmp_path, lines("DOMAIN_MAX 2 2 2", SIZE, *R), ask=True)
    assert [each.outcome for each in report.trials] == [READS, WRONG, WRONG, REFUSES, ""]
    assert [each.message for each in report.trials][3:] == ["no domain in lut.cube", "is not here"]


def test_a_disagreement_between_rules_and_readers_is_told() -> None:
    finding = LintFinding("odd", "no", 0, {OCIO_21: Fate(REFUSES)})
    trials = (Trial(OCIO_21, "2.1", READS, ""), Trial("colour", "0", WRONG, ""), Trial("pillow_lut", "", "", ""))
    report = Linted(Path("a"), "cube", (), (finding,), trials)
    assert [trial.reader for trial in report.disagreements()] == [OCIO_21, "colour"]


@pytest.mark.parametrize("name", ["plain", "exponents", "domain behind the size", "wide input range", "1D part"])
def test_our_own_reading_is_opencolorios(name: str, tmp_path: Path) -> None:
    """An independent check through OpenColorIO, on colours that are not near a lattice point."""
    path = tmp_path / "lut.cube"
    path.write_bytes(GOOD[name] if name in GOOD else BAD[name][1])
    code = np.random.default_rng(3).random((500, 3)).astype(np.float32)
    meant = read_as_meant(scan_cube(path, keep=True), code.astype(np.float64))
    lib = ocio()
    lib.ClearAllCaches()
    transform = lib.FileTransform(src=str(path), interpolation=lib.INTERP_LINEAR)
    shown = code.copy()
    lib.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor().applyRGB(shown)
    assert meant is not None
    np.testing.assert_allclose(shown, meant, atol=2e-6)


IDENTITY = [f"{x / 3:.6f} {x / 3:.6f} {x / 3:.6f}" for x in range(4)]


@pytest.mark.parametrize(
    ("curves", "header", "identity"),
    [
        (IDENTITY, (), True),
        (["0 0 0", "1 1 1"], (), True),
        (["-0.5 -0.5 -0.5", "1.5 1.5 1.5"], ("LUT_1D_INPUT_RANGE -0.5 1.5",), True),
        (["0 0 0", "1 1 1"], ("LUT_1D_INPUT_RANGE -0.5 1.5",), False),
        (CURVES, (), False),
        ([*IDENTITY[:3], "1 1 0.9999"], (), False),
        ([*IDENTITY[:3], "1 1 nan"], (), False),
    ],
)
def test_a_1d_part_that_changes_nothing_is_told(
    curves: list[str], header: tuple[str, ...], identity: bool, tmp_path: Path
) -> None:
    report = linted(tmp_path, lines(f"LUT_1D_SIZE {len(curves)}", *header, SIZE, *curves, *R))
    (finding,) = (each for each in report.findings if each.rule == "cube-shaper")
    assert ("an identity" in finding.what) == identity
    assert ("darktable" in finding.remedy) == identity


@pytest.mark.parametrize(
    ("header", "remedy"),
    [
        ((), "Bake both into one 3D table: `ociobakelut --lut FILE"),
        (('TITLE "x"',), "Delete its TITLE and DOMAIN; "),
        (('TITLE "x"', "DOMAIN_MIN 0 0 0"), "Delete its TITLE and DOMAIN; "),
        (
            ("DOMAIN_MAX 2 2 2",),
            "Delete its TITLE and DOMAIN; export it again if DOMAIN is not 0..1. Then bake",
        ),
    ],
)
def test_the_remedy_for_a_1d_part_is_one_that_opencolorio_can_follow(
    header: tuple[str, ...], remedy: str, tmp_path: Path
) -> None:
    part = ("LUT_1D_SIZE 4", SIZE, *CURVES, *R)
    report = linted(tmp_path, lines(*header, *part))
    (finding,) = (each for each in report.findings if each.rule == "cube-shaper")
    assert finding.remedy.startswith(remedy)
    path = tmp_path / "read.cube"
    path.write_bytes(lines(*header, *part))
    assert bool(refusal(path)) == bool(header)
    path.write_bytes(lines(*part))
    assert not refusal(path)


def test_a_1d_part_that_is_cut_off_is_no_identity(tmp_path: Path) -> None:
    report = linted(tmp_path, lines("LUT_1D_SIZE 4", SIZE, *IDENTITY[:2]))
    assert "an identity" not in "".join(each.what for each in report.findings)


# Levels


@pytest.mark.parametrize(
    ("fates", "level"),
    [
        ({}, "note"),
        ({"colour": Fate(REFUSES)}, "warning"),
        ({"colour": Fate(REFUSES), "pillow_lut": Fate(WRONG)}, "error"),
        (dict.fromkeys(("a", "b"), Fate(REFUSES)), "error"),
    ],
)
def test_a_level_follows_from_what_readers_do(fates: dict[str, Fate], level: str) -> None:
    readers = ("a", "b") if "a" in fates else ("colour", "pillow_lut", "ffmpeg lut3d")
    assert LintFinding("", "", 0, fates).level(readers) == level


# Facts read from a file


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (lines(SIZE, *R[:5], "nan 0 0", *R[6:]), 7),
        (lines("# a", "", SIZE, *R[:5], "0,1 0 0", *R[6:]), 9),
        (MARK + lines(SIZE, *R[:63], "0.1 0.2"), 65),
        (lines(SIZE, *R).replace(b"\n", b"\r\n").replace(b"0.920000", b"nan", 1), 5),
    ],
)
def test_the_line_is_named(data: bytes, line: int, tmp_path: Path) -> None:
    assert line in {finding.line for finding in linted(tmp_path, data).findings}


def test_a_fall_along_the_greys_is_a_note(tmp_path: Path) -> None:
    report = linted(tmp_path, lines(SIZE, *rows(colour=lambda r, g, b: (r, g - 0.5 * (g > 0.5), b))))
    assert [(each.rule, each.level(report.readers)) for each in report.findings] == [("grey-axis", "note")]
    assert "green fall" in report.findings[0].what


def test_video_range_is_suspected(tmp_path: Path) -> None:
    report = linted(tmp_path, lines(SIZE, *rows(colour=lambda *c: tuple((64 + 876 * x) / 1023 for x in c))))
    assert "narrow range" in report.findings[0].what
    assert report.clean


@pytest.mark.parametrize("swap", [(0, 1, 2), (1, 0, 2), (0, 2, 1)])
def test_tables_that_are_meant_are_not_taken_for_blue_fastest(swap: tuple[int, int, int], tmp_path: Path) -> None:
    def colour(*code: float) -> tuple[float, float, float]:
        return curved(*(code[place] for place in swap))

    assert "channel-order" not in {each.rule for each in linted(tmp_path, lines(SIZE, *rows(colour=colour))).findings}


@pytest.mark.parametrize("step", [1, 7, 64, 200])
def test_statistics_do_not_depend_on_where_blocks_end(step: int) -> None:
    table = np.random.default_rng(5).random((N**3, 3))
    whole, parts = TableStatistics(N, keep=True), TableStatistics(N, keep=True)
    whole.add(table)
    for start in range(0, len(table), step):
        parts.add(table[start : start + step])
    np.testing.assert_allclose(whole.correlation, parts.correlation)
    np.testing.assert_array_equal(whole.greys, parts.greys)
    axis = np.arange(N**3)
    places = np.stack([axis % N, axis // N % N, axis // N**2])
    np.testing.assert_allclose(whole.correlation, np.corrcoef(table.T, places)[:3, 3:])


@pytest.mark.parametrize("ends", [b"\n", b"\r\n", b"\r"])
def test_lines_are_whole_whatever_blocks_are(ends: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lutgen.lint.stream.BLOCK", 7)
    path = tmp_path / "text"
    path.write_bytes(ends.join([b"one", b"", b"a longer line", b"three"]))
    read = list(blocks(path))
    assert b"".join(block.data for block in read) == b"one\n\na longer line\nthree\n"
    line = 1
    for block in read:
        assert block.first == line
        line += block.data.count(b"\n")


# Bad input


@pytest.mark.parametrize("suffix", KINDS)
@pytest.mark.parametrize("data", [b"", b"\0\xff\xfe\0" * 50, b"nothing of the kind\n", b"<a><b></a>"])
def test_rubbish_is_a_finding_in_every_format(suffix: str, data: bytes, tmp_path: Path) -> None:
    report = linted(tmp_path, data, suffix=suffix)
    assert not report.clean
    validator("lint").validate(json.loads(json.dumps({"schema": 1, "files": [report.as_json()]})))


@pytest.mark.parametrize(
    ("name", "says"), [("none.cube", "no such file"), ("a.txt", "ends in none of"), (".", "is a folder")]
)
def test_what_is_no_lut_is_a_clear_error(name: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("x")
    with pytest.raises(LutgenError, match=says):
        lint(tmp_path / name)


def test_a_file_without_lines_is_not_read_into_memory(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match="a line of more than 1 MiB"):
        linted(tmp_path, b"0" * (5 << 20))


#: Prints the peak of memory that lint adds, in MiB. lint reads 40 MB of rows in 0.7 s.
MEASURED = """
import resource, sys
from lutgen.lint import lint
lint(sys.argv[1])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
found = lint(sys.argv[2], ask_readers=True)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) >> 10, found.facts[0])
"""


@pytest.mark.slow
@pytest.mark.parametrize("size", [150, 100_000])
def test_memory_does_not_grow_with_the_file_or_with_what_its_header_says(size: int, tmp_path: Path) -> None:
    small, large = tmp_path / "small.cube", tmp_path / "large.cube"
    small.write_bytes(PLAIN * 2000)
    large.write_bytes(b"LUT_3D_SIZE %d\n" % size + b"0.1234567 0.2345678 0.3456789\n" * 1_400_000)
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, str(small), str(large)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    grown, _, facts = done.stdout.partition(" ")
    # The readers are imported but do not read the file. The rows alone would be 34 MB as numbers, the text 42 MB.
    assert int(grown) < 150
    assert "1400000 rows" in facts


def mutated(data: bytes) -> st.SearchStrategy[bytes]:
    """A real file with bytes replaced, removed or inserted."""
    edits = st.lists(
        st.tuples(
            st.integers(0, len(data)), st.integers(0, 40), st.binary(max_size=12) | st.sampled_from(
                [b"\n", b"nan", b"1e999", b"LUT_3D_SIZE 99999999999999999999\n", b"DOMAIN_MIN", b'TITLE "', b"\0", b","]
            )
        ),
        min_size=1,
        max_size=4,
    )  # fmt: skip

    def apply(changes: list[tuple[int, int, bytes]]) -> bytes:
        result = data
        for place, cut, put in changes:
            result = result[:place] + put + result[place + cut :]
        return result

    return edits.map(apply)


@given(mutated(lines('TITLE "a"', "# b", "DOMAIN_MIN 0 0 0", "DOMAIN_MAX 1 1 1", SIZE, *R)))
@draws(400)
def test_no_mutation_of_a_cube_brings_lint_down(data: bytes) -> None:
    fuzz("cube", data)


CLF = (ROOT / "configs/default/chroma/10000h/aged.clf").read_bytes()
CONFIG = (ROOT / "configs/default/chroma/10000h/config.ocio").read_bytes()


@given(mutated(CLF))
@draws(150)
def test_no_mutation_of_a_clf_brings_lint_down(data: bytes) -> None:
    fuzz("clf", data)


@given(mutated(CONFIG))
@settings(max_examples=25)
def test_no_mutation_of_a_config_brings_lint_down(data: bytes) -> None:
    fuzz("ocio", data)


def fuzz(suffix: str, data: bytes) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"lut.{suffix}")
        path.write_bytes(data)
        try:
            report = lint(path)
        except LutgenError as error:
            assert str(path) in str(error)  # noqa: PT017 - either is right
            return
    for finding in report.findings:
        assert "\n" not in finding.what
    json.dumps(report.as_json(), allow_nan=False)


@given(mutated(PLAIN))
@draws(60)
def test_a_mutation_that_lint_calls_clean_is_read_as_meant_by_opencolorio(data: bytes) -> None:
    """OpenColorIO reads a clean file with the intended colours."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(programs, "PROGRAMS", (OPENCOLORIO,))
        path = Path(folder, "lut.cube")
        path.write_bytes(data)
        if lint(path).clean:
            for each in lint(path, ask_readers=True).trials:
                assert each.outcome == READS, (each, data)


# The command


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Callable[..., Done]:
    monkeypatch.chdir(tmp_path)
    Path("good.cube").write_bytes(PLAIN)
    Path("bad.cube").write_bytes(BAD["domain before the size"][1])
    return in_process(monkeypatch, capsys, "lint")


def test_the_command_ends_with_what_it_found(run: Callable[..., Done]) -> None:
    done = run("good.cube")
    assert (done.code, done.err) == (0, "")
    assert "every reader does what is meant" in done.out
    done = run("good.cube", "bad.cube")
    assert done.code == 1
    assert "bad.cube: 3 of 5 readers do what is meant: OpenColorIO 2.1, OpenColorIO 2.6, colour." in done.out
    assert "line 1: has a domain that is not 0..1" in done.out
    assert run("none.cube").code == 2


def test_the_command_shows_what_was_tried(run: Callable[..., Done]) -> None:
    assert f"{ocio().__version__} reads" in run("good.cube", "--try").out


def test_its_json_is_as_the_schema_says(run: Callable[..., Done]) -> None:
    done = run("good.cube", "bad.cube", "--json", "-", "--try")
    content = json.loads(done.out)
    validator("lint").validate(content)
    assert [each["clean"] for each in content["files"]] == [True, False]
    assert content["files"][1]["readers"]["pillow_lut"]["outcome"] == WRONG
    assert run("good.cube", "--json", "good.cube").code == 2


def test_every_program_stands_for_a_reader_of_cubes() -> None:
    assert {program.reader() for program in PROGRAMS} < set(Linted(Path(), "cube", (), ()).readers)
