"""``lutgen effects``: the list, the explanation, the picture, the check, and its messages on bad input."""

from __future__ import annotations

import json
import subprocess
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from lutgen.cli.command import group
from lutgen.display import default_display
from lutgen.display.signature import CODES, Signature
from lutgen.effects import STAGES, catalogue
from lutgen.effects.expression import parse
from lutgen.effects.scene import LIFE_H
from lutgen.report.aging_plot import PAGE
from lutgen.report.drawing import DPI
from lutgen.report.effect_plot import plot_effect
from tests.command import in_process

pytestmark = pytest.mark.numbers

GOOD = '''"""Glue between panel and glass glows a little."""

from lutgen.effects import Parameter, effect


@effect(
    stage="optics",
    neutral={"glow": 0.0},
    confused_with={"black-level": "a lens cap"},
    glow=Parameter(0.002, (0.0, 0.05), "1", "share of white's light that the glue adds at 18 000 h"),
)
def glue_glow(xyz, scene, *, glow):
    return xyz + glow * scene.tau * scene.white
'''
BROKEN = GOOD.replace("scene.tau", "scene.humidity")
LEAK = "leak: xyz + k*tau*white; k=0.002[0,0.05]"


def run(*arguments: str) -> str:
    """Return the printed text of the command."""
    done = CliRunner().invoke(group, ["effects", *arguments], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "glue.py").write_text(GOOD, encoding="utf-8")
    (tmp_path / "glue.png").write_bytes(b"")
    (tmp_path / "broken.py").write_text(BROKEN, encoding="utf-8")
    (tmp_path / "raises.py").write_text(f"{GOOD}\n1 / 0\n", encoding="utf-8")
    (tmp_path / "endless.py").write_text(f"{GOOD}\nwhile True:\n    pass\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_list_names_every_effect_with_stage_columns_and_origin(folder: Path) -> None:
    text = run("--effects", "glue.py", "--add-expr", LEAK)
    assert text.startswith(f"{len(catalogue()) + 2} effects, 2 of them not built in, in the order in which they act")
    for effect in catalogue().values():
        assert f"\n{effect.name} " in text
    for word in (*STAGES, "ambient_lx", "first-hour", "glue.py", LEAK[:20], "Glue between panel"):
        assert word in text
    assert folder.name not in text


@pytest.mark.usefixtures("folder")
def test_the_registry_as_json() -> None:
    content = json.loads(run("--json", "--effects", "glue.py"))
    assert content["schema"] == 1
    effects = {each["name"]: each for each in content["effects"]}
    assert set(effects) == {*catalogue(), "glue-glow"}
    assert effects["glue-glow"]["origin"] == "glue.py"
    assert effects["glue-glow"]["parameters"]["glow"] == {
        "value": 0.002,
        "bounds": [0.0, 0.05],
        "unit": "1",
        "meaning": "share of white's light that the glue adds at 18 000 h",
        "neutral": 0.0,
        "grid": [],
    }
    assert effects["warm-up"]["needs"] == ["warmup_min"]
    assert [each["name"] for each in json.loads(run("black-level", "--json"))["effects"]] == ["black-level"]


@pytest.mark.parametrize("name", catalogue())
def test_each_effect_is_explained(name: str) -> None:
    effect, text = catalogue()[name], run(name)
    page = " ".join(text.split())
    for words in (effect.summary, STAGES[effect.stage], effect.baseline, *effect.needs, *effect.parameters):
        assert words in page
    for parameter in effect.parameters.values():
        assert parameter.meaning.split()[0] in page
    for other, separates in (effect.confused_with or {}).items():
        assert f"Looks like {other}; what separates them: {separates}." in page
    assert "ΔE2000" in page


@pytest.mark.usefixtures("folder")
def test_own_effects_are_explained() -> None:
    assert "xyz + k*tau*white" in run("leak", "--add-expr", LEAK)
    assert "Looks like black-level" in run("glue-glow", "--effects", "glue.py")
    broken = run("glue-glow", "--effects", "broken.py")
    assert "It breaks the contract, clause 'runs': Raises line 13: AttributeError" in broken


def test_the_picture_is_the_same_on_every_run(folder: Path) -> None:
    assert run("black-level", "--plot", "a.png").endswith("a.png\n")
    plot_effect(catalogue()["black-level"], folder / "b.png")
    assert (folder / "a.png").read_bytes() == (folder / "b.png").read_bytes()
    with Image.open(folder / "a.png") as image:
        assert image.size == tuple(int(inches * DPI) for inches in PAGE)
        assert image.info == {"dpi": pytest.approx((DPI, DPI), abs=0.1)}


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue())
def test_every_effect_can_be_drawn(name: str, tmp_path: Path) -> None:
    plot_effect(catalogue()[name], tmp_path / "effect.png")
    with Image.open(tmp_path / "effect.png") as image:
        ink = np.asarray(image.convert("RGB")).min(axis=-1) < 200
    assert ink.mean() > 0.01
    assert not ink[:, -8:].any(), "something runs over the right edge"


