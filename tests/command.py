"""Runs ``lutgen`` in the test's own process, as a shell would: standard output, standard error and exit code."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from typing import TYPE_CHECKING, NamedTuple

import pytest

from lutgen import cli

if TYPE_CHECKING:
    from collections.abc import Callable


class Done(NamedTuple):
    """What a command left."""

    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """Lines of standard output."""
        return self.out.splitlines()


def here(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run ``lutgen`` in this process and return what a process of its own would leave, half a second earlier."""
    out, err = io.StringIO(), io.StringIO()
    words = ["lutgen", *map(str, arguments)]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as ended:
            cli.main()
    return subprocess.CompletedProcess(words, int(ended.value.code or 0), out.getvalue(), err.getvalue())


def in_process(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *command: str
) -> Callable[..., Done]:
    """Return what runs ``lutgen``, or one of its commands, with arguments."""

    def lutgen(*arguments: str) -> Done:
        monkeypatch.setattr(sys, "argv", ["lutgen", *command, *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        caught = capsys.readouterr()
        return Done(int(ended.value.code or 0), caught.out, caught.err)

    return lutgen
