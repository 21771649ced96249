"""How many seeded faults in a module the quick tests detect. Run this by hand: each mutant takes seconds.

    pip install coverage                                    # only for --trace
    python -m tests.mutants --trace lines.json lutgen/display lutgen/bake/digits.py
    python -m tests.mutants --lines lines.json --count 300 lutgen/display lutgen/bake/digits.py

A mutant is a module with one operator, comparison, constant or condition changed. The mutant is written into a copy
of the repository, so that commands and workers that tests start also use it. The tests that run the changed line are
tried, fastest first, until one fails or the budget is spent. The other tests of the same files follow, because they
share fixtures. A process that dies or reaches its limits has detected the fault. A test that fails without any fault
detects nothing.
"""

import argparse
import ast
import copy
import importlib
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.util import cache_from_source
from itertools import accumulate, zip_longest
from pathlib import Path
from typing import NamedTuple

import pytest

#: Replacement of each operator and comparison.
SWAPS: dict[type, type] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Pow: ast.Mult,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
}

#: Limit of processor time in seconds for the process of a mutant.
LIMIT = 120

#: Limit of wall-clock time in seconds; a process that exceeds it hangs, and the mutant counts as detected.
PATIENCE = 600

#: External modules that are slow to import. They are imported once, before processes are forked. No plug-ins of pytest.
SLOW_TO_IMPORT = ("colour", "jsonschema", "matplotlib.pyplot", "scipy.optimize", "scipy.stats")

QUICK = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not slow"]
ROOT = Path(__file__).parents[1]


class Mutant(NamedTuple):
    """One change of one file: the index of the node in ``ast.walk``."""

    file: str
    line: int
    what: str
    place: int


def mutants(file: Path) -> Iterator[Mutant]:
    """Yield every mutant of a file; code that only types need is not changed."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    name = file.resolve().relative_to(ROOT).as_posix()
    for place, node in enumerate(ast.walk(tree)):
        for what in _changes(node):
            yield Mutant(name, getattr(node, "lineno", 0), what, place)


def _changes(node: ast.AST) -> list[str]:
    if isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp) and type(node.op) in SWAPS:
        return ["operator"]
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        return ["comparison"]
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return ["constant + 1"]
    if isinstance(node, ast.If | ast.IfExp) and not (
        isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    ):
        return ["condition"]
    return []


def changed(mutant: Mutant) -> str:
    """Return the source with the change."""
    tree = ast.parse((ROOT / mutant.file).read_text(encoding="utf-8"))
    node = list(ast.walk(tree))[mutant.place]
    if isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp):
        node.op = SWAPS[type(node.op)]()
    elif isinstance(node, ast.Compare):
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        node.value += 1
    elif isinstance(node, ast.If | ast.IfExp):
        node.test = ast.copy_location(ast.UnaryOp(ast.Not(), copy.copy(node.test)), node.test)
    return ast.unparse(ast.fix_missing_locations(tree))


def unchanged(mutant: Mutant) -> str:
    """Return the source without the change, formatted as :func:`changed` formats it."""
    return ast.unparse(ast.parse((ROOT / mutant.file).read_text(encoding="utf-8")))


class Lines:
    """The tests that run each line, and the duration of each test."""

    def __init__(self, files: list[Path]) -> None:
        """Read the output of :class:`Tracing`, in one file or several."""
        self.seconds: dict[str, float] = {}
        self._tests: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        for file in files:
            content = json.loads(file.read_text(encoding="utf-8"))
            self.seconds |= content["seconds"]
            for name, lines in content["lines"].items():
                for line, tests in lines.items():
                    self._tests[name][int(line)].update(tests)

    def tests(self, mutant: Mutant) -> Iterator[str]:
        """Yield the tests of the line, then the tests of the file if imports run the line, then other tests of their
        files. If imports run the line, all other tests follow: a test that reads a declaration runs no line of it.
        """
        lines = self._tests[mutant.file]
        given: set[str] = set()
        for nearest in (lines[mutant.line], set().union(*lines.values()) if "" in lines[mutant.line] else set()):
            yield from self._quickest(nearest - given)
            given |= nearest
        files = {test.partition("::")[0] for test in lines[mutant.line]}
        rest = self.seconds.keys() - given
        near = rest if "" in lines[mutant.line] else {test for test in rest if test.partition("::")[0] in files}
        yield from self._quickest(near)

    def _quickest(self, tests: set[str]) -> list[str]:
        return sorted(tests & self.seconds.keys(), key=lambda test: (self.seconds[test], test))


def _forked(work: Callable[[], str]) -> str:
    """Return the result of a fork of this process: the name of the failed test, nothing, or how the process died."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        os.setsid()
        silent = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silent, stream)
        signal.alarm(PATIENCE)
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT + 5))
        try:
            os.write(writing, work().encode())
        except BaseException as error:  # noqa: BLE001 - whatever it is, the fault shows
            os.write(writing, f"{type(error).__name__} outside tests".encode())
        os._exit(0)
    os.close(writing)
    status = os.waitpid(child, 0)[1]
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # also processes that a test left behind, which keep the pipe open
    with os.fdopen(reading, "rb") as pipe:
        answer = pipe.read().decode()
    return answer or (f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else "")


