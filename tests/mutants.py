"""How many seeded faults in a module the tests notice; by hand: each mutant takes seconds, and the score is for people.

    python -m tests.mutants --trace lines.json            # which quick tests run which lines; needs coverage
    python -m tests.mutants --lines lines.json --count 300 lutgen/display lutgen/bake/digits.py

A mutant is a module with one operator, comparison, constant or condition changed. One process imports all and collects
all quick tests; each mutant is tried in a fork of it. A fault in a function takes the place of its code there; any
other is imported anew. The tests that run the line are tried, quickest first, until one fails or the budget is spent. A
fork that dies, or ends by its limits, has noticed its fault; a test that fails without any fault notices nothing.
"""

from __future__ import annotations

import argparse
import ast
import copy
import functools
import gc
import importlib
import importlib.abc
import importlib.util
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from itertools import zip_longest
from pathlib import Path
from types import CodeType, FunctionType
from typing import TYPE_CHECKING, NamedTuple

import pytest
from _pytest.runner import runtestprotocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import ModuleType

#: What becomes of an operator or a comparison.
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

#: Seconds of processor time, beyond which the process of a mutant is ended.
LIMIT = 120

#: Seconds by the clock after which a mutant counts as noticed: its process waits for ever.
PATIENCE = 600

#: What a fork answers where the fault is outside functions.
ANEW = "anew"

QUICK = ["-q", "-p", "no:cacheprovider", "-m", "not slow"]
ROOT = Path(__file__).parents[1]


class Mutant(NamedTuple):
    """One change of one file: the place of the node in ``ast.walk``."""

    file: str
    line: int
    what: str
    place: int


def mutants(file: Path) -> Iterator[Mutant]:
    """Yield every mutant of a file; what only types need is left alone."""
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


def changed(mutant: Mutant) -> CodeType:
    """Return the compiled module with the change, its lines numbered as before."""
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
    return compile(ast.fix_missing_locations(tree), str(ROOT / mutant.file), "exec", dont_inherit=True)


def _codes(code: CodeType) -> Iterator[CodeType]:
    for const in code.co_consts:
        if isinstance(const, CodeType):
            yield const
            yield from _codes(const)


def _place(code: CodeType) -> tuple[str, int]:
    return code.co_qualname, code.co_firstlineno


def swap(mutant: Mutant) -> bool:
    """Give all living functions of the file the changed code; False where the change is outside functions."""
    new = {_place(code): code for code in _codes(changed(mutant))}
    source = compile((ROOT / mutant.file).read_text(encoding="utf-8"), "", "exec", dont_inherit=True)
    old = {_place(code): code for code in _codes(source)}
    different = {name for name in old if new[name].replace(co_filename="") != old[name]}
    living = [
        each
        for each in gc.get_objects()
        if isinstance(each, FunctionType)
        and each.__code__.co_filename == str(ROOT / mutant.file)
        and _place(each.__code__) in different
    ]
    # A class's body is code too, but is run once, when it is imported: no living function has it.
    for each in living:
        each.__code__ = new[_place(each.__code__)]
    for each in gc.get_objects():
        if isinstance(each, functools._lru_cache_wrapper) and str(each.__module__).startswith("lutgen"):
            each.cache_clear()
    return bool(living)


