"""Every command's help ends with examples that work."""

import re
import shlex
from pathlib import Path

import pytest

from tests.examples_folder import COMMANDS, make_folder, run_lutgen
from tests.pages import all_commands, plain

pytestmark = pytest.mark.texts

#: Commands of README and docs, which tests/test_docs.py runs. Each command line runs only once.
RUN_BY_DOCS = frozenset(all_commands())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the examples. Display A has two sessions, since this test ignores the printed text."""
    folder = make_folder(tmp_path_factory.mktemp("examples"))
    readings = folder / "examples/display-a.csv"
    lines = readings.read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if line.startswith(("#", "hour,", "0,", "18000,"))]
    readings.write_text("".join(kept), encoding="utf-8")
    return folder


def examples(command: str) -> list[str]:
    """The example lines of a command's help."""
    text = COMMANDS[command].help
    assert text is not None
    _, _, after = text.partition("Example:")
    return [line.strip() for line in after.splitlines() if line.strip().startswith("lutgen ")]


#: Commands whose examples make the input files of other examples.
FIRST = ("build", "refine", "study plan")


@pytest.fixture(scope="module")
def prepared(folder: Path) -> Path:
    """The folder with the files that these commands' examples write, even if the docs also run the examples."""
    for command in FIRST:
        for line in examples(command):
            if plain(line) not in RUN_BY_DOCS or " -o " in line:
                # Fewer hours in a build are enough for the other examples.
                run_lutgen(line.replace("--hours 0..18000 ", "--hours 10000,18000 "), folder)
    return folder


@pytest.mark.slow(cases=3)
@pytest.mark.parametrize("command", [command for command in COMMANDS if command not in FIRST])
def test_every_commands_help_ends_in_examples_that_work(command: str, prepared: Path) -> None:
    for line in examples(command):
        if plain(line) not in RUN_BY_DOCS:
            run_lutgen(line, prepared)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_examples_of_every_commands_help_have_options_that_their_commands_have(name: str) -> None:
    lines = examples(name)
    assert any(line.startswith(f"lutgen {name}") for line in lines)
    for line in lines:
        words = shlex.split(line, comments=True)[1:]
        command = COMMANDS.get(" ".join(words[:2])) or COMMANDS[words[0]]
        options = {option for each in command.params for option in (*each.opts, *each.secondary_opts)}
        assert {word.partition("=")[0] for word in words if re.match("--?[a-zA-Z]", word)} <= options, line
