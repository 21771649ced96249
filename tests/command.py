"""Runs ``lutgen`` in the test's own process, as a shell would: standard output, standard error and exit code."""

from __future__ import annotations

import sys
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
