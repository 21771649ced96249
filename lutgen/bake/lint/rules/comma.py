"""Commas: for the decimal point, or between numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """OpenColorIO reads up to a decimal comma, and skips a comma after a number."""
    others = refused(FFMPEG, PILLOW, COLOUR, how="finds no number")
    if "decimal comma" in scan.oddities:
        odd = scan.oddities["decimal comma"]
        fates = wrong(*OCIO, how="reads up to the comma: 0,5 is 0") | others
        yield Finding(f"has decimal commas: {odd.sample}", "Write decimal points.", odd.line, fates)
    if "comma" in scan.oddities:
        odd = scan.oddities["comma"]
        yield Finding(f"has commas between numbers: {odd.sample}", "Put spaces between them.", odd.line, others)
