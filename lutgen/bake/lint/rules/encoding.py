"""Text that is not UTF-8: comments and titles in an old 8-bit encoding."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, PILLOW, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """Readers written in Python decode the file; the others take its bytes as they are."""
    if "not UTF-8" in scan.oddities:
        fates = refused(PILLOW, COLOUR, how="cannot decode it")
        line = scan.oddities["not UTF-8"].line
        yield Finding("has text that is not UTF-8", "Write comments and TITLE in ASCII.", line, fates)
