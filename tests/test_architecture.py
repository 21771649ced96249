"""The rules of architecture.md, read from the source: who imports whom, how long files are, what is banned."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lutgen"

#: A row imports only from rows above it; two siblings of a row do not import each other.
ROWS = (
    {"errors", "names"},
    {"colorimetry", "bindings", "files", "icc_tags", "schemas"},
    {"measurements", "effects"},
    {"display"},
    {"bake", "criticism", "sessions"},
    {"appearance"},  # sends images through LUTs that were baked
    {"study"},  # shows images through baked LUTs: it needs both
    {"report"},
    {"cli"},
)
ROW = {name: row for row, names in enumerate(ROWS) for name in names}

#: Modules outside the rows: the package's own face, which names public functions, and ``python -m lutgen``.
FACE = {"__init__", "__main__"}

MAX_LINES = 400
BANNED_NAMES = {"utils", "util", "helpers", "helper", "common", "misc"}

MODULES = sorted(PACKAGE.rglob("*.py"))


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def layer_of(path: str) -> str:
    """``display/paper.py`` → display, ``errors.py`` → errors."""
    return path.partition("/")[0].removesuffix(".py")


def imports(source: str, path: str) -> Iterator[tuple[int, str]]:
    """Line and layer of each import of lutgen's in a module, those for types and inside functions too."""
    package = ["lutgen", *path.split("/")[:-1]]
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            base = package[: len(package) - node.level + 1] if node.level else []
            module = [*base, *(node.module.split(".") if node.module else [])]
            names = (
                [".".join([*module, alias.name]) for alias in node.names] if len(module) == 1 else [".".join(module)]
            )
        for name in names:
            parts = name.split(".")
            if parts[0] == "lutgen" and len(parts) > 1 and parts[1] != "__version__":
                yield node.lineno, parts[1]


def climbs(source: str, path: str) -> list[str]:
    """The imports of a module that go up, or sideways to a sibling."""
    here = layer_of(path)
    found = []
    for line, layer in imports(source, path):
        if layer not in ROW:
            found.append(f"{path}:{line} imports {layer}, which has no row")
        elif here != layer and ROW[layer] >= ROW[here]:
            found.append(f"{path}:{line} ({here}) imports {layer}")
    return found


def test_there_is_something_to_read() -> None:
    assert {"errors.py", "display/paper.py", "bake/formats/cube.py", "cli/commands/build.py"} <= {
        *map(name_of, MODULES)
    }


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_module_climbs(path: Path) -> None:
    name = name_of(path)
    if layer_of(name) in FACE:
        return
    assert layer_of(name) in ROW, f"{name} has no row: add its folder to architecture.md and here"
    assert climbs(path.read_text(encoding="utf-8"), name) == []


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_nothing_imports_the_command_line(path: Path) -> None:
    name = name_of(path)
    if layer_of(name) != "cli" and name != "__main__.py":
        assert "cli" not in [layer for _, layer in imports(path.read_text(encoding="utf-8"), name)]


@pytest.mark.parametrize(
    ("source", "path", "found"),
    [
        ("from lutgen.bake.lut import Lut", "display/chain.py", 1),
        ("import lutgen.cli", "bake/build.py", 1),
        ("from lutgen import report, errors", "bake/build.py", 1),
        ("from lutgen.effects import leak", "measurements/csv.py", 1),
        ("from lutgen.appearance.apply import x", "bake/build.py", 1),
        ("def f():\n    from lutgen.cli import main", "report/show.py", 1),
        ("from ..bake import lut", "display/chain.py", 1),
        ("from lutgen.utils import f", "bake/build.py", 1),
        ("from lutgen.errors import LutgenError", "colorimetry.py", 0),
        ("from lutgen.bindings import ocio", "colorimetry.py", 1),
        ("from lutgen import __version__", "bake/build.py", 0),
        ("from . import lut", "bake/build.py", 0),
        ("from lutgen.bake.lut import Lut\nimport numpy", "bake/build.py", 0),
        ("from lutgen.display import MODES", "bake/build.py", 0),
    ],
)
def test_the_reader_of_imports_sees_who_climbs(source: str, path: str, found: int) -> None:
    assert len(climbs(source, path)) == found


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_module_is_two_ideas(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_LINES


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_module_is_named_after_nothing(path: Path) -> None:
    assert not BANNED_NAMES & {part.lstrip("_").removesuffix(".py") for part in path.relative_to(PACKAGE).parts}


def banned(source: str, *, may_print: bool) -> list[str]:
    """Handlers that swallow every error, and printing or exiting where only the command line may."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ExceptHandler):
            caught = {child.id for child in ast.walk(node.type) if isinstance(child, ast.Name)} if node.type else {""}
            raises = any(isinstance(child, ast.Raise) for child in ast.walk(node))
            if caught & {"", "Exception"} or ("BaseException" in caught and not raises):
                found.append(f"line {node.lineno}: catches everything")
        elif isinstance(node, ast.Call) and not may_print:
            called = ast.unparse(node.func)
            if called in {"print", "exit", "quit", "sys.exit", "sys.stdout.write", "sys.stderr.write"}:
                found.append(f"line {node.lineno}: {called}()")
    return found


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_module_swallows_errors_and_only_the_command_line_prints_and_exits(path: Path) -> None:
    may_print = layer_of(name_of(path)) in {"cli", "__main__"}
    assert banned(path.read_text(encoding="utf-8"), may_print=may_print) == []


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("try:\n    f()\nexcept:\n    pass", 1),
        ("try:\n    f()\nexcept Exception:\n    pass", 1),
        ("try:\n    f()\nexcept (ValueError, Exception) as error:\n    raise", 1),
        ("try:\n    f()\nexcept BaseException:\n    pass", 1),
        ("try:\n    f()\nexcept BaseException:\n    g()\n    raise", 0),
        ("try:\n    f()\nexcept lib.Exception:\n    pass", 0),
        ("print(1)", 1),
        ("sys.exit(2)", 1),
        ("console.print(1)", 0),
    ],
)
def test_the_reader_of_banned_habits_sees_them(source: str, found: int) -> None:
    assert len(banned(source, may_print=False)) == found
