"""The rules of the source tree, checked in the source: imports between layers, lengths of files, banned code.

Each rule has one test, which lists all violations.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from lutgen.readings.conditions import COLUMNS

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lutgen"

#: A module imports only from rows above its own row; two siblings of a row do not import each other. A name is the name
#: of a folder or file in ``lutgen/``.
ROWS = (
    {"callable_package", "errors", "cells", "names", "progress", "version"},
    {"files", "processes"},
    {"colorimetry", "bindings", "documents", "icc_tags", "numerals"},
    {"server", "time_law"},
    {"readings"},
    {"effects"},
    {"display"},
    {"bake", "criticism", "history"},
    {"pictures"},
    {"lint", "merge", "study"},  # each needs baked LUTs, and the study shows images through LUTs
    {"report"},
    {"explore"},
    {"cli"},
)
ROW = {name: row for row, names in enumerate(ROWS) for name in names}

#: Modules outside the rows: the package's ``__init__``, which names public functions, and ``python -m lutgen``.
FACE = {"__init__", "__main__"}

MAX_LINES = 400
BANNED_NAMES = {"utils", "util", "helpers", "helper", "common", "misc"}


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def layer_of(path: str) -> str:
    """Return the layer: ``display/paper.py`` → display, ``errors.py`` → errors."""
    return path.partition("/")[0].removesuffix(".py")


@cache
def nodes(source: str) -> tuple[ast.AST, ...]:
    """All nodes of a module, cached for all rules."""
    return tuple(ast.walk(ast.parse(source)))


def imports(source: str, path: str) -> Iterator[tuple[int, str]]:
    """Line and layer of each import of lutgen in a module, also imports for types and inside functions."""
    package = ["lutgen", *path.split("/")[:-1]]
    for node in nodes(source):
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
            if parts[0] == "lutgen" and len(parts) > 1:
                yield node.lineno, parts[1]


def module_of(path: str) -> str:
    """Return the module: ``display/paper.py`` → lutgen.display.paper, ``display/__init__.py`` → lutgen.display."""
    return ".".join(["lutgen", *path.removesuffix(".py").split("/")]).removesuffix(".__init__")


def needed(source: str, path: str, modules: dict[str, str]) -> set[str]:
    """Return the modules of lutgen that a module imports, also for types and inside functions."""
    known, names = {module_of(other) for other in modules}, set()
    for node in nodes(source):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "lutgen":
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                names.add(inner if inner in known else node.module)
    return (names & known) - {module_of(path)}


def climbs(source: str, path: str) -> list[str]:
    """The imports of a module from a lower row, or from a sibling in its row."""
    here = layer_of(path)
    violations = []
    for line, layer in imports(source, path):
        if layer not in ROW:
            violations.append(f"{path}:{line} imports {layer}, which has no row")
        elif here != layer and ROW[layer] >= ROW[here]:
            violations.append(f"{path}:{line} ({here}) imports {layer}")
    return violations


@pytest.fixture(scope="module")
def modules() -> dict[str, str]:
    """The source of every module, by its path in ``lutgen/``."""
    sources = {name_of(path): path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
    assert {"errors.py", "display/paper.py", "bake/formats/cube.py", "cli/commands/build.py"} <= sources.keys()
    return sources


def test_no_module_climbs(modules: dict[str, str]) -> None:
    inside = {name: source for name, source in modules.items() if layer_of(name) not in FACE}
    assert {layer_of(name) for name in inside} <= ROW.keys(), "give the folder a row here"
    assert [violation for name, source in inside.items() for violation in climbs(source, name)] == []


def test_no_circle_of_modules_imports_itself(modules: dict[str, str]) -> None:
    """Imports for types and imports inside functions count too: each module can be read after those that it uses."""
    needs = {module_of(path): needed(source, path, modules) for path, source in modules.items()}
    assert needs["lutgen.bake.build"] >= {"lutgen.bake.plan", "lutgen.errors"}
    while leaves := {name for name, others in needs.items() if not others & needs.keys()}:
        needs = {name: others for name, others in needs.items() if name not in leaves}
    assert needs == {}


def test_no_module_is_two_ideas(modules: dict[str, str]) -> None:
    long = {name: len(source.splitlines()) for name, source in modules.items()}
    assert {name: lines for name, lines in long.items() if lines > MAX_LINES} == {}


def test_no_module_is_named_after_nothing(modules: dict[str, str]) -> None:
    parts = {name: {part.lstrip("_").removesuffix(".py") for part in name.split("/")} for name in modules}
    assert [name for name in modules if BANNED_NAMES & parts[name]] == []


def test_no_module_swallows_errors_and_only_the_command_line_prints_and_exits(modules: dict[str, str]) -> None:
    violations = {
        name: banned(source, may_print=layer_of(name) in {"cli", "__main__"}) for name, source in modules.items()
    }
    assert {name: habits for name, habits in violations.items() if habits} == {}


def test_no_class_name_is_used_by_two_packages(modules: dict[str, str]) -> None:
    """A private class counts too: ``_Table`` is as easily taken for another package's ``Table``."""
    homes: dict[str, set[str]] = {}
    for path, source in modules.items():
        for node in nodes(source):
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name.lstrip("_"), set()).add(layer_of(path))
    assert {"DisplayModel", "Finding", "LintFinding"} <= homes.keys()
    assert {name: sorted(packages) for name, packages in homes.items() if len(packages) > 1} == {}


