"""Values outside 0..1, integers, and black and white where video's narrow range has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)

#: Largest value that a table of 0..1 may reach with colours outside the gamut; beyond it, it holds integers.
INTEGERS = 16.0

#: Black and white of video's narrow range, 64 and 940 of 1023, and how near a table comes to them.
NARROW, NEAR = (64 / 1023, 940 / 1023), 0.004


def check(scan: CubeScan) -> Iterator[Finding]:
    """Integer pictures clip at 0 and 1; float ones do not, so both may be meant."""
    table = scan.table
    low, high = float(table.low.min()), float(table.high.max())
    if high >= INTEGERS and "overflow" not in scan.oddities and "infinite" not in scan.oddities:
        fates = wrong(*OCIO, FFMPEG, PILLOW, COLOUR, how="shows almost everything as white")
        yield Finding(
            f"has values up to {high:g}: integers, not 0..1", "Divide by the largest code.", 0, fates, in_the_file=True
        )
    elif low < 0 or high > 1:
        yield Finding(
            f"has values from {low:g} to {high:g}; readers clip them when they write integers", "Keep float pictures."
        )
    greys = table.greys
    if 2 <= len(greys) == scan.size and all(abs(greys[end] - NARROW[end]).max() < NEAR for end in (0, -1)):
        yield Finding(
            f"puts black at {greys[0].mean():.4f} and white at {greys[-1].mean():.4f}: video's narrow range",
            "Use it only where the picture stays in narrow range behind it.",
        )
