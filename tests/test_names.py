"""Names that users type: one list for each kind, in a module that imports nothing slow."""

import ast
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest
from click import Choice, Context

import lutgen
from lutgen import names
from lutgen.bake.formats import format_named, format_names, lut_suffixes
from lutgen.lint import KINDS
from tests.examples_folder import COMMANDS

pytestmark = pytest.mark.texts

PACKAGE = Path(lutgen.__file__).parent
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path.name != "names.py")

#: Every list of the module, as a tuple of names.
LISTS = {
    name: tuple(value)
    for name, value in vars(names).items()
    if name.isupper() and isinstance(value, Iterable) and not isinstance(value, str)
}


def literals(source: str) -> list[tuple[str, ...]]:
    """Tuples, lists and sets that contain only strings."""
    tuples = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Tuple | ast.List | ast.Set):
            texts = [part.value for part in node.elts if isinstance(part, ast.Constant) and isinstance(part.value, str)]
            if texts and len(texts) == len(node.elts):
                tuples.append(tuple(texts))
    return tuples


@cache
def literals_of_the_package() -> list[tuple[str, set[str]]]:
    """Every such literal in the package, with its module."""
    return [
        (path.relative_to(PACKAGE).as_posix(), set(texts))
        for path in MODULES
        for texts in literals(path.read_text(encoding="utf-8"))
    ]


def test_the_module_imports_nothing_that_is_slow() -> None:
    tree = ast.parse((PACKAGE / "names.py").read_text(encoding="utf-8"))
    imported = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert imported == ["from pathlib import Path"]


def test_there_are_lists() -> None:
    assert LISTS["MODES"] == ("stable", "chroma", "chroma-luma")
    assert literals("a = {'x', 'y'}; b = ('x', y)") == [("x", "y")]


@pytest.mark.parametrize("name", [name for name, of in LISTS.items() if len(of) > 1])
def test_no_other_module_repeats_the_list(name: str) -> None:
    assert not [module for module, texts in literals_of_the_package() if texts == set(LISTS[name])]


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_offers_the_names_of_a_list(command: str) -> None:
    offered = {*LISTS.values(), ("auto", *LISTS["STAINS"]), ("1",)}
    for option in COMMANDS[command].params:
        if isinstance(option.type, Choice):
            assert tuple(option.type.choices) in offered, option.name


def test_the_suffixes_of_luts_are_those_of_the_formats() -> None:
    assert lut_suffixes() == names.LUT_SUFFIXES
    assert ".clf, .csp, .cube or .spi3d" in help_of("apply")


def test_the_help_of_lint_names_every_kind_of_file() -> None:
    called = {".icc": "ICC profiles", ".icm": "ICC profiles", ".png": "Hald PNG"}
    for suffix in KINDS:
        assert re.search(rf"{re.escape(called.get(suffix, suffix))}\b", help_of("lint")), suffix


def help_of(command: str) -> str:
    return " ".join(COMMANDS[command].get_help(Context(COMMANDS[command])).split())


def test_luts_that_opencolorio_reads_are_those_without_a_reader_of_lutgens() -> None:
    assert set(lut_suffixes()) == {
        format_named(name).suffix for name in format_names() if format_named(name).reader is None
    }
