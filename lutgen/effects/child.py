"""Check of the contract of a file of effects in a child process with limits of time and memory.

``lutgen effects --check`` uses this module, so that the check ends for every file. The child writes lines of JSON into
a temporary file: first the names of the effects, or the reason why the file is refused; then one line for each clause.
If the child is stopped or dies, the remaining lines are missing.
"""

import json
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from lutgen.effects.contract import CLAUSES, Clause, Report, examine
from lutgen.effects.own import load_file
from lutgen.errors import LutgenError
from lutgen.files import scratch
from lutgen.processes import python_environment

#: Time limit in seconds for the check of a file. A built-in effect takes well below one second.
LIMIT_S = 10.0

#: Address space of a child, in bytes: an endless allocation fails before the machine runs out of memory.
MAX_MEMORY = 4_000_000_000


def check_file(path: str | Path, *, limit_s: float = LIMIT_S) -> tuple[Report, ...]:
    """Check the contract of every effect in a file.

    If the child ends during a clause, this clause is broken, and later effects are not checked.

    ``limit_s``: seconds after which the child is stopped.

    Raises LutgenError: as :func:`lutgen.effects.own.load_file`, or the child ended while loading the file.
    """
    answers, ended = _ask(path, limit_s)
    reports: list[Report] = []
    stopped_at = ""
    for name in _names(answers, ended, path):
        lines = [line for line in answers if line.get("effect") == name]
        clauses = [Clause(line["clause"], line["passed"], line["sentence"]) for line in lines if "clause" in line]
        if not lines or ("clause" in lines[-1] and len(clauses) < len(CLAUSES)):
            why = f"It was not tried, after {stopped_at!r}." if stopped_at else f"It {ended} when this is tried."
            clauses.append(Clause(list(CLAUSES)[len(clauses)], passed=False, sentence=why))
            stopped_at = stopped_at or name
        reports.append(Report(name, tuple(clauses)))
    return tuple(reports)


def _names(answers: list[dict[str, Any]], ended: str, path: str | Path) -> list[str]:
    """Return the names of the loaded effects. Raises LutgenError: the file was refused, or ended the child."""
    for line in answers:
        if "refused" in line:
            raise LutgenError(line["refused"])
        if "effects" in line:
            return list(line["effects"])
    raise LutgenError(f"{path}: {ended} while it is loaded. A file of effects only declares them.")


def _ask(path: str | Path, limit_s: float) -> tuple[list[dict[str, Any]], str]:
    """Run the child; return its lines, and how it ended, as the predicate of a sentence: ``loops for ever …``."""
    environment = python_environment(OPENBLAS_NUM_THREADS="1")
    with scratch() as folder:
        file = Path(folder) / "answers"
        file.touch()
        # -P keeps the working folder out of sys.path.
        command = [sys.executable, "-P", "-m", __name__, str(file), str(path)]
        silent = subprocess.DEVNULL
        try:
            code = subprocess.run(  # noqa: S603 - this Python, with arguments in a list
                command, env=environment, stdin=silent, stdout=silent, stderr=silent, timeout=limit_s, check=False
            ).returncode
            ended = f"kills Python ({signal.strsignal(-code) or f'signal {-code}'})" if code < 0 else "ends Python"
        except subprocess.TimeoutExpired:
            ended = f"loops for ever, or takes longer than {limit_s:g} s,"
        lines = file.read_text("utf-8").splitlines(keepends=True)
    return [json.loads(line) for line in lines if line[-1] == "\n"], ended


def _serve(answers: str, path: str) -> None:
    """Check the file and write the answers: the body of the child process."""
    with suppress(ImportError, ValueError, OSError):  # missing on some systems; a limit may not exceed an earlier limit
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
    with Path(answers).open("a", encoding="utf-8") as file:

        def say(**line: Any) -> None:
            file.write(json.dumps(line) + "\n")
            file.flush()

        try:
            effects = load_file(path)
        except LutgenError as error:
            say(refused=str(error))
            return
        say(effects=[each.name for each in effects])
        for effect in effects:
            for clause in examine(effect):
                say(effect=effect.name, clause=clause.clause, passed=clause.passed, sentence=clause.sentence)
            say(effect=effect.name, tried=True)


if __name__ == "__main__":
    _serve(*sys.argv[1:])
