"""``--baseline native`` on the command line: the output of compare, build and check."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.colorimetry import linear_to_code, xyz_to_linear
from lutgen.effects import catalogue
from lutgen.names import AGING_BASELINES, BASELINES, FORETELLING_BASELINES, NATIVE_BASELINES
from tests.native_displays import BLACK, GREYS, MIXTURES, RAMPS, TIPS, Panel, session, write
from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.command import Done

EVERYTHING = [*TIPS, BLACK, *GREYS, *RAMPS, *MIXTURES]


@pytest.fixture
def run(run: Callable[..., Done], tmp_path: Path) -> Callable[..., Done]:
    """Run lutgen in this process, in a folder with a panel's readings."""
    write(session(Panel(), EVERYTHING), tmp_path / "panel.csv")
    write(session(Panel(), [*TIPS, *MIXTURES]), tmp_path / "lacking.csv")
    return run


def test_the_option_names_what_the_library_has() -> None:
    assert set(AGING_BASELINES) == set(BASELINES) - set(FORETELLING_BASELINES)
    assert set(NATIVE_BASELINES) < set(BASELINES)


@pytest.mark.slow
def test_compare_says_what_both_fresh_displays_miss(run: Callable[..., Done]) -> None:
    usual, native = run("compare", "panel.csv"), run("compare", "panel.csv", "--baseline", "native")
    for output in (usual.out, native.out):
        assert "First session: the paper's un-aged display predicts 33 readings" in " ".join(output.split())
    assert "Start from its own: --baseline native." in " ".join(usual.out.split())
    assert "Start from its own" not in native.out
    assert "lutgen diagnose panel.csv --baseline native\n" in usual.out
    assert "baseline native" in native.out


@pytest.mark.slow
@pytest.mark.rare(instead="test_compare_says_what_both_fresh_displays_miss")
def test_diagnose_says_so_too(run: Callable[..., Done]) -> None:
    done = run("diagnose", "panel.csv", "--baseline", "first-hour")
    assert "Start from its own: --baseline native." in " ".join(done.out.split())
    assert "Start from its own model:  lutgen diagnose panel.csv --baseline native-first-hour\n" in done.out


def test_a_display_with_other_curves_needs_its_own_model_before_an_effect_of_ones_own(run: Callable[..., Done]) -> None:
    # One effect is enough to try: none of the catalogue explains the curves of another display.
    few = ("diagnose", "panel.csv", "--without", ",".join({*catalogue()} - {"meter-offset"}))
    done = run(*few, "--stub", "effect.py")
    assert done.out.startswith("unexplained")
    advice = done.out.index("Start from its own model:  lutgen diagnose panel.csv --baseline native\n")
    remark = done.out.index("Too few replicates: the noise is assumed")
    assert advice < remark < done.out.index("An effect of your own to start from: effect.py")
    assert "An effect of your own to start from" not in run(*few).out


def test_its_json_is_as_the_schema_says(run: Callable[..., Done]) -> None:
    content = json.loads(run("compare", "panel.csv", "--baseline", "native", "--json", "-").out)
    validator("compare").validate(content)
    assert content["baseline"] == "native"
    assert content["first_session"]["native"] < content["first_session"]["paper"]


@pytest.mark.parametrize("command", ["compare", "diagnose", "refine", "plan", "build"])
def test_what_a_native_display_lacks_is_said_in_one_line(run: Callable[..., Done], command: str) -> None:
    rest = {
        "build": ["--display", "lacking.csv", "-o", "out"],
        "refine": ["lacking.csv", "--add", "black-level"],
    }.get(command, ["lacking.csv"])
    done = run(command, *rest, "--baseline", "native")
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "no black (code 0, 0, 0); no ramps: 5 levels or more" in done.err


def test_a_model_says_its_own_baseline(run: Callable[..., Done]) -> None:
    asked = ("panel.csv", "--baseline", "native", "--add", "black-level", "-o", "my.toml", "--keep")
    assert run("refine", *asked).code == 0
    assert "leave --display, --baseline" in " ".join(
        run("build", "--model", "my.toml", "--baseline", "native").err.split()
    )


def test_absolute_is_baked_as_the_panel_and_certified(run: Callable[..., Done], tmp_path: Path) -> None:
    """The file at hour 0 has black and a middle grey of the panel's own formula."""
    asked = ("--display", "panel.csv", "--hours", "0,18000", "--mode", "chroma-luma")
    native = ("--baseline", "native", "--selection", "continuous")
    assert run("build", *asked, *native, "--reference", "absolute", "-o", "own").code == 0
    assert run("check", "own", "--jobs", "1").code == 0
    text = (tmp_path / "own" / "chroma-luma" / "0h" / "aged.cube").read_text(encoding="utf-8")
    assert "baseline: native" in text
    table = np.array([line.split() for line in text.splitlines() if line[:1].isdigit()], dtype=float)
    for place, level in ((0, 0.0), (16, 0.5)):
        relative = np.array(Panel().xyz((level, level, level))) / Panel().xyz((1.0, 1.0, 1.0))[1]
        shown = linear_to_code(xyz_to_linear(relative))
        np.testing.assert_allclose(table.reshape(33, 33, 33, 3)[place, place, place], shown, atol=2e-5)
    assert run("build", *asked, *native, "--reference", "absolute", "-o", "again").code == 0
    assert _files(tmp_path / "own") == _files(tmp_path / "again")


def test_relative_is_the_identity_at_hour_0(run: Callable[..., Done], tmp_path: Path) -> None:
    asked = ("--display", "panel.csv", "--hours", "0", "--mode", "chroma", "--format", "cube", "--cubesize", "17")
    assert run("build", *asked, "--baseline", "native", "-o", "native").code == 0
    text = (tmp_path / "native" / "chroma" / "0h" / "aged.cube").read_text(encoding="utf-8")
    table = np.array([line.split() for line in text.splitlines() if line[:1].isdigit()], dtype=float)
    axis = np.linspace(0.0, 1.0, 17)
    np.testing.assert_allclose(table.reshape(17, 17, 17, 3)[3, 5, 7], axis[[7, 5, 3]], atol=1e-6)


def test_a_refined_native_model_is_baked_and_checked(run: Callable[..., Done], tmp_path: Path) -> None:
    leaking = replace(Panel(), leaking=0.6, fading=0.0)
    write(session(leaking, EVERYTHING, (0.0, 9000.0, 18_000.0)), tmp_path / "leaking.csv")
    asked = ("leaking.csv", "--baseline", "native", "--selection", "continuous", "--instrument", "0.002,0.003")
    done = run("refine", *asked, "--add", "black-level", "-o", "my.toml")
    assert done.code == 0
    assert "the error falls from" in " ".join(done.out.split())
    build = ("build", "--model", "my.toml", "--hours", "0,18000", "--mode", "chroma", "--cubesize", "17", "-o", "out")
    assert run(*build, "--jobs", "1").code == 0
    assert run("check", "out", "--jobs", "1").code == 0
    assert run("check", "out", "--model", "my.toml", "--jobs", "1").code == 0


def _files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
