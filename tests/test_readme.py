"""The README and the help texts are held to the code."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from lutgen.bake.formats import format_names
from lutgen.display import MODES, REFERENCES, SELECTIONS, default_display
from tests.examples_folder import COMMANDS, ROOT, make_folder, run_lutgen

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.texts

README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*COMMANDS, *MODES, *SELECTIONS, *REFERENCES, *format_names()])
def test_readme_mentions_every_command_mode_and_format(name: str) -> None:
    assert re.search(rf"\b{name}\b", README)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("examples"))


def blocks(language: str) -> list[str]:
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
    return [text for name, text in fenced if name == language]


@pytest.mark.slow
def test_readmes_commands_run_as_written(folder: Path) -> None:
    lines = [line for block in blocks("") for line in block.splitlines() if line.startswith("lutgen ")]
    assert len(lines) >= 4
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