class _Replaced(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from another code."""

    def __init__(self, mutant: Mutant) -> None:
        self._name = mutant.file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        self._mutant = mutant

    def find_spec(self, name: str, _path: object, _target: object = None) -> importlib.machinery.ModuleSpec | None:
        if name != self._name:
            return None
        return importlib.util.spec_from_file_location(name, ROOT / self._mutant.file, loader=self)

    def create_module(self, _spec: importlib.machinery.ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        exec(changed(self._mutant), module.__dict__)  # noqa: S102 - that is the mutant


class Lines:
    """Which tests run which lines, and how long each takes."""

    def __init__(self, file: Path) -> None:
        content = json.loads(file.read_text(encoding="utf-8"))
        self.seconds: dict[str, float] = content["seconds"]
        self._lines: dict[str, dict[str, list[str]]] = content["lines"]

    def tests(self, mutant: Mutant, *, whole_file: bool) -> list[str]:
        """Return those of the mutant's line, or of any line of its file, quickest first."""
        lines = self._lines.get(mutant.file, {})
        found = {test for line in lines for test in lines[line]} if whole_file else set(lines.get(str(mutant.line), ()))
        return sorted(found & self.seconds.keys(), key=lambda test: (self.seconds[test], test))

    def imported(self, mutant: Mutant) -> bool:
        """Whether the line is run outside tests: when its module is imported, or cases are collected."""
        return "" in self._lines.get(mutant.file, {}).get(str(mutant.line), ())


def _forked(work: Callable[[], str]) -> str:
    """What a fork of this process finds: the name of the test that failed, nothing, or how it died."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
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
    with os.fdopen(reading, "rb") as pipe:
        answer = pipe.read().decode()
    status = os.waitpid(child, 0)[1]
    return answer or (f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else "")


class Trial:
    """A pytest plugin that, instead of running the tests, runs those of each mutant."""

    def __init__(self, lines: Lines, chosen: dict[Path, list[Mutant]], budget: float) -> None:
        self._lines, self._chosen, self._budget = lines, chosen, budget
        self._deadly: Counter[tuple[str, str]] = Counter()
        self._items: dict[str, pytest.Item] = {}
        self._unsound: set[str] = set()

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        gc.unfreeze()  # what conftest froze: swap looks for functions among it
        self._items = {item.nodeid: item for item in session.items}
        self._sound = functools.cache(lambda test: not _forked(lambda: self._failing([test])))
        noticed: Counter[Path] = Counter()
        # In turn, so that a run that is ended early says as much of each target.
        for round_ in zip_longest(*([(target, each) for each in chosen] for target, chosen in self._chosen.items())):
            for target, mutant in filter(None, round_):
                answer = self._answer(mutant)
                noticed[target] += bool(answer)
                print(f"{mutant.file}:{mutant.line}: {mutant.what}: {answer or 'NOT NOTICED'}", flush=True)
        for target, chosen in self._chosen.items():
            print(f"{target}: {noticed[target]} of {len(chosen)} mutants are noticed", flush=True)
        return True

    def _answer(self, mutant: Mutant) -> str:
        """Return what noticed the mutant, or nothing."""
        while True:
            answer = _forked(lambda: self._failing(self._order(mutant)) if swap(mutant) else ANEW)
            if answer == ANEW or (not answer and self._lines.imported(mutant)):
                answer = self._anew(mutant)
            if "::" not in answer:
                return answer
            if self._sound(answer):
                self._deadly[mutant.file, answer] += 1
                return answer
            self._unsound.add(answer)

    def _order(self, mutant: Mutant, *, whole_file: bool = False) -> list[str]:
        tests = [
            test
            for test in self._lines.tests(mutant, whole_file=whole_file)
            if test in self._items.keys() - self._unsound
        ]
        return sorted(tests, key=lambda test: -self._deadly[mutant.file, test])

    def _failing(self, tests: list[str]) -> str:
        """Return the first of these tests that fails, or nothing."""
        start = time.process_time()
        for test in tests:
            if any(report.failed for report in runtestprotocol(self._items[test], log=False, nextitem=None)):
                return test
            if time.process_time() - start > self._budget:
                break
        return ""

    def _anew(self, mutant: Mutant) -> str:
        """Import all that is lutgen's again, with the fault, and run the line's tests, or the whole file's."""
        tests = self._order(mutant) or self._order(mutant, whole_file=True)
        spent, taken = 0.0, []
        for test in tests:
            spent += self._lines.seconds[test]
            if spent > self._budget:
                break
            taken.append(test)

        def work() -> str:
            for name in [name for name in sys.modules if name.partition(".")[0] in {"lutgen", "tests"}]:
                del sys.modules[name]
            sys.meta_path.insert(0, _Replaced(mutant))
            first = _First()
            folder = tempfile.mkdtemp()
            code = pytest.main(["-x", *QUICK, "-p", "no:xdist", "--basetemp", folder, *taken], plugins=[first])
            shutil.rmtree(folder, ignore_errors=True)
            return first.failed or ("" if code == pytest.ExitCode.OK else f"pytest ends with {int(code)}")

        return _forked(work) if taken else ""


class _First:
    """Remembers the first test that failed."""

    failed = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid


class Tracing:
    """A pytest plugin that writes down which test runs which lines."""

    def __init__(self, file: Path) -> None:
        self._file = file
        # By hand alone: no part of the environment of tests.
        coverage = importlib.import_module("coverage")
        self._seen = coverage.Coverage(data_file=None, include=[f"{ROOT}/lutgen/*"], config_file=False)
        self._seconds: dict[str, float] = {}
        self._failed: set[str] = set()

    def pytest_sessionstart(self) -> None:
        self._seen.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._seen.switch_context(item.nodeid)
        start = time.process_time()
        done = yield
        self._seconds[item.nodeid] = round(time.process_time() - start, 3)
        self._seen.switch_context("")
        return done

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if not report.passed:
            self._failed.add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        self._seen.stop()
        data = self._seen.get_data()
        lines = {}
        for file in sorted(data.measured_files()):
            lines[Path(file).relative_to(ROOT).as_posix()] = data.contexts_by_lineno(file)
        for test in self._failed:
            del self._seconds[test]
        self._file.write_text(json.dumps({"seconds": self._seconds, "lines": lines}), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", type=Path, help="files, or folders whose files are one target")
    parser.add_argument("--trace", type=Path, help="write which tests run which lines; ends then")
    parser.add_argument("--lines", type=Path, help="what --trace wrote")
    parser.add_argument("--tests", nargs="*", default=[], help="files of tests; without it all")
    parser.add_argument("--count", type=int, default=60, help="of each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budget", type=float, default=20.0, help="seconds of processor time for a mutant's tests")
    options = parser.parse_args()
    if options.trace:
        raise SystemExit(pytest.main([*QUICK, "-p", "no:xdist", *options.tests], plugins=[Tracing(options.trace)]))
    chosen: dict[Path, list[Mutant]] = {}
    for target in options.targets:
        files = sorted(target.rglob("*.py")) if target.is_dir() else [target]
        every = [mutant for file in files for mutant in mutants(file)]
        chosen[target] = random.Random(options.seed).sample(every, min(options.count, len(every)))  # noqa: S311 - no secret
    with tempfile.TemporaryDirectory() as folder:
        plugins = [Trial(Lines(options.lines), chosen, options.budget)]
        pytest.main([*QUICK, "-s", "-p", "no:xdist", "--basetemp", f"{folder}/tests", *options.tests], plugins=plugins)


if __name__ == "__main__":
    main()
