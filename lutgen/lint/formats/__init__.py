"""The kinds of file that lint reads: one module each in this folder, found by being there.

A module scans a file in one pass, believing nothing that a header claims. Rules read the scan and yield findings: which
readers refuse the file or silently show something else. The module ends in ``FORMAT``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from lutgen.lint.finding import Linted, LintFinding

if TYPE_CHECKING:
    from pathlib import Path

#: Reads a scan and yields what it finds. Its name, with hyphens, is printed with each finding.
Rule = Callable[[Any], Iterator[LintFinding]]


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    #: What its files end in, in small letters.
    suffixes: tuple[str, ...]
    #: Lints a file; with True it also asks the readers that are installed.
    lint: Callable[[Path, bool], Linted]
    #: All its rules.
    rules: tuple[Rule, ...]


def formats() -> list[FileKind]:
    """Return all formats, by file name."""
    return [import_module(f"{__name__}.{module.name}").FORMAT for module in iter_modules(__path__)]


def findings(rules: Iterable[Rule], scan: object) -> Iterator[LintFinding]:
    """Yield what rules find in a scan, in the order of the rules' names."""
    for rule in sorted(rules, key=_name):
        for finding in rule(scan):
            yield replace(finding, rule=_name(rule))


def _name(rule: Rule) -> str:
    return str(getattr(rule, "__name__", "")).replace("_", "-")
