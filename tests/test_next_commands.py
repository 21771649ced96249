"""From readings that a model does not fit to LUTs of a better model, by the next commands that each page names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.campaigns import write
from tests.command import in_process
from tests.test_criticism_commands import commands_in

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def test_each_page_names_the_next_command_and_it_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run = in_process(monkeypatch, capsys)
    (compared,) = commands_in(run("compare", write("leak", tmp_path).name).out)
    (refining,) = commands_in(run(*compared[1:]).out)
    done = run(*refining[1:])
    assert done.code == 0, done.err
    assert done.lines[0].startswith("With black-level the error falls from ")
    (building,) = commands_in(done.out)
    assert building[1:] == ["build", "--model", "my-display.toml", "--hours", "0..18000", "-o", "aged/"]
    done = run(*building[1:4], "--hours", "18000", "--mode", "chroma", "--format", "clf", "-o", "aged/")
    assert done.code == 0, done.err
    assert (tmp_path / "aged/chroma/18000h/aged.clf").is_file()
