"""Words that OpenColorIO skips with a warning, if anybody reads it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)


def check(scan: ConfigScan) -> Iterator[Finding]:
    """A misspelt key is an unknown key."""
    for warning in scan.warnings:
        quoted = warning.split("'")[1] if warning.count("'") > 1 else ""
        yield Finding(f"OpenColorIO warns: {warning[:200]}", "Correct the word, or take it out.", scan.line_of(quoted))
