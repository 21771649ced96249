"""README, docs and the help texts are held to the code: each line of theirs runs, once."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from lutgen.bake.formats import format_names
from lutgen.display import MODES, REFERENCES, SELECTIONS, default_display
from tests.examples_folder import COMMANDS, ROOT, make_folder, run_lutgen

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from pathlib import Path

pytestmark = pytest.mark.texts

README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*COMMANDS, *MODES, *SELECTIONS, *REFERENCES, *format_names()])
def test_readme_mentions_every_command_mode_and_format(name: str) -> None:
    assert re.search(rf"\b{name}\b", README)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("examples"))


def blocks(language: str, text: str = README) -> list[str]:
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    return [text for name, text in fenced if name == language]


def examples(command: str) -> list[str]:
    """The example lines of a command's help."""
    text = COMMANDS[command].help
    assert text is not None
    return [line.strip() for line in text.partition("Example:")[2].splitlines() if line.strip().startswith("lutgen ")]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_commands_help_ends_in_examples(command: str) -> None:
    assert examples(command)


@pytest.mark.slow
def test_each_line_of_readme_docs_and_help_runs_and_prints_what_the_text_says(folder: Path) -> None:
    """A line that stands in several texts runs once."""
    given = {*folder.rglob("*")}
    printed: dict[tuple[str, ...], str] = {}

    def run(line: str) -> str:
        words = tuple(word.rstrip("/") for word in shlex.split(line, comments=True))
        if words not in printed:
            make_room(words, folder, given)
            printed[words] = " ".join(run_lutgen(line, folder).split())
        return printed[words]

    texts = [README, *(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").rglob("*.md")))]
    parts = [
        part
        for text in texts
        for block in blocks("", text)
        for part in re.split(r"(?m)^(?=lutgen )", block)
        if part.startswith("lutgen ")
    ]
    assert len(parts) >= 4
    differ = []
    for part in parts:
        line, _, output = part.partition("\n")
        # What a command prints may follow it; "…" stands for what is left out.
        told = [" ".join(said.replace("…", "").split()) for said in re.split(r"\n…\n|\n\n", f"\n{output}")]
        differ += [(line, said) for said in told if said not in run(line)]
    for line in (line for command in ("build", *COMMANDS) for line in examples(command)):
        run(line)
    assert differ == []


def make_room(words: Sequence[str], folder: Path, given: Collection[Path]) -> None:
    """Remove what a line is to write and another text's line has written."""
    for option, value in pairwise(words):
        path = folder / value
        if option in {"-o", "--json", "--csv", "--plot", "--plots", "--ti1"} and path not in given:
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)


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
