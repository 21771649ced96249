"""How many seeded faults in a module the tests notice: ``python -m tests.mutants lutgen/bake/digits.py --tests FILE…``.

A mutant is the module with one operator, comparison, constant or condition changed. Each is tried in a process of its
own, forked from one that has loaded the libraries, and is noticed when a test fails. No check runs this program: each
mutant takes seconds, and the score is for people.
"""

from __future__ import annotations

import argparse
import ast
import importlib.abc
import importlib.util
import os
import random
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator
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

#: Seconds after which a mutant counts as noticed: it loops.
LIMIT = 300


def mutated(source: str) -> Iterator[tuple[int, str, str]]:
    """Yield every mutant of a source: line, what is changed, and the whole source."""
    for place, node in enumerate(ast.walk(ast.parse(source))):
        for what in _changes(node):
            tree = ast.parse(source)
            _apply(list(ast.walk(tree))[place], what)
            yield getattr(node, "lineno", 0), what, ast.unparse(tree)


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


def _apply(node: ast.AST, what: str) -> None:
    if isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp) and what == "operator":
        node.op = SWAPS[type(node.op)]()
    elif isinstance(node, ast.Compare):
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        node.value += 1
    elif isinstance(node, ast.If | ast.IfExp):
        node.test = ast.UnaryOp(ast.Not(), node.test)


class _Replaced(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from another source."""

    def __init__(self, name: str, file: Path, source: str) -> None:
        self._name, self._file, self._source = name, file, source

    def find_spec(self, name: str, _path: object, _target: object = None) -> importlib.machinery.ModuleSpec | None:
        if name != self._name:
            return None
        return importlib.util.spec_from_file_location(name, self._file, loader=self)

    def create_module(self, _spec: importlib.machinery.ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self._source, str(self._file), "exec"), module.__dict__)  # noqa: S102 - that is the mutant


def noticed(file: Path, source: str, tests: list[str]) -> bool:
    """Whether a test fails with this source in the place of the file's."""
    child = os.fork()
    if child == 0:
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        signal.alarm(LIMIT)
        sys.meta_path.insert(0, _Replaced(".".join(file.with_suffix("").parts), file, source))
        os._exit(int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not slow", *tests])))
    return os.waitpid(child, 0)[1] != 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--tests", nargs="+", required=True)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    # Not OpenImageIO: its threads do not survive a fork.
    for library in ("numpy", "scipy.optimize", "scipy.stats", "click"):
        __import__(library)
    every = [(file, *each) for file in options.files for each in mutated(file.read_text(encoding="utf-8"))]
    chosen = random.Random(options.seed).sample(every, min(options.count, len(every)))  # noqa: S311 - no secret
    for file in options.files:
        if noticed(file, file.read_text(encoding="utf-8"), options.tests):
            raise SystemExit(f"{file}: the tests fail, or there are none, without any fault")
    left = 0
    for file, line, what, source in chosen:
        if not noticed(file, source, options.tests):
            left += 1
            print(f"{file}:{line}: {what} is not noticed", flush=True)
    print(f"{len(chosen) - left} of {len(chosen)} mutants (of {len(every)}) are noticed")


if __name__ == "__main__":
    main()
