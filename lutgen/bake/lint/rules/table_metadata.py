"""Metadata of a ``.csp`` that are opened and never closed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import OCIO, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.table import TableScan

KINDS = ("lut", "3dl")


def check(scan: TableScan) -> Iterator[Finding]:
    """OpenColorIO does not look for the file's end there, so it is never given such a file."""
    if scan.unclosed:
        yield Finding(
            "opens its metadata and never closes them",
            "Write END METADATA behind them.",
            scan.unclosed,
            refused(*OCIO, how="reads on for ever, and fills the memory"),
        )