class Trial:
    """Run the tests on mutants in a copy of the repository."""

    def __init__(self, lines: Lines, folder: Path, budget: float) -> None:
        """Take the budget: the processor time in seconds of a mutant's tests, measured without any fault."""
        self._lines, self._copy, self._budget = lines, folder / "copy", budget
        self._scratch = folder / "tests"
        self._deadly: dict[str, Counter[str]] = defaultdict(Counter)
        self._sound: dict[tuple[str, str], bool] = {}
        away = shutil.ignore_patterns(".*", "build", "__pycache__")
        shutil.copytree(ROOT, self._copy, ignore=lambda *of: away(*of) - {".ci", ".github", ".gitignore"})
        # Commands that tests start import the copy.
        os.environ["PYTHONPATH"] = str(self._copy)
        os.chdir(self._copy)

    def answer(self, mutant: Mutant) -> str:
        """Return the test or the end of the process that detected the mutant, or nothing."""
        while True:
            tests = self._chosen(mutant)
            answer = self._failing(mutant.file, changed(mutant), tests) if tests else ""
            # If a process dies without a failed test, check that it does not die without the fault.
            if not answer or self._is_sound(mutant, answer if answer in tests else tests[0]):
                self._deadly[mutant.file][answer] += answer in tests
                return answer

    def _chosen(self, mutant: Mutant) -> list[str]:
        """Return the tests within the budget; tests that detected other faults of the file come first."""
        tests = [test for test in self._lines.tests(mutant) if self._sound.get((mutant.file, test), True)]
        tests.sort(key=lambda test: -self._deadly[mutant.file][test])
        spent = accumulate(self._lines.seconds[test] for test in tests)
        return [test for test, so_far in zip(tests, spent, strict=True) if so_far <= self._budget]

    def _is_sound(self, mutant: Mutant, test: str) -> bool:
        if (mutant.file, test) not in self._sound:
            self._sound[mutant.file, test] = not self._failing(mutant.file, unchanged(mutant), [test])
        return self._sound[mutant.file, test]

    def _failing(self, file: str, source: str, tests: list[str]) -> str:
        """Return the first test that fails with this source of a file, or nothing."""
        first = _First()

        def work() -> str:
            # The package ``tests`` must be that of the copy; this module's package is that of the repository.
            sys.modules.pop("tests", None)
            sys.path.insert(0, str(self._copy))
            options = ["-x", *QUICK, "--rootdir", str(self._copy), "--basetemp", str(self._scratch)]
            code = pytest.main([*options, *tests], plugins=[first])
            return first.failed or ("" if code == pytest.ExitCode.OK else f"pytest ends with {int(code)}")

        there = self._copy / file
        # Python recognises stale compiled files by seconds and size, which is not precise enough here.
        compiled = Path(cache_from_source(str(there)))
        compiled.unlink(missing_ok=True)
        there.write_text(source, encoding="utf-8")
        try:
            return _forked(work)
        finally:
            shutil.copyfile(ROOT / file, there)
            compiled.unlink(missing_ok=True)
            shutil.rmtree(self._scratch, ignore_errors=True)


class _First:
    """Record the first test that failed."""

    failed = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid


