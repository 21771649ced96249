"""The README and the help texts are held to the code."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click import Command, Context, Group
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen.bake.formats import format_names
from lutgen.cli import group, shared
from lutgen.display import MODES, REFERENCES, SELECTIONS, DisplayModel, default_display
from lutgen.measurements import read_measurements
from lutgen.report.stub import sketched
from lutgen.study.protocol import write_protocol
from tests.planned_study import planned

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def commands(here: Group = group, before: str = "") -> dict[str, Command]:
    """Every command by its words, such as "study plan"; groups are those of their commands."""
    found: dict[str, Command] = {}
    for name in here.list_commands(Context(here)):
        command = here.get_command(Context(here), name)
        assert command is not None
        found |= commands(command, f"{before}{name} ") if isinstance(command, Group) else {f"{before}{name}": command}
    return found


COMMANDS = commands()


def test_options_name_what_the_library_has() -> None:
    assert tuple(MODES) == shared.MODES
    assert tuple(SELECTIONS) == shared.SELECTIONS
    assert REFERENCES == shared.REFERENCES


@pytest.mark.parametrize("name", [*COMMANDS, *MODES, *SELECTIONS, *REFERENCES, *format_names()])
def test_readme_mentions_every_command_mode_and_format(name: str) -> None:
    assert re.search(rf"\b{name}\b", README)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds what the examples name."""
    folder = tmp_path_factory.mktemp("examples")
    imsave(folder / "slide.png", immunohistochemistry()[:64, :64])
    for top, name in ((0, "a.tif"), (32, "b.tif")):
        imsave(folder / name, immunohistochemistry()[top : top + 32, :32])
    (folder / "compared").mkdir()
    (folder / "slides").mkdir()
    for name in ("a.tif", "b.tif"):
        shutil.copyfile(folder / name, folder / "slides" / name)
    shutil.copyfile(default_display(), folder / "my-display.csv")
    (folder / "examples").mkdir()
    for name in ("display-a.csv", "paper-study-counts.csv", "paper-study-summary.csv"):
        shutil.copyfile(ROOT / "examples" / name, folder / "examples" / name)
    write_protocol(folder / "planned", planned(4))
    (folder / "my_effect.py").write_text(sketched("light added everywhere", misfit="of an example"))
    shutil.copyfile(ROOT / "configs/default/chroma/10000h/aged.clf", folder / "theirs.clf")
    model = DisplayModel(read_measurements(default_display()))
    axis = np.linspace(0, 1, 33)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    table = model.at("chroma", 10_000).code_to_code(np.stack([red, green, blue], axis=-1)).reshape(-1, 3)
    rows = "".join(f"{r:.7f} {g:.7f} {b:.7f}\n" for r, g, b in table)
    (folder / "theirs.cube").write_text(f"LUT_3D_SIZE 33\n{rows}")
    return folder


def run_lutgen(line: str, folder: Path) -> str:
    arguments = shlex.split(line, comments=True)
    assert arguments[0] == "lutgen"
    command = [sys.executable, "-m", "lutgen", *arguments[1:]]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, (line, done.stderr)
    return done.stdout


def examples(command: str) -> list[str]:
    """The example lines of a command's help."""
    text = COMMANDS[command].help
    assert text is not None
    _, _, after = text.partition("Example:")
    return [line.strip() for line in after.splitlines() if line.strip().startswith("lutgen ")]


@pytest.mark.slow
@pytest.mark.parametrize("command", ["build", *(name for name in COMMANDS if name != "build")])
def test_every_commands_help_ends_in_examples_that_work(command: str, folder: Path) -> None:
    lines = examples(command)
    assert lines
    for line in lines:
        run_lutgen(line, folder)


def blocks(language: str) -> list[str]:
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
    return [text for name, text in fenced if name == language]


@pytest.mark.slow
def test_readmes_commands_run_as_written(folder: Path) -> None:
    lines = [line for block in blocks("") for line in block.splitlines() if line.startswith("lutgen ")]
    assert len(lines) >= 4
    for path in ("aged", "aged.png", "my-display.toml", "plan.csv", "plots", "study"):
        shutil.rmtree(folder / path, ignore_errors=True)
        if (folder / path).is_file():
            (folder / path).unlink()
    printed = {line: " ".join(run_lutgen(line, folder).split()) for line in lines}
    # A command's output may follow it; "…" stands for what is left out.
    parts = [
        part for block in blocks("") for part in re.split(r"(?m)^(?=lutgen )", block) if part.startswith("lutgen ")
    ]
    for part in parts:
        command, _, output = part.partition("\n")
        for said in re.split(r"\n…\n|\n\n", f"\n{output}"):
            assert " ".join(said.replace("…", "").split()) in printed[command], said


@pytest.mark.slow
def test_readmes_python_runs_as_written(folder: Path, tmp_path: Path) -> None:
    (code,) = blocks("python")
    assert len(code.strip().splitlines()) <= 7
    shutil.copyfile(folder / "slide.png", tmp_path / "slide.png")
    script = f"import numpy as np\ncode = np.zeros((2, 3))\n{code}\nassert aged_code.shape == (2, 3)\n"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=200
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "aged.png").is_file()


def test_readmes_model_file_loads(tmp_path: Path) -> None:
    from lutgen.display import load_model

    (text,) = blocks("toml")
    (tmp_path / "model.toml").write_text(text)
    shutil.copyfile(default_display(), tmp_path / "my-display.csv")
    model = load_model(tmp_path / "model.toml")
    assert (model.selection, model.luminance.name) == ("continuous", "measured")


def test_readmes_links_and_pictures_exist() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


@pytest.mark.skipif(shutil.which("oiiotool") is None, reason="oiiotool is not installed (Debian: openimageio-tools)")
def test_readmes_configs_work_in_oiiotool(folder: Path) -> None:
    for config in ("chroma/10000h/config.ocio", "config.ocio"):
        environment = os.environ | {
            "OCIO": str(ROOT / "configs/default" / config),
            "AGING_MODE": "chroma",
            "AGING_HOURS": "10000",
        }
        out = folder / f"{config.replace('/', '-')}.png"
        command = ["oiiotool", "slide.png", "--ociodisplay", "sRGB", "Aged", "-o", str(out)]
        subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True, timeout=60)
        assert out.is_file()
