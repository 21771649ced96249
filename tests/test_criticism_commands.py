"""The commands `lutgen compare`, `diagnose`, `refine` and `plan`: pages, files, exit codes, bad input."""

from __future__ import annotations

import json
import re
import shlex
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.compare.direction import placed
from lutgen.criticism.compare.slices import Slice
from lutgen.criticism.search.separate import POOL, Separation
from lutgen.display import load_model
from lutgen.effects.contract import check
from lutgen.effects.own import load_file
from lutgen.numerals import percent, readable, with_error
from lutgen.readings import read_measurements
from lutgen.readings.conditions import CONDITIONS
from lutgen.report import diagnosis as diagnosis_page
from lutgen.report.effect_sketch import FOLLOWS, of_condition, sketched
from tests.campaigns import single, text_of, write
from tests.command import Done, words
from tests.quick import mostly_slow

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from lutgen.readings.conditions import Condition

pytestmark = pytest.mark.numbers

COMMANDS = ("compare", "diagnose", "refine", "plan")


@pytest.mark.parametrize(
    ("name", "sentence", "words"),
    [
        ("leak", "The model fails", ("It is worst", "additive", "black", "× the noise", "lutgen diagnose leak.csv")),
        ("healthy", "The model agrees", ("No hour, colour or condition stands out",)),
        ("edge", "The model fails", ("u 0.9, v 0.9", "position", "darker than predicted")),
        ("tips only", "These readings hold nothing but white and primaries", ()),
    ],
)
def test_compare_says_how_well_the_model_does_and_where_it_fails(
    run: Callable[..., Done], tmp_path: Path, name: str, sentence: str, words: tuple[str, ...]
) -> None:
    done = run("compare", write(name, tmp_path).name)
    assert (done.code, done.err) == (0, "")
    assert done.lines[0].startswith(sentence)
    assert "SIMULATED" in done.out
    for word in words:
        assert word in done.out


