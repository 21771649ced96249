"""Numbers of ``.spi3d`` and ``.csp`` that OpenColorIO reads as 0, and rows that it never looks at."""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import OCIO, Finding, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.table import TableScan

KINDS = ("lut", "3dl")


def check(scan: TableScan) -> Iterator[Finding]:
    """NaN and what stands behind a decimal comma become 0 without a word."""
    if scan.nan:
        yield Finding("has NaN or infinity", "Compute these rows anew.", scan.nan, wrong(*OCIO, how="reads 0"))
    if scan.comma:
        fates = wrong(*OCIO, how="reads up to the comma: 0,5 is 0")
        yield Finding("has decimal commas", "Write decimal points.", scan.comma, fates)
    if scan.size and scan.rows > prod(scan.size):
        yield Finding(
            f"has {scan.rows} rows where its header asks for {prod(scan.size)}",
            "It was edited by hand; export it again.",
            0,
            wrong(*OCIO, how="leaves the rest out"),
        )