def test_what_tips_absorb_is_gone_from_the_signature() -> None:
    absorbed = Signature.of(catalogue()["backlight-decay"]).seen(CODES, LIFE_H)
    assert absorbed.whole.max() > 5
    assert absorbed.rest.max() < 1e-6
    leak = Signature.of(catalogue()["black-level"]).seen(CODES, LIFE_H)
    assert 0.5 < np.linalg.norm(leak.rest) / np.linalg.norm(leak.whole) < 1
    crosstalk = Signature.of(catalogue()["crosstalk"]).seen(np.eye(3), LIFE_H)
    assert crosstalk.whole.max() < 1e-6, "the ramps of one channel do not show crosstalk"


@pytest.mark.parametrize("name", [name for name, effect in catalogue().items() if effect.needs])
def test_what_needs_a_condition_is_shown_under_it(name: str) -> None:
    effect = catalogue()[name]
    assert set(effect.needs) <= set(Signature.of(effect).conditions)
    assert Signature.of(effect).seen(CODES, 0.0).whole.max() > 0.3


def test_a_doubled_light_is_what_the_signature_says() -> None:
    effect = parse("xyz*(1 + k); k=0.1[-0.5,0.5]")
    white = Signature.of(effect).seen(np.ones((1, 3)), 0.0)
    # L* = 116 (Y/Yn)^(1/3) − 16 (CIE 15:2018, 8.2.1).
    assert white.aged[0, 0] == pytest.approx(116 * np.cbrt(1.1) - 16, abs=1e-9)
    np.testing.assert_allclose(white.new[0], (100, 0, 0), atol=1e-9)
    np.testing.assert_allclose(white.model, white.aged, atol=1e-9)


Ended = Callable[..., tuple[int, str]]


@pytest.fixture
def ended(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Ended:  # noqa: ARG001 - where
    """Run the program in the folder. Return its exit code and all its output."""

    def run_main(*arguments: str) -> tuple[int, str]:
        done = in_process(monkeypatch, capsys, "effects")(*arguments)
        return done.code, done.out + done.err

    return run_main


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("nosuch",), 2, "unknown effect 'nosuch'. Pick one of: "),
        (("blacklevel",), 2, ". Did you mean black-level?"),
        (("glue-glow",), 2, "Pick one of: "),
        (("--effects", "missing.py"), 2, "missing.py: cannot read the effects"),
        (("--effects", "raises.py"), 2, "raises.py: cannot be loaded: line 15: ZeroDivisionError"),
        (("--effects", "glue.py", "--time-limit", "1.5"), 2, "--time-limit belongs to --check"),
        (("--add-expr", "xyz.real"), 2, "`xyz.real` is not allowed"),
        (("--add-expr", "xyz + " + "k" * 10_000), 2, "500 are allowed"),
        (("--plot", "a.png"), 2, "give its NAME too"),
        (("black-level", "--plot", "a.jpg"), 2, "pictures are written as PNG"),
        (("black-level", "--plot", "glue.png"), 2, "exists already. Add --force"),
        (("glue-glow", "--effects", "broken.py", "--plot", "b.png"), 2, "breaks the contract, clause 'runs'"),
        (("--data", "x.csv"), 2, "--data belongs to --check"),
        (("black-level", "--check", "glue.py"), 2, "--check goes only with"),
        (("--check", "glue.py"), 0, "glue-glow keeps all 9 clauses"),
        (("--check", "broken.py"), 1, "Raises line 13: AttributeError: 'Scene' object has no attribute 'humidity'"),
        (("--check", "missing.py"), 2, "missing.py: cannot read the effects"),
        (("--check", "raises.py"), 2, "line 15: ZeroDivisionError: division by zero"),
        (("--check", "endless.py", "--time-limit", "1.5"), 2, "loops for ever"),
        (("--check", "glue.py", "--time-limit", "0"), 2, "time-limit"),
    ],
)
def test_exit_codes_and_sentences(ended: Ended, arguments: tuple[str, ...], code: int, sentence: str) -> None:
    exit_code, output = ended(*arguments)
    assert exit_code == code, output
    assert sentence in " ".join(output.split())
    assert not Path("b.png").exists()