def test_compare_fails_above_a_ratio_that_is_asked_for(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("leak", tmp_path).name
    done = run("compare", data, "--fail-above", "1.5")
    assert done.code == 1
    assert done.lines[0].startswith("The model fails")
    assert re.fullmatch(r"[\d.]+ × the noise is more than --fail-above 1\.5\.\n", done.err)
    done = run("compare", data, "--fail-above", "1e6")
    assert (done.code, done.err) == (0, "")


#: Data set and options → text of the page: the beginning of the verdict, and some words.
DIAGNOSED: dict[str, tuple[str, ...]] = {
    "leak": (
        "named: black-level",
        "lutgen refine leak.csv --add black-level",
        "to rule out meter-offset",
        "black leaks",
        "of the excess error",
    ),
    "curve": ("named: eotf-drift", "grown", "±", "cannot be seen"),
    "healthy": ("consistent: ", "lutgen plan healthy.csv"),
    "tips only": ("consistent: ", "cannot be seen", "These data could not have seen"),
    "fading --baseline first-hour": ("[a-z-]+: ", "fading.csv --baseline first-hour -"),
}


@pytest.mark.parametrize(
    ("asked", "says"), mostly_slow(DIAGNOSED.items(), "leak", "healthy", "tips only"), ids=list(DIAGNOSED)
)
def test_diagnose_says_what_is_missing_then_what_to_do_then_what_can_be_seen(
    run: Callable[..., Done], tmp_path: Path, asked: str, says: tuple[str, ...]
) -> None:
    name, _, options = asked.partition(" --")
    done = run("diagnose", write(name, tmp_path).name, *shlex.split(f"--{options}" if options else ""))
    assert (done.code, done.err) == (0, "")
    verdict, *words = says

    def place(pattern: str) -> int:
        return next(number for number, line in enumerate(done.lines) if re.match(pattern, line))

    assert place(verdict) == 0
    assert place("Next") < place("What would refute this") < place("Smallest detectable size")
    assert "ΔBIC" not in done.out
    for word in words:
        assert word in done.out


def commands_in(text: str) -> list[list[str]]:
    """The lutgen command lines that a page recommends next."""
    return [shlex.split(each) for each in re.findall(r"  (lutgen .*)$", text, flags=re.MULTILINE)]


def test_the_refined_model_agrees_with_the_data_and_keeps_its_verdict(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("leak", tmp_path).name
    done = run("refine", data, "--auto", "-o", "model.toml")
    assert (done.code, "Verdict: named" in done.out) == (0, True), done.err
    model = load_model(tmp_path / "model.toml")
    assert (model.verdict, [each.effect.name for each in model.effects]) == ("named", ["black-level"])
    assert run("compare", data, "--model", "model.toml").lines[0].startswith("The model agrees")
    again = run("diagnose", data, "--model", "model.toml")
    assert "consistent: " in again.out
    assert run("refine", data, "--model", "model.toml", "--add", "black-level").code == 2


def test_refining_a_saved_model_keeps_what_no_fit_touches(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("leak", tmp_path).name
    (tmp_path / "first.toml").write_text(
        f'schema = 1\n[display]\nfile = "{data}"\n[model]\nselection = "continuous"\nluminance = "measured"\n'
        f'reference = "absolute"\n[conditions]\nambient_lx = 60\n'
    )
    done = run("refine", data, "--model", "first.toml", "--add", "black-level", "-o", "second.toml")
    assert done.code == 0, done.err
    first, second = load_model(tmp_path / "first.toml"), load_model(tmp_path / "second.toml")
    for name in ("selection", "luminance", "reference", "conditions"):
        assert getattr(first, name) == getattr(second, name)


def test_refine_says_what_no_lut_carries(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("refine", write("edge", tmp_path).name, "--add", "edge-falloff")
    assert "edge-falloff depends on position, which a LUT cannot carry." in done.out
    assert "No model was written" in done.out


def test_an_effect_of_ones_own_is_added_by_file_and_by_formula(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("leak", tmp_path).name
    (tmp_path / "own.py").write_text(sketched("light added everywhere", misfit="a test"))
    by_file = run("refine", data, "--effects", "own.py", "--add", "my-effect", "-o", "own.toml")
    by_formula = run("refine", data, "--add-expr", "leak: xyz + k*white", "-o", "formula.toml")
    for done, name in ((by_file, "my-effect"), (by_formula, "leak")):
        assert done.code == 0, done.err
        assert done.lines[0].startswith(f"With {name} the error falls")
    assert run("compare", data, "--model", "own.toml").lines[0].startswith("The model agrees")
    assert run("compare", data, "--model", "formula.toml").lines[0].startswith("The model agrees")


@pytest.mark.slow
def test_where_nothing_known_explains_it_an_effect_is_sketched_that_does_better(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    data = write("outside", tmp_path).name
    done = run("diagnose", data, "--stub", "mine.py")
    assert "unexplained: " in done.out, done.err
    (following,) = commands_in(done.out)
    assert following == ["lutgen", "refine", data, "--effects", "mine.py", "--add", "my-effect"]
    before, after = re.findall(r"falls from ([\d.]+) × to ([\d.]+) × the noise", run(*following[1:]).lines[0])[0]
    assert float(after) < 0.8 * float(before)
    printed = run("diagnose", data)
    assert (tmp_path / "mine.py").read_text().strip() in printed.out


def told_of(condition: Condition) -> Iterator[str]:
    """Names of residuals that follow a condition: its signatures, alone, mixed and as added light; and its cell."""
    values = {column.name: np.array([column.shown]) for column in condition.columns}
    for name in condition.signatures(values, values):
        yield from (f"light by {name}", f"light by {name} and mixture, growing in Z", f"light added by {name} in X")
    yield f"{condition.cell}, x"


TOLD = [
    "light by level near 0.4, growing", "light by red near 0.8", "light by blue near 0.1 in Z", "light by red × green",
    "light by level near 0.1 at 500 h", "light added everywhere", "light added everywhere, growing in Z",
    "light added under the lens cap", "light added to black", "tips, at all hours alike",
    "black, growing with the hours", "grey, x", "red ramp, x", "secondary, x", "mixture, x", "lens cap, x",
    *(told for condition in CONDITIONS for told in told_of(condition)),
]  # fmt: skip


@pytest.mark.parametrize("told", TOLD)
def test_whatever_the_leftover_follows_its_sketch_keeps_the_contract(tmp_path: Path, told: str) -> None:
    path = tmp_path / "sketch.py"
    path.write_text(sketched(told, misfit="a test"))
    (effect,) = load_file(path)
    report = check(effect)
    assert report.passed, report.failure


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda condition: condition.cell)
def test_a_condition_without_a_sketch_of_its_own_is_sketched_from_its_declaration(
    tmp_path: Path, condition: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    pattern, sketch = of_condition(condition)
    assert re.match(pattern, f"light by {condition.cell} and level")
    monkeypatch.setattr("lutgen.report.effect_sketch.FOLLOWS", {pattern: sketch})
    path = tmp_path / "sketch.py"
    path.write_text(sketched(f"light by {condition.cell}, growing", misfit="a test"))
    assert f'needs=("{condition.columns[0].name}",)' in path.read_text()
    (effect,) = load_file(path)
    report = check(effect)
    assert report.passed, report.failure


def test_every_sketch_is_tried_above() -> None:
    first = {next(pattern for pattern in FOLLOWS if re.match(pattern, told)) for told in TOLD}
    assert first == set(FOLLOWS)


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda condition: condition.cell)
def test_what_follows_a_condition_is_sketched_with_a_column_of_it(condition: Condition) -> None:
    columns = {column.name for column in condition.columns}
    for told in told_of(condition):
        pattern = next(pattern for pattern in FOLLOWS if re.match(pattern, told))
        assert columns & set(FOLLOWS[pattern].needs), told


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), ("For general coverage: ", "nine positions", "effects that it opens", "u,v = 0.1,0.1")),
        (("--between", "crosstalk,loading"), ("To tell crosstalk from loading: ", "χ² between them today")),
        (("--effect", "edge-falloff"), ("To see edge-falloff: nine positions", "not at all")),
    ],
)
def test_plan_lists_what_to_measure_and_what_it_brings(
    run: Callable[..., Done], tmp_path: Path, options: tuple[str, ...], words: tuple[str, ...]
) -> None:
    done = run("plan", write("leak", tmp_path).name, *options, "-o", "plan.csv", "--ti1", "plan.ti1")
    assert (done.code, done.err) == (0, "")
    for word in (*words, "1 ×3", "Written: plan.csv", "Written: plan.ti1"):
        assert word in done.out
    rows = [line for line in (tmp_path / "plan.csv").read_text().splitlines() if not line.startswith("#")]
    sets = (tmp_path / "plan.ti1").read_text()
    assert f"NUMBER_OF_SETS {len(rows) - 1}" in sets
    assert f"{len(rows) - 1} readings, in this order:" in done.lines


def test_a_plan_without_patches_writes_no_list(run: Callable[..., Done], tmp_path: Path) -> None:
    told = ("--between", "black-level,loading", "-o", "plan.csv", "--ti1", "plan.ti1")
    done = run("plan", write("leak", tmp_path).name, *told)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("These readings already tell black-level from loading: ")
    assert "Written" not in done.out
    assert not (tmp_path / "plan.csv").exists()
    assert not (tmp_path / "plan.ti1").exists()


def test_a_plan_filled_in_is_a_table_of_readings(run: Callable[..., Done], tmp_path: Path) -> None:
    run("plan", write("leak", tmp_path).name, "-o", "plan.csv")
    text = (tmp_path / "plan.csv").read_text().splitlines()
    header = next(line for line in text if line.startswith("hour")).split(",")
    light: dict[tuple[float, ...], tuple[int, int, int]] = {
        (1, 1, 1): (95, 100, 109),
        (1, 0, 0): (41, 21, 2),
        (0, 1, 0): (36, 72, 12),
        (0, 0, 1): (18, 7, 95),
    }
    rows = []
    for line in text[text.index(",".join(header)) + 1 :]:
        cells = dict(zip(header, line.split(","), strict=True))
        code = tuple(float(cells[channel]) for channel in "RGB")
        cells |= {"hour": "0", **dict(zip("XYZ", map(str, light.get(code, (1, 1, 1))), strict=True))}
        rows.append(",".join(cells.values()))
    (tmp_path / "measured.csv").write_text("\n".join([",".join(header), *rows]) + "\n")
    assert read_measurements(tmp_path / "measured.csv").hours.size == len(rows)


@pytest.mark.parametrize("command", mostly_slow(COMMANDS, "compare", "refine", "plan"))
def test_json_on_standard_output_is_alone_there(run: Callable[..., Done], tmp_path: Path, command: str) -> None:
    data = write("leak", tmp_path).name
    more = ("--add", "black-level") if command == "refine" else ()
    alone = run(command, data, *more, "--json", "-")
    assert (alone.code, alone.err) == (0, "")
    beside = run(command, data, *more, "--json", "deep/numbers.json")
    assert beside.lines[0][:4] in {"The ", "With", "For ", "name"}
    assert json.loads(alone.out) == json.loads((tmp_path / "deep/numbers.json").read_text())


def test_without_replicates_the_noise_is_assumed_or_as_stated(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "once.csv").write_text(single(text_of("leak")))
    done = run("diagnose", "once.csv", "--json", "once.json")
    assert done.code == 0, done.err
    assert "ASSUMED: too few replicates" in done.out
    assert "Too few replicates: the noise is assumed" in done.out
    assert json.loads((tmp_path / "once.json").read_text())["noise"]["source"] == "assumed"
    stated = run("compare", "once.csv", "--instrument", "0.002,0.003")
    assert "0.2 % and 0.003 cd/m², as stated" in stated.out


@pytest.mark.parametrize("command", ["compare", "diagnose", "plan"])
def test_a_single_hour_is_data_enough_to_look_at(run: Callable[..., Done], tmp_path: Path, command: str) -> None:
    done = run(command, write("one hour", tmp_path).name)
    assert (done.code, done.err) == (0, "")
    assert command == "plan" or "readings at 0 h" in done.out


def test_one_session_is_a_display_at_hour_0(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("refine", write("one hour", tmp_path).name, "--add", "black-level", "-o", "new.toml", "--keep")
    assert (done.code, done.err) == (0, "")
    done = run("build", "--model", "new.toml", "--hours", "0", "--format", "cube", "--cubesize", "17", "-o", "luts")
    assert (done.code, done.err) == (0, "")
    assert json.loads((tmp_path / "luts/manifest.json").read_text())["model"]["reference"] == "absolute"


def test_a_model_to_which_nothing_is_added_is_written_only_to_be_kept(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("healthy", tmp_path).name
    done = run("refine", data, "--auto", "-o", "same.toml")
    assert (done.code, done.lines[0]) == (1, "Nothing was added: the model stays as it was.")
    assert words(done.err) == "Nothing was added, so no model is written. Add --keep to write it all the same."
    assert ("-o MODEL.toml" in done.out, (tmp_path / "same.toml").exists()) == (False, False)


def test_options_are_handed_on_to_the_next_command(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("leak", tmp_path).rename(tmp_path / "room 3.csv").name
    done = run("compare", data, "--selection", "continuous", "--instrument", "0.002,0.003")
    assert commands_in(done.out) == [
        ["lutgen", "diagnose", "room 3.csv", "--selection", "continuous", "--instrument", "0.002,0.003"]
    ]


#: Command line after the data → words of the one sentence. {leak} and {tips} are data files.
BAD: dict[str, str] = {
    "compare missing.csv": "missing.csv: cannot read the readings: no such file",
    "compare folder": "folder: the folder holds no readings. Put sessions into it",
    "compare notes.txt": "notes.txt: is no CGATS: no table in it begins with BEGIN_DATA",
    "compare {leak} {leak}": "unexpected extra argument",
    "compare {leak} --baseline stale": "'stale' is not one of 'colour-points', 'first-hour'",
    "compare {leak} --selection furthest": "'furthest' is not one of 'nearest', 'continuous'",
    "compare {leak} --instrument good": "instrument noise 'good': give two numbers above 0",
    "compare {leak} --instrument 0.002": "give two numbers above 0",
    "compare {leak} --instrument=-1,0.003": "give two numbers above 0",
    "compare {leak} --effects own.py": "compare needs --effects only",
    "compare {leak} --json taken.json": "taken.json: exists already. Add --force",
    "compare {leak} --json folder": "folder: is a folder",
    "compare {leak} --json notes.txt/numbers.json": "cannot write",
    "compare {leak} --plots notes.txt": "notes.txt: is a file. Give the name of a folder",
    "compare {leak} --plots pictures": "pictures/residuals.png: exists already. Add --force",
    "compare {leak} --model missing.toml": "cannot read the model: no such file",
    "compare {leak} --model notes.txt": "not a model file (TOML)",
    "compare {leak} --model {tips}": "holds measurements, not a saved model. Give it with --display, or as DATA.",
    "compare fresh.toml": "fresh.toml: is a saved model, not a table of measurements. Give it with --model.",
    "build --hours 0 --display fresh.toml -o out": "fresh.toml: is a saved model, not a table of measurements. Give it",
    "build --hours 0 --model {leak} -o out": "holds measurements, not a saved model. Give it with --display",
    "compare {leak} --model unknown.toml": "unknown effect 'gravity'",
    "compare {leak} --model fresh.toml --baseline colour-points": (
        "--baseline colour-points contradicts --model, whose baseline is first-hour"
    ),
    "compare {leak} --model fresh.toml --selection nearest": "whose selection is continuous",
    "diagnose {leak} --without gravity": "unknown effect 'gravity'",
    "diagnose {leak} --effects missing.py": "missing.py",
    "diagnose {leak} --effects notes.txt": "effects are read from Python files",
    "diagnose {leak} --add-expr xyz+": "expression",
    "diagnose {leak} --stub mine.txt": "mine.txt: give a name that ends in .py",
    "diagnose {leak} --stub own.py": "own.py: exists already",
    "diagnose {leak} --plots pictures": "exists already. Add --force",
    "diagnose {leak} --model bounds.toml": "lies outside its bounds",
    "refine {leak}": "Say what to add: --add NAME, --add-expr TEXT or --auto",
    "refine {leak} --add gravity": "unknown effect 'gravity'. Pick one of: ",
    "refine {leak} --add black-level,black-level": "is in the model already",
    "refine {leak} --add black-level --add black-level": "is in the model already",
    "refine {leak} --add backlight-decay": "Add --baseline first-hour",
    "refine {tips} --add eotf-drift": "Measure greys and ramps too",
    "refine {leak} --add black-level -o taken.toml": "taken.toml: exists already. Add --force",
    "refine {leak} --add black-level -o model.json": "give a name that ends in .toml",
    "refine {leak} --add black-level -o folder": "give a name that ends in .toml",
    "refine {leak} --add black-level -o notes.txt/model.toml": "cannot write",
    "refine {leak} --add black-level --plots pictures": "pictures/residuals.png: exists already",
    "refine {leak} --add-expr xyz": "expression",
    "refine {leak} --add-expr loop": "expression",
    "plan {leak} --between crosstalk": "--between takes two effects, A,B; 'crosstalk' names 1",
    "plan {leak} --between a,b,c": "names 3",
    "plan {leak} --between crosstalk,gravity": "unknown effect 'gravity'",
    "plan {leak} --between crosstalk,crosstalk": "crosstalk was given twice",
    "plan {leak} --between crosstalk,loading --effect warm-up": "Leave one out",
    "plan {leak} --effect gravity": "unknown effect 'gravity'",
    "plan {leak} -o plan.ti1": "give a name that ends in .csv",
    "plan {leak} -o taken.csv": "taken.csv: exists already",
    "plan {leak} --ti1 plan.csv": "give a name that ends in .ti1",
}


@pytest.mark.parametrize(("line", "says"), BAD.items(), ids=list(BAD))
def test_bad_input_is_one_sentence_and_writes_nothing(
    run: Callable[..., Done], tmp_path: Path, line: str, says: str
) -> None:
    files = {"leak": write("leak", tmp_path).name, "tips": write("tips only", tmp_path).name}
    for name in ("taken.json", "taken.toml", "taken.csv", "notes.txt", "pictures/residuals.png", "folder/kept"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("here first")
    (tmp_path / "own.py").write_text(sketched("tips, x", misfit="a test"))
    head = 'schema = 1\n[display]\nfile = "leak.csv"\n'
    (tmp_path / "unknown.toml").write_text(f'{head}[[effects]]\nname = "gravity"\norigin = "built-in"\n')
    (tmp_path / "fresh.toml").write_text(f'{head}[model]\nbaseline = "first-hour"\nselection = "continuous"\n')
    (tmp_path / "bounds.toml").write_text(
        f'{head}[[effects]]\nname = "meter-drift"\norigin = "built-in"\n[effects.parameters.drift]\nvalue = 1e6\n'
    )
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    done = run(*shlex.split(line.format(**files)))
    assert (done.code, done.out) == (2, ""), done
    lines = [each for each in done.err.splitlines() if each]
    (sentence,) = (each for each in lines if not each.startswith(("Usage: ", "Example: ", "Try ")))
    assert says in sentence
    assert sentence.startswith(("lutgen: error: ", "Error: "))
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_force_replaces_what_is_there(run: Callable[..., Done], tmp_path: Path) -> None:
    data = write("leak", tmp_path).name
    (tmp_path / "m.toml").write_text("here first")
    (tmp_path / "n.json").write_text("here first")
    done = run("refine", data, "--add", "black-level", "-o", "m.toml", "--json", "n.json", "--force")
    assert done.code == 0, done.err
    assert json.loads((tmp_path / "n.json").read_text())["model"] == "m.toml"
    assert load_model(tmp_path / "m.toml").effects


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (0.3, 838.0, "lens cap. 3 readings raise the χ² between them from 0.3 to 838 (20 is clear)."),
        (2.0, 8.0, "lens cap. 3 readings, read 3 times, raise the χ² between them from 2 to 20 (20 is clear)."),
        (
            1e-9,
            1e-9,
            "meter-offset would explain these readings almost as well as black-level. Nothing in one more session",
        ),
        (
            1.0,
            1.1,
            "meter-offset would explain these readings almost as well as black-level. Nothing in one more session",
        ),
        (50.0, 60.0, "The formulas of black-level and meter-offset differ on these readings by a χ² of 50"),
    ],
)
def test_what_separates_rivals_is_told_with_how_often_to_read_it(before: float, after: float, says: str) -> None:
    each = Separation(("black-level", "meter-offset"), "lens cap", POOL["lens cap"], before, after)
    sentence = diagnosis_page._separation(each, "data.csv")
    assert says in sentence
    assert ("lutgen plan data.csv --between black-level,meter-offset" in sentence) == says.startswith("lens cap")


@pytest.mark.parametrize(
    ("value", "stderr", "unit", "text"),
    [
        (12.3141, 0.243, "h", "12.31 ± 0.24 h"),
        (1.534e-5, 2.1e-7, "1", "(15.34 ± 0.21) ×10⁻⁶"),
        (0.0020058, 0.0000016, "1", "(2.0058 ± 0.0016) ×10⁻³"),
        (0.00417, 0.00057, "1", "0.00417 ± 0.00057"),
        (0.0, 0.001, "1", "0.0000 ± 0.0010"),
        (-3.2e-7, 1e-6, "1", "(-0.3 ± 1.0) ×10⁻⁶"),
        (19150.0, 44.0, "h", "(19.150 ± 0.044) ×10³ h"),
        (300.0, 120.0, "K", "300 ± 120 K"),
        (1.0, None, "1", "1"),
        (0.05, float("inf"), "1/K", "0.05 1/K"),
        (99.6, 9.99, "1", "99.6 ± 10.0"),
    ],
)
def test_a_value_and_its_error_are_readable(value: float, stderr: float | None, unit: str, text: str) -> None:
    assert with_error(value, stderr, unit) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.5e-5, "15 ×10⁻⁶"), (0.000452, "0.000452"), (9999.6, "10 ×10³"), (0.1, "0.1"), (0.0, "0"), (-0.02, "-0.02")],
)
def test_a_number_is_readable(value: float, text: str) -> None:
    assert readable(value) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [(None, "–"), (0.0, "0 %"), (0.004, "< 1 %"), (0.5, "50 %"), (0.9999, "> 99 %"), (1.0, "100 %")],
)
def test_a_share_is_readable(share: float | None, text: str) -> None:
    assert percent(share) == text


def test_black_is_a_level_and_the_others_are_spans_of_levels() -> None:
    of = partial(Slice, "level", n=5, delta_e_mean=1.0, rms_sigma=9.0, mean_residual_xyz=(0.1, 0.1, 0.1))
    assert placed(of("0", floor_delta_e_mean=0.1, floor_rms_sigma=1.0)) == "at level 0"
    assert placed(of("0–0.1", floor_delta_e_mean=0.1, floor_rms_sigma=1.0)) == "at levels 0–0.1"
