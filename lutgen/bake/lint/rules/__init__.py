"""The rules: one idea a file, found because the file is in this folder.

A module has ``KINDS``, the kinds of scan that it reads (keys of ``finding.READERS``), and ``check``, which yields what
it finds. What it says of a reader was tried; the tests try it again with the readers that are installed.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.finding import Finding


def rule_names() -> list[str]:
    """Names of all rules, as they are printed."""
    return sorted(module.name.replace("_", "-") for module in iter_modules(__path__))


def findings(kind: str, scan: Any) -> Iterator[Finding]:
    """Yield what all rules for a kind of file find in a scan of it."""
    for name in rule_names():
        module = import_module(f"{__name__}.{name.replace('-', '_')}")
        if kind in module.KINDS:
            for finding in module.check(scan):
                yield replace(finding, rule=name)