def test_only_its_file_and_effects_name_a_condition(modules: dict[str, str]) -> None:
    """``window`` is no name here: a window of the explore page has the same word."""
    violations = {name: named_columns(source) for name, source in modules.items() if not name.startswith(OF_CONDITIONS)}
    assert {name: found for name, found in violations.items() if found} == {}


def test_the_readers_of_imports_and_habits_see_them() -> None:
    violations = {(source, path): len(climbs(source, path)) for source, path in CLIMBS}
    assert violations == CLIMBS
    assert {source: len(banned(source, may_print=False)) for source in HABITS} == HABITS
    assert {source: named_columns(source) for source in COLUMNS_NAMED} == COLUMNS_NAMED


#: An import of lutgen, the module with the import, and the number of violations.
CLIMBS = {
    ("from lutgen.bake.lut import Lut", "display/chain.py"): 1,
    ("import lutgen.cli", "bake/build.py"): 1,
    ("import lutgen.cli", "report/show.py"): 1,
    ("from lutgen import report, errors", "bake/build.py"): 1,
    ("from lutgen.effects import leak", "readings/csv.py"): 1,
    ("from lutgen.pictures.apply import x", "bake/build.py"): 1,
    ("def f():\n    from lutgen.cli import main", "report/show.py"): 1,
    ("from ..bake import lut", "display/chain.py"): 1,
    ("from lutgen.utils import f", "bake/build.py"): 1,
    ("from lutgen.errors import LutgenError", "colorimetry.py"): 0,
    ("from lutgen.bindings import ocio", "colorimetry.py"): 1,
    ("from lutgen.version import __version__", "bake/build.py"): 0,
    ("from . import lut", "bake/build.py"): 0,
    ("from lutgen.bake.lut import Lut\nimport numpy", "bake/build.py"): 0,
    ("from lutgen.display import MODES", "bake/build.py"): 0,
}


def banned(source: str, *, may_print: bool) -> list[str]:
    """Handlers that catch every error, and code that prints or exits, which only the command line may do."""
    violations = []
    for node in nodes(source):
        if isinstance(node, ast.ExceptHandler):
            caught = {child.id for child in ast.walk(node.type) if isinstance(child, ast.Name)} if node.type else {""}
            raises = any(isinstance(child, ast.Raise) for child in ast.walk(node))
            if caught & {"", "Exception"} or ("BaseException" in caught and not raises):
                violations.append(f"line {node.lineno}: catches everything")
        elif isinstance(node, ast.Call) and not may_print:
            called = ast.unparse(node.func)
            if called in {"print", "exit", "quit", "sys.exit", "sys.stdout.write", "sys.stderr.write"}:
                violations.append(f"line {node.lineno}: {called}()")
    return violations


#: Folders whose modules may name a column of a condition.
OF_CONDITIONS = ("readings/conditions/", "effects/catalogue/")
NAMES_OF_COLUMNS = {column.name for column in COLUMNS.values() if len(column.name) > 1} - {"window"}


def named_columns(source: str) -> list[str]:
    """The columns of conditions that code names as a text of its own, or reads from a scene in a formula."""
    texts = [node.value for node in nodes(source) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return [name for text in texts for name in NAMES_OF_COLUMNS if text == name or f"scene.{name}" in text]


#: Code, and the columns that it names.
COLUMNS_NAMED = {
    'readings.conditions.get("temperature_c")': ["temperature_c"],
    '"xyz * scene.ambient_lx"': ["ambient_lx"],
    'help = "such as ambient_lx=60"': [],
    "scene.surround": [],
}

#: Code, and the number of its violations outside the command line.
HABITS = {
    "try:\n    f()\nexcept:\n    pass": 1,
    "try:\n    f()\nexcept Exception:\n    pass": 1,
    "try:\n    f()\nexcept (ValueError, Exception) as error:\n    raise": 1,
    "try:\n    f()\nexcept BaseException:\n    pass": 1,
    "try:\n    f()\nexcept BaseException:\n    g()\n    raise": 0,
    "try:\n    f()\nexcept lib.Exception:\n    pass": 0,
    "print(1)": 1,
    "sys.exit(2)": 1,
    "console.print(1)": 0,
}
