"""A user's effects in a process of their own, so that whatever they do ends, and is told in one sentence.

The parent asks for a file or a package to be loaded, or to be put to the contract; the child answers in lines of JSON
in a temporary file: first the names of the effects or why they are refused, then a line a clause. What it does not
come to say, because its time was up or because it died, is missing there.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable

#: Seconds that loading a file, or the contract of all its effects, may take. Built-in effects take well below one.
LIMIT_S = 10.0

#: Address space of a child, in bytes: a loop that collects without end fails before the machine does.
MAX_MEMORY = 4_000_000_000


@dataclass(frozen=True)
class Answers:
    """What a child said.

    Attributes
    ----------
    lines
        One object a line of its answers.
    ended
        ``""`` where it came to its end; else how it went, to be put behind a name: ``loops for ever …``.

    """

    lines: tuple[dict[str, Any], ...]
    ended: str

    def effects(self, what: str) -> list[str]:
        """Names of the effects that were loaded from ``what``. Raises LutgenError when they were not."""
        for line in self.lines:
            if "refused" in line:
                raise LutgenError(line["refused"])
            if "effects" in line:
                return list(line["effects"])
        message = f"{what}: {self.ended or 'ends Python'} while it is loaded. A file of effects only declares them."
        raise LutgenError(message)


def ask(task: str, kind: str, what: str, limit_s: float = LIMIT_S) -> Answers:
    """Start a child.

    Parameters
    ----------
    task
        ``load``, or ``check`` for the contract too.
    kind, what
        ``file`` and its path, or ``installed`` and an effect's name.
    limit_s
        Seconds after which it is stopped.

    """
    # Where this process finds its modules, the child does too; -P keeps the working folder out of it.
    path = os.pathsep.join(folder or str(Path.cwd()) for folder in sys.path)
    environment = os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
    with TemporaryDirectory(prefix="lutgen-") as folder:
        answers = Path(folder) / "answers"
        answers.touch()
        command = [sys.executable, "-P", "-m", __name__, str(answers), task, kind, what]
        silent = subprocess.DEVNULL
        try:
            done = subprocess.run(  # noqa: S603 - this Python, with arguments in a list
                command, env=environment, stdin=silent, stdout=silent, stderr=silent, timeout=limit_s, check=False
            )
            ended = _death(done.returncode)
        except subprocess.TimeoutExpired:
            ended = f"loops for ever, or takes longer than {limit_s:g} s,"
        lines = [json.loads(line) for line in answers.read_text("utf-8").splitlines(keepends=True) if line[-1] == "\n"]
    finished = bool(lines) and lines[-1] == {"done": True}
    return Answers(tuple(lines), "" if finished else ended or "ends Python")


def _death(code: int) -> str:
    if code >= 0:
        return ""
    return f"kills Python ({signal.strsignal(-code) or f'signal {-code}'})"


def what_was_raised(error: BaseException, file: str) -> str:
    """Tell an exception in few words: its type, its message, and the line of ``file`` that it came from."""
    line, trace = 0, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    said = " ".join(str(error).split())
    kind = "" if isinstance(error, LutgenError) else type(error).__name__
    return f"line {line}: {': '.join(part for part in (kind, said) if part)}" if line else f"{kind}: {said}"


def _serve(answers: str, task: str, kind: str, what: str) -> None:
    """Be the child."""
    _limit_memory()
    with Path(answers).open("a", encoding="utf-8") as file:

        def say(**line: Any) -> None:
            file.write(json.dumps(line) + "\n")
            file.flush()

        try:
            _work(task, kind, what, say)
        except LutgenError as error:
            say(refused=str(error))
        say(done=True)


def _work(task: str, kind: str, what: str, say: Callable[..., None]) -> None:
    from lutgen.effects import own
    from lutgen.effects.clauses import examine

    effects = own.imported(what) if kind == "file" else tuple(each for each in own.installed() if each.name == what)
    say(effects=[each.name for each in effects])
    for effect in effects if task == "check" else ():
        for clause in examine(effect):
            say(effect=effect.name, clause=clause.clause, passed=clause.passed, sentence=clause.sentence)
        say(effect=effect.name, tried=True)


def _limit_memory() -> None:
    with suppress(ImportError, ValueError, OSError):  # not on every system, and never above what was set before
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))


if __name__ == "__main__":
    _serve(*sys.argv[1:])
