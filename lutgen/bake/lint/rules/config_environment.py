"""Context variables, which few programs let their users set."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)


def check(scan: ConfigScan) -> Iterator[Finding]:
    """A variable without a default is an error in every program that does not set it."""
    if scan.config is None:
        return
    sources = [*(each.getSrc() for each in scan.file_transforms), *scan.config.getSearchPaths()]
    used = {name: text for text in sources for name in re.findall(r"[$%]\{?(\w+)", text)}
    without = [name for name in used if not scan.config.getEnvironmentVarDefault(name)]
    if without:
        what = f"chooses files by the variable {without[0]}, which has no default"
        yield Finding(what, "Give it one under environment.", scan.line_of(used[without[0]]))
    elif used:
        what = f"chooses files by the variable {min(used)}: programs that cannot set it show its default"
        yield Finding(what, "Give those programs a config of their own.", scan.line_of(used[min(used)]))
