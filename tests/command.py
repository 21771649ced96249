"""Run ``lutgen`` in the test's own process; return standard output, standard error and exit code."""

import io
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest

from lutgen import cli


class Done(NamedTuple):
    """The output and the exit code of a command."""

    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """Return the lines of standard output."""
        return self.out.splitlines()


def words(text: str) -> str:
    """Return printed text without its line breaks and no-break spaces."""
    return " ".join(text.replace("\N{NO-BREAK SPACE}", " ").split())


def error_of(printed: str) -> str:
    """Return the one line of an error; one example of the command may follow it."""
    error, *example = printed.splitlines()
    assert len(example) <= 1
    assert all(line.startswith("Example: lutgen ") for line in example)
    return error


def replaces_by_force_alone(run: Callable[..., Done], old: Path, *arguments: str) -> None:
    """Fail unless a command keeps an existing file of the user, and overwrites it with ``--force``."""
    old.write_text("mine")
    done = run(*arguments)
    assert (done.code, old.read_text()) == (2, "mine")
    assert f"{old.name}: exists already. Add --force to replace it" in done.err
    assert run(*arguments, "--force").code == 0
    assert old.read_bytes() != b"mine"


def exit_code(patch: pytest.MonkeyPatch, *arguments: object) -> int:
    """Run ``lutgen`` in this process and keep the process's handler of SIGTERM."""
    before = signal.getsignal(signal.SIGTERM)
    patch.setattr(sys, "argv", ["lutgen", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    signal.signal(signal.SIGTERM, before)
    return int(ended.value.code or 0)


def here(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run ``lutgen`` in this process; return the result of a separate process, half a second faster."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        code = exit_code(patch, *arguments)
    return subprocess.CompletedProcess(["lutgen", *map(str, arguments)], code, out.getvalue(), err.getvalue())


def in_process(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *command: str
) -> Callable[..., Done]:
    """Return a function that runs ``lutgen``, or one of its commands, with arguments."""

    def lutgen(*arguments: str) -> Done:
        code = exit_code(monkeypatch, *command, *arguments)
        caught = capsys.readouterr()
        return Done(code, caught.out, caught.err)

    return lutgen
