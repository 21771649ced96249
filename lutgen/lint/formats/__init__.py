"""The kinds of file that lint reads: each module of this folder is a kind of file.

A module scans a file in one pass and does not trust the header. Rules read the scan and yield findings: which readers
refuse the file, or show other colours without an error. Each module defines ``FORMAT``.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from lutgen.lint.finding import Linted, LintFinding

#: A function that reads a scan and yields findings. Its name, with hyphens, is printed with each finding.
Rule = Callable[[Any], Iterator[LintFinding]]


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    #: The suffixes of its files, in lower case.
    suffixes: tuple[str, ...]
    #: Lints a file. With True it also tries the installed readers.
    lint: Callable[[Path, bool], Linted]
    #: All its rules.
    rules: tuple[Rule, ...]


def formats() -> list[FileKind]:
    """Return all kinds of file, in the order of the modules' names."""
    return [import_module(f"{__name__}.{module.name}").FORMAT for module in iter_modules(__path__)]


def findings(rules: Iterable[Rule], scan: object) -> Iterator[LintFinding]:
    """Yield the findings of all rules for a scan, in the order of the rules' names."""
    for rule in sorted(rules, key=_name):
        for finding in rule(scan):
            yield replace(finding, rule=_name(rule))


def _name(rule: Rule) -> str:
    return str(getattr(rule, "__name__", "")).replace("_", "-")