class Tracing:
    """A pytest plugin that records which test runs which lines, in this process and in processes that it starts."""

    def __init__(self, file: Path, targets: list[Path], folder: Path) -> None:
        """Trace the targets, and write the file at the end."""
        self._file, self._folder = file, folder
        # This script is run by hand, so coverage is not part of the environment of tests.
        coverage = importlib.import_module("coverage")
        include = ",".join(f"{each.resolve()}/*" if each.is_dir() else str(each.resolve()) for each in targets)
        settings = folder / "settings"
        settings.write_text(f"[run]\nparallel = true\npatch = fork, subprocess, _exit\ninclude = {include}\n")
        self._seen = coverage.Coverage(data_file=str(folder / "lines"), config_file=str(settings))
        self._seconds: dict[str, float] = {}
        self._failed: set[str] = set()

    def pytest_sessionstart(self) -> None:
        self._seen.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._seen.switch_context(item.nodeid)
        # Processes that the test starts read from these variables what to trace, and for which test.
        self._seen.set_option("run:context", item.nodeid)
        os.environ["COVERAGE_PROCESS_CONFIG"] = self._seen.config.serialize()
        start = sum(os.times()[:4])
        done = yield
        self._seconds[item.nodeid] = round(sum(os.times()[:4]) - start, 3)
        self._seen.switch_context("")
        return done

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if not report.passed:
            self._failed.add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        self._seen.stop()
        self._seen.save()
        self._seen.combine([str(self._folder)])
        data = self._seen.get_data()
        lines = {}
        for file in sorted(data.measured_files()):
            lines[Path(file).relative_to(ROOT).as_posix()] = data.contexts_by_lineno(file)
        for test in self._failed:
            del self._seconds[test]
        self._file.write_text(json.dumps({"seconds": self._seconds, "lines": lines}), encoding="utf-8")


def traced(file: Path, targets: list[Path], tests: list[str]) -> int:
    """Run the quick tests, and write which of them run which lines of the targets."""
    with tempfile.TemporaryDirectory() as folder:
        return int(pytest.main([*QUICK, *tests], plugins=[Tracing(file, targets, Path(folder))]))


def tried(chosen: dict[Path, list[Mutant]], lines: Lines, budget: float) -> None:
    """Try all mutants; print what detected each mutant, and the score of each target."""
    noticed: Counter[Path] = Counter()
    for name in SLOW_TO_IMPORT:
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(lines, Path(folder), budget)
        # The targets alternate, so that a run that stops early has covered all of them equally.
        for round_ in zip_longest(*([(target, each) for each in every] for target, every in chosen.items())):
            for target, mutant in filter(None, round_):
                start = time.monotonic()
                answer = trial.answer(mutant)
                noticed[target] += bool(answer)
                by = answer or ("NOT NOTICED" if any(lines.tests(mutant)) else "NO TEST RUNS IT")
                print(f"{time.monotonic() - start:3.0f} s {mutant.file}:{mutant.line}: {mutant.what}: {by}", flush=True)
        os.chdir(ROOT)
    for target, every in chosen.items():
        print(f"{target}: {noticed[target]} of {len(every)} mutants are noticed", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", type=Path, help="files, or folders whose files are one target")
    parser.add_argument("--trace", type=Path, help="write which tests run which lines; ends then")
    parser.add_argument("--lines", type=Path, nargs="+", help="what --trace wrote", default=[])
    parser.add_argument("--tests", nargs="+", default=[], help="files of tests that --trace runs; without it all")
    parser.add_argument("--count", type=int, default=60, help="of each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budget", type=float, default=20.0, help="seconds of processor time for a mutant's tests")
    options = parser.parse_args()
    if options.trace:
        raise SystemExit(traced(options.trace, options.targets, options.tests))
    chosen: dict[Path, list[Mutant]] = {}
    for target in options.targets:
        files = sorted(target.rglob("*.py")) if target.is_dir() else [target]
        every = [mutant for file in files for mutant in mutants(file)]
        chosen[target] = random.Random(options.seed).sample(every, min(options.count, len(every)))  # noqa: S311 - no secret
    tried(chosen, Lines(options.lines), options.budget)


if __name__ == "__main__":
    main()
