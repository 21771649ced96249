"""Every command's help ends in examples that work."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.examples_folder import COMMANDS, make_folder, run_lutgen
from tests.pages import all_commands, plain

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.texts

#: A command line is run once: what README and docs show, tests/test_docs.py runs.
RUN_BY_DOCS = frozenset(all_commands())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the examples name; of display A two sessions, since what is printed is not looked at here."""
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


@pytest.mark.slow
def test_every_commands_help_ends_in_examples_that_work(folder: Path) -> None:
    """One after the other: others use what those of build and refine make, whether the docs run these too or not."""
    first = ("build", "refine")
    for command in [*first, *(name for name in COMMANDS if name not in first)]:
        lines = examples(command)
        assert lines, command
        for line in lines:
            if command in first or plain(line) not in RUN_BY_DOCS:
                run_lutgen(line, folder)
