"""Comments behind numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, OCIO, PILLOW, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)

_REMEDY = "Give the comment a line of its own, before LUT_3D_SIZE."


def check(scan: CubeScan) -> Iterator[Finding]:
    """Only ffmpeg stops reading after three numbers; in the header colour does too."""
    if "comment" in scan.oddities:
        odd = scan.oddities["comment"]
        fates = refused(*OCIO, PILLOW, COLOUR, how="wants three numbers and nothing else")
        yield Finding(f"has a comment behind a row: {odd.sample}", _REMEDY, odd.line, fates)
    for entry in scan.named("LUT_3D_SIZE", "LUT_1D_SIZE"):
        if any(word.startswith("#") for word in entry.words):
            fates = refused(*OCIO, PILLOW, how="wants a size and nothing else")
            yield Finding(f"has a comment in its header: {entry.text}", _REMEDY, entry.line, fates)