def test_what_a_file_prints_is_kept_out_of_json_and_nothing_warns(folder: Path) -> None:
    (folder / "loud.py").write_text(f"{GOOD}\nprint('hello')\n", encoding="utf-8")
    command = [sys.executable, "-W", "error", "-m", "lutgen", "effects", "glue-glow", "--effects", "loud.py", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, encoding="utf-8", check=False)
    assert json.loads(done.stdout)["effects"][0]["name"] == "glue-glow"
    assert done.stderr == "hello\n"


@pytest.mark.usefixtures("folder")
def test_the_check_as_json() -> None:
    for file, passed in (("glue.py", True), ("broken.py", False)):
        done = CliRunner().invoke(group, ["effects", "--check", file, "--json"], catch_exceptions=False)
        content = json.loads(done.stdout)
        assert done.exit_code == (0 if passed else 1)
        assert (content["schema"], content["file"], content["passed"]) == (1, file, passed)
        (effect,) = content["effects"]
        assert (effect["effect"], effect["passed"]) == ("glue-glow", passed)
        assert set(effect["clauses"][0]) == {"clause", "passed", "sentence"}


class Rehearsal(NamedTuple):
    absorbed: float = 0.12
    smallest_detectable: float = 0.0004
    unit: str = "1"
    likeness: tuple[tuple[str, float], ...] = (("black-level", 0.98), ("meter-offset", 0.61))
    recovered: bool = True
    sentence: str = "These readings would show a glow of 0.0004."


@pytest.fixture
def rehearsed(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Replace the rehearsal, and keep its arguments."""
    arguments: list[Any] = []

    def rehearse(effect: Any, measurements: Any, others: Any) -> Rehearsal:
        arguments.append((effect, measurements, others))
        return Rehearsal()

    module = types.ModuleType("lutgen.criticism.rehearse")
    module.__dict__["rehearse"] = rehearse
    monkeypatch.setitem(sys.modules, "lutgen.criticism.rehearse", module)
    return arguments


def test_a_check_on_data_that_show_nothing_of_it_says_so() -> None:
    tips_only = str(default_display())
    example = str(Path(__file__).parent.parent / "examples" / "viewing_gamma.py")
    text = " ".join(run("--check", example, "--data", tips_only).split())
    assert "It changes none of these readings" in text
    assert "hidden by white and primaries it leaves no trace" in text
    assert "smallest detectable size none" in text


@pytest.mark.usefixtures("folder")
def test_a_check_on_data_rehearses_what_is_sound(rehearsed: list[Any]) -> None:
    text = " ".join(run("--check", "glue.py", "--data", str(default_display())).split())
    assert "These readings would show a glow of 0.0004." in text
    assert "hidden by white and primaries 12 %" in text
    assert "smallest detectable size 0.0004 " in text
    assert "black-level 0.98, meter-offset 0.61" in text
    ((effect, measurements, others),) = rehearsed
    assert effect.name == "glue-glow"
    assert measurements.file == str(default_display())
    assert [each.name for each in others] == list(catalogue())
    content = json.loads(run("--check", "glue.py", "--data", str(default_display()), "--json"))
    assert content["effects"][0]["rehearsal"] == {
        "absorbed": 0.12,
        "smallest_detectable": 0.0004,
        "unit": "1",
        "likeness": [["black-level", 0.98], ["meter-offset", 0.61]],
        "recovered": True,
        "sentence": "These readings would show a glow of 0.0004.",
    }


@pytest.mark.usefixtures("folder")
def test_a_broken_effect_is_not_rehearsed(rehearsed: list[Any]) -> None:
    done = CliRunner().invoke(group, ["effects", "--check", "broken.py", "--data", str(default_display())])
    assert done.exit_code == 1
    assert rehearsed == []
