"""The user's own effects: files and installed packages, good and bad, and the contract of effects."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lutgen.effects import Effect, Parameter, catalogue, child, effect
from lutgen.effects.child import LIMIT_S, check_file
from lutgen.effects.contract import CLAUSES, check, refuse_unsound
from lutgen.effects.own import everything, installed, load_file, recall
from lutgen.errors import LutgenError
from tests.quick import mostly_slow

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).resolve().parents[1]

HEAD = '''"""Glue between panel and glass glows a little.

XYZ += glow · tau · W.
"""

import numpy as np

from lutgen.effects import Parameter, effect

K = Parameter(0.1, (-1.0, 1.0), "1", "amount")


'''
DECLARED = '@effect(stage="optics", neutral={"k": 0.0}, k=K)\n'
GOOD = f"{HEAD}{DECLARED}def glue_glow(xyz, scene, *, k):\n    return xyz + k * scene.tau * scene.white\n"

#: Seconds after which these tests stop endless files: a child starts in 0.2 s, on a busy machine more slowly.
SHORT_S = 3.0


def there_and_back(each: Effect) -> object:
    """Return the effect that a worker process receives."""
    return pickle.loads(pickle.dumps(each))  # noqa: S301 - our own bytes


def write(folder: Path, source: str, name: str = "mine.py") -> Path:
    path = folder / name
    path.write_text(source, encoding="utf-8")
    return path


def body(lines: str, declared: str = DECLARED) -> str:
    """A file that declares an effect with one parameter k and a function with these lines."""
    indented = "".join(f"    {line}\n" for line in lines.splitlines())
    return f"{HEAD}{declared}def mine(xyz, scene, *, k):\n{indented}"


def test_a_file_gives_its_effects(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD)
    (loaded,) = load_file(path)
    assert (loaded.name, loaded.stage, loaded.origin) == ("glue-glow", "optics", str(path))
    assert loaded.summary == "Glue between panel and glass glows a little"
    assert load_file(path) == (loaded,)
    assert not (tmp_path / "__pycache__").exists()


def test_a_relative_path_stays_as_it_is_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, GOOD)
    monkeypatch.chdir(tmp_path)
    assert load_file("mine.py")[0].origin == "mine.py"
    assert check(load_file("mine.py")[0]).passed


def test_a_changed_file_is_read_anew(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD)
    load_file(path)
    write(tmp_path, GOOD.replace("glue_glow", "glue_grow"))  # same size, and written within the same second
    assert [each.name for each in load_file(path)] == ["glue-grow"]


def test_several_effects_of_a_file_tell_themselves_apart(tmp_path: Path) -> None:
    second = f'{DECLARED}def rim(xyz, scene, *, k):\n    """The rim glows."""\n    return xyz * (1 + k)\n'
    loaded = load_file(write(tmp_path, f"{GOOD}\n\n{second}"))
    assert [(each.name, each.summary) for each in loaded] == [
        ("glue-glow", "Glue between panel and glass glows a little"),
        ("rim", "The rim glows"),
    ]


def test_an_effect_that_is_imported_is_not_the_files_own(tmp_path: Path) -> None:
    source = f"from lutgen.effects.catalogue.black_level import black_level\n{GOOD}"
    assert [each.name for each in load_file(write(tmp_path, source))] == ["glue-glow"]


#: Content of a file → the message of its refusal.
BAD = [
    ("print('hello'\n", r"mine.py: line 1: not Python: '\(' was never closed"),
    ("x = 1\n\0", "mine.py: .*not Python"),
    (HEAD, "mine.py: declares no effect. Put the decorator"),
    ("", "mine.py: declares no effect"),
    (f"{HEAD}import nowhere\n", "line 13: ModuleNotFoundError: No module named 'nowhere'"),
    (f"{HEAD}1 / 0\n", "line 13: ZeroDivisionError: division by zero"),
    (f"{HEAD}raise SystemExit(0)\n", "line 13: SystemExit: 0"),
    (GOOD.replace("glue_glow", "black_level"), "'black-level' is a built-in effect. Rename the function"),
    (
        GOOD.replace('stage="optics"', 'stage="glue"'),
        "line 13: effect 'glue-glow': unknown stage 'glue'. Pick one of",
    ),
    (GOOD.replace('stage="optics", ', ""), "TypeError: .*'stage'"),
    (GOOD.replace("0.1, (", "2.0, ("), "parameter 'k': the typical value 2 lies outside its bounds -1..1"),
    (GOOD.replace('"1", "amount"', '"", "amount"'), "give its unit"),
    (GOOD.replace("*, k", "*, q"), "function and decorator differ in k, q"),
    (GOOD.replace("scene, *, k", "scene, k"), "write exactly two names before the star"),
    (GOOD.replace('{"k": 0.0}', "{}"), "neutral is empty"),
    (GOOD.replace('{"k": 0.0}', '{"q": 0.0}'), "neutral names 'q'. Pick from: k"),
    (GOOD.replace("k=K", 'k=K, needs=("ambient",)'), "needs names 'ambient'. Pick from: u, v, ambient_lx"),
    (GOOD.replace("k=K", 'k=K, needs="window"'), r"needs is the text 'window'. Write \('window',\)"),
    (GOOD.replace("k=K", 'k=K, forms=("k",)'), r"forms is the text 'k'. Write \('k',\)"),
    (GOOD.replace("k=K", 'k=K, forms=(("q",),)'), "forms names 'q'. Pick from: k"),
    (GOOD.replace("k=K", 'k=K, baseline="old"'), "unknown baseline 'old'. Pick one of: colour-points, first-hour"),
    (
        GOOD.replace("k=K", 'k=K, says="glows by {size} of {q}"'),
        r"says cannot be filled in \('q'\). It may insert {size}",
    ),
    (GOOD.replace("k=K", 'k=K, says_less="glows {less"'), "says_less cannot be filled in"),
    (GOOD.replace("k=K", "k=0.1"), r"parameter 'k' is 0.1. Declare it as Parameter\("),
]


@pytest.mark.parametrize(("source", "sentence"), BAD)
def test_a_bad_file_is_refused_in_one_sentence(tmp_path: Path, source: str, sentence: str) -> None:
    path = write(tmp_path, source)
    with pytest.raises(LutgenError, match=sentence) as caught:
        load_file(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    assert not [
        name for name in sys.modules if name.startswith("lutgen_own_") and sys.modules[name].__file__ == str(path)
    ]


@pytest.mark.parametrize("source", mostly_slow((source for source, _ in BAD), BAD[0][0], BAD[5][0]))
def test_a_check_in_a_process_of_its_own_refuses_in_the_same_sentence(tmp_path: Path, source: str) -> None:
    path, messages = write(tmp_path, source), []
    for read in (load_file, check_file):
        with pytest.raises(LutgenError) as caught:
            read(path)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ("input()", "line 13: EOFError"),
        ("import os\nos._exit(0)", "ends Python while it is loaded"),
        ("import os\nos.abort()", r"kills Python \(Aborted\) while it is loaded"),
        ("while True:\n    pass", "loops for ever, or takes longer than 1 s, while it is loaded"),
        ("x = []\nwhile True:\n    x.append(bytes(10**8))", "MemoryError"),
    ],
)
def test_a_check_ends_whatever_a_file_does(tmp_path: Path, lines: str, sentence: str) -> None:
    source = f"{HEAD}{lines}\n"
    with pytest.raises(LutgenError, match=sentence):
        check_file(write(tmp_path, source), limit_s=1.0 if "pass" in lines else LIMIT_S)


def test_a_child_that_is_stopped_after_the_last_clause_breaks_no_clause(monkeypatch: pytest.MonkeyPatch) -> None:
    passed = [{"effect": "glow", "clause": name, "passed": True, "sentence": "Fine."} for name in CLAUSES]
    monkeypatch.setattr(child, "_ask", lambda _path, _limit: ([{"effects": ["glow"]}, *passed], "loops for ever"))
    (report,) = check_file("glow.py")
    assert report.passed
    assert [each.clause for each in report.clauses] == list(CLAUSES)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("missing.py", "cannot read the effects: no such file"),
        ("folder.py", "cannot read the effects: is a directory"),
        ("effects.txt", "Give a name that ends in .py"),
    ],
)
def test_what_is_no_file_of_python_is_refused(tmp_path: Path, name: str, sentence: str) -> None:
    (tmp_path / "folder.py").mkdir()
    write(tmp_path, GOOD, "effects.txt")
    with pytest.raises(LutgenError, match=sentence):
        load_file(tmp_path / name)


@pytest.mark.parametrize(
    ("source", "clause", "sentence"),
    [
        (body("return xyz * scene.humidity"), "runs", "line 15: AttributeError.*'humidity'.*A scene has: hours, code"),
        (body("return 1 / 0"), "runs", "Raises line 15: ZeroDivisionError: division by zero with k = 0.1"),
        (body("raise KeyError(k)"), "runs", "KeyError"),
        (body("import sys\nsys.exit(3)"), "runs", "SystemExit: 3"),
        (body("import os\nos._exit(0)"), "runs", "It ends Python when this is tried"),
        (body("import os\nos.abort()"), "runs", r"It kills Python \(Aborted\)"),
        (body("return (xyz * (1 + k)).tolist()"), "runs", "Returns list. Return a numpy array of float64"),
        (body("return (xyz * (1 + k)).astype('f4')"), "runs", "Returns an array of float32"),
        (body("pass"), "runs", "Returns NoneType"),
        (body("return (xyz * (1 + k)).sum(axis=-1)"), "shapes", r"signal of shape \(48, 3\) and returns \(48,\)"),
        (body("return (xyz * (1 + k))[:1]"), "shapes", r"returns \(1, 3\)"),
        (body("return (xyz * (1 + k))[np.newaxis]"), "shapes", r"returns \(1, 48, 3\)"),
        (body("return xyz * (1.01 + k)"), "neutral", r"neutral values \(k = 0\) it changes the reading of code"),
        (body("return xyz + np.sqrt(-1.0)"), "neutral", "changes the reading"),
        (
            body("return xyz * np.sqrt(1 - 2 * k)"),
            "finite",
            "Gives NaN for the reading .* with k = 1. Narrow the bounds",
        ),
        (body("return xyz / (1 - k)"), "finite", "NaN and infinity|infinity and NaN|infinity"),
        (
            body("while k > 0.5:\n    pass\nreturn xyz * (1 + k)"),
            "finite",
            "It loops for ever, or takes longer than 3 s",
        ),
        (body("xyz *= 1 + k\nreturn xyz"), "input untouched", "Writes into the signal"),
        (
            body("out = xyz * (1 + k * scene.tau)\nscene.hours[:] = 0\nreturn out"),
            "input untouched",
            "into scene.hours",
        ),
        (
            body("return xyz * (1 + k * np.random.default_rng().normal())"),
            "repeatable",
            "Gives another result when it is called again",
        ),
        (
            body("return xyz + k * xyz.mean(axis=-2, keepdims=True)"),
            "reading by reading",
            "alone than among 48 readings",
        ),
        (body("return xyz * (1 + k * scene.radius)"), "columns named", r"u and v differ.* Add: needs=\('u', 'v'\)"),
        (
            body("return xyz * (1 + k * scene.ambient_lx / 1e3)", DECLARED.replace("k=K", 'k=K, needs=("window",)')),
            "columns named",
            "Names window in `needs`, which change nothing",
        ),
        (
            GOOD.replace("k=K", "k=K, q=K").replace("*, k", "*, k, q"),
            "parameters matter",
            "Parameter 'q' changes nothing between -1 and 1",
        ),
        (
            GOOD.replace("optics", "emission").replace("scene.white", "xyz"),
            "runs",
            r"could not be broadcast.* write scene.tau\[..., np.newaxis\]",
        ),
    ],
)
def test_a_broken_clause_is_named(tmp_path: Path, source: str, clause: str, sentence: str) -> None:
    path = write(tmp_path, source)
    if any(word in source for word in ("while", "_exit", "abort")):
        (report,) = check_file(path, limit_s=SHORT_S if "while" in source else LIMIT_S)
    else:
        (report,) = (check(each) for each in load_file(path))
    broken = [each for each in report.clauses if not each.passed]
    # A function with NaN everywhere also breaks further clauses.
    assert [each.clause for each in broken][: len(broken) if "-1.0)" not in source else 1] == [clause]
    assert re.search(sentence, broken[0].sentence), broken[0].sentence


def test_the_first_broken_clause_is_refused_before_any_fit(tmp_path: Path) -> None:
    sound, unsound = write(tmp_path, GOOD), write(tmp_path, body("return xyz * (1.01 + k)"), "unsound.py")
    sentence = r"unsound.py: effect 'mine' breaks the contract, clause 'neutral': At its neutral"
    with pytest.raises(LutgenError, match=sentence) as caught:
        refuse_unsound([sound, unsound])
    assert "\n" not in str(caught.value)


def test_a_sound_file_keeps_every_clause(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD)
    (report,) = check_file(path)
    assert report.passed, report.failure
    assert len(report.clauses) == 9
    assert check(load_file(path)[0]) == report
    refuse_unsound([path], ["xyz + k*white"])


def test_a_sound_effect_of_the_emission_and_one_that_needs_columns(tmp_path: Path) -> None:
    emission = GOOD.replace("optics", "emission").replace(
        "k * scene.tau * scene.white", "k * scene.tau[..., np.newaxis]"
    )
    needing = body("return xyz * (1 - k * scene.radius**2)", DECLARED.replace("k=K", 'k=K, needs=("u", "v")'))
    for source in (emission, needing):
        (report,) = check_file(write(tmp_path, source))
        assert report.passed, report.failure


@pytest.mark.slow
def test_what_comes_after_an_endless_effect_is_told_to_be_untried(tmp_path: Path) -> None:
    source = body("while True:\n    pass") + "\n\n" + GOOD.removeprefix(HEAD).replace("glue_glow", "zebra")
    mine, zebra = check_file(write(tmp_path, source), limit_s=SHORT_S)
    assert mine.failure is not None
    assert "loops for ever" in mine.failure.sentence
    assert zebra.failure is not None
    assert zebra.failure.sentence == "It was not tried, after 'mine'."


def test_a_time_limit_leaves_no_process_behind(tmp_path: Path) -> None:
    path = write(tmp_path, f"{HEAD}while True:\n    pass\n", "endless_for_ever.py")
    with pytest.raises(LutgenError, match="loops for ever"):
        check_file(path, limit_s=1.0)
    children = Path(f"/proc/self/task/{os.getpid()}/children")
    if children.exists():
        commands = [Path(f"/proc/{child}/cmdline").read_text() for child in children.read_text().split()]
        assert not [command for command in commands if "endless_for_ever" in command or not command]


def test_expressions_are_held_to_the_contract() -> None:
    with pytest.raises(LutgenError, match=r"xyz/\(1 - k\): effect 'xyz-k' breaks the contract, clause 'finite'"):
        refuse_unsound((), ["xyz/(1 - k)"])


@pytest.mark.parametrize("name", catalogue())
def test_built_in_effects_keep_the_contract(name: str) -> None:
    report = check(catalogue()[name])
    assert report.passed, report.failure


def test_everything_in_chain_order(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD)
    effects = everything([path, path], ["leak: xyz + k*white", "linear**(1 + d)"])
    assert set(effects) == {*catalogue(), "glue-glow", "leak", "linear-d"}
    stages = [each.stage for each in effects.values()]
    assert stages.index("optics") > stages.index("transfer")
    assert list(effects).index("glue-glow") < list(effects).index("leak")


@pytest.mark.parametrize(
    ("files", "expressions"),
    [
        ((GOOD, GOOD), ()),
        ((GOOD,), ("glue-glow: xyz + k*white",)),
        ((), ("xyz + k*white", "xyz - k*white")),
        ((), ("black-level: xyz + k*white",)),
    ],
)
def test_two_effects_of_one_name_are_refused(
    tmp_path: Path, files: tuple[str, ...], expressions: tuple[str, ...]
) -> None:
    paths = [write(tmp_path, source, f"file{number}.py") for number, source in enumerate(files)]
    with pytest.raises(LutgenError, match=r"two effects are named .* Rename one"):
        everything(paths, expressions)


@effect(stage="optics", neutral={"k": 0.0}, k=Parameter(0.1, (-1.0, 1.0), "1", "amount"))
def in_a_test(xyz: np.ndarray, scene: object, *, k: float) -> np.ndarray:  # noqa: ARG001 - an effect's signature
    return np.asarray(xyz * (1 + k))


def test_an_effect_declared_in_code_says_so_and_is_no_built_in_one() -> None:
    assert in_a_test.origin == f"code, module {__name__}"
    assert catalogue()["black-level"].origin == "built-in"
    assert check(in_a_test).passed
    with pytest.raises(LutgenError, match="was declared by a running program"):
        recall("in-a-test", in_a_test.origin)


def test_effects_go_to_worker_processes(tmp_path: Path) -> None:
    (own,) = load_file(write(tmp_path, GOOD))
    for each in (own, catalogue()["black-level"], in_a_test):
        assert there_and_back(each) == each
    # In a process that has not loaded the file, like a spawned worker.
    (tmp_path / "pickled").write_bytes(pickle.dumps(own))
    script = "import pickle, sys; print(pickle.load(open('pickled', 'rb')).name)"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout == "glue-glow\n", done.stderr


def test_effects_are_found_again_by_name_and_origin(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD)
    for each in everything([path], ["leak: xyz + k*white; k=0.1[0,1]"]).values():
        assert recall(each.name, each.origin) == each
    with pytest.raises(LutgenError, match=r"unknown effect 'gone'. Pick one of: glue-glow"):
        recall("gone", str(path))


def install(folder: Path, entry: str, source: str, name: str = "lutgen-glue") -> None:
    """Install a distribution with one module and one entry point, as pip does."""
    info = folder / f"{name.replace('-', '_')}-1.2.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(f"[lutgen.effects]\nglue = {entry}\n")
    (folder / f"{entry.partition(':')[0]}.py").write_text(source, encoding="utf-8")


@pytest.mark.parametrize("entry", ["glue_module_a", "glue_module_b:glue_glow"])
def test_installed_effects_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, entry: str) -> None:
    install(tmp_path, entry, GOOD)
    monkeypatch.syspath_prepend(tmp_path)
    (own,) = installed()
    assert (own.name, own.origin) == ("glue-glow", "lutgen-glue 1.2")
    assert everything()["glue-glow"] == own
    assert recall(own.name, "lutgen-glue 1.1") == own  # a later version is accepted
    assert there_and_back(own) == own
    assert check(own).passed
    refuse_unsound()


def test_an_installed_effect_is_held_to_the_contract(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, "glue_module_c", body("return xyz * (1.01 + k)"))
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LutgenError, match=r"lutgen-glue 1.2: effect 'mine' breaks the contract, clause 'neutral'"):
        refuse_unsound()


@pytest.mark.parametrize(
    ("entry", "source", "sentence"),
    [
        ("glue_broken_a", "import nowhere\n", "ModuleNotFoundError: No module named 'nowhere'"),
        ("glue_broken_b", "1 / 0\n", "ZeroDivisionError: division by zero"),
        ("glue_broken_c", "x = 1\n", "glue_broken_c holds no effect"),
        ("glue_broken_d:nothing", "x = 1\n", "AttributeError"),
        ("glue_broken_e:x", "x = 1\n", "glue_broken_e:x holds no effect"),
        ("glue_broken_f", "raise SystemExit(1)\n", "SystemExit: 1"),
        ("glue_broken_g", GOOD.replace("glue_glow", "black_level"), "'black-level' is a built-in effect"),
    ],
)
def test_a_broken_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, entry: str, source: str, sentence: str
) -> None:
    install(tmp_path, entry, source)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LutgenError, match=f"installed package lutgen-glue 1.2, entry point 'glue'.*{sentence}"):
        installed()


def test_without_packages_nothing_is_installed() -> None:
    assert installed() == ()


def test_a_selection_has_nothing_to_run() -> None:
    switching: Effect = replace(catalogue()["matrix-switching"], origin="code, here")
    assert [each.clause for each in check(switching).clauses] == ["runs"]


MEASURED = "from lutgen import DisplayModel, default_display, read_measurements\n"


def test_a_build_imports_no_contract_no_process_and_no_part_of_scipy(tmp_path: Path) -> None:
    script = f"""{MEASURED}
import sys
from lutgen.display import what_luts_carry
from lutgen.bake.build import BuildPlan, build
model = DisplayModel(read_measurements(default_display()))
build(model, BuildPlan((0.0,), modes=("chroma",), formats=("cube",), cubesize=17), "built", jobs=1)
what_luts_carry(model)
print(*(name for name in sys.modules if name.startswith(("lutgen.effects.", "scipy."))))
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert "lutgen.effects.declare" in loaded
    assert not loaded & {f"lutgen.effects.{name}" for name in ("child", "contract", "clauses", "own")}
    # Parts of scipy take as long to load as a build of ten tables takes. Few displays need these parts.
    assert not loaded & {f"scipy.{name}" for name in ("interpolate", "linalg", "optimize", "special")}


def test_only_a_check_starts_a_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_arguments: object, **_options: object) -> None:
        raise AssertionError

    monkeypatch.setattr(subprocess, "Popen", refused)
    path = write(tmp_path, GOOD)
    (loaded,) = load_file(path)
    refuse_unsound([path])
    assert check(loaded).passed
    with pytest.raises(AssertionError):
        check_file(path)
