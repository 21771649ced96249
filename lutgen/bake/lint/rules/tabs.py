"""Tabs between the numbers of a row."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import PILLOW, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """pillow_lut cuts rows at spaces alone."""
    if "tab" in scan.oddities:
        fates = refused(PILLOW, how="cuts rows at spaces alone")
        yield Finding("has tabs between numbers", "Write spaces.", scan.oddities["tab"].line, fates)
