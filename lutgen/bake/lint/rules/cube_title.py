"""A TITLE without quotes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import PILLOW, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """pillow_lut looks for the quotes, and falls over without them."""
    for entry in scan.named("TITLE"):
        if '"' not in entry.text:
            fates = refused(PILLOW, how="ends with an IndexError")
            yield Finding(f"has a TITLE without quotes: {entry.text}", 'Write TITLE "…".', entry.line, fates)
