"""Tables that hold one colour, or whose end was never filled in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)

_EVERYONE = (*OCIO, FFMPEG, PILLOW, COLOUR)


def check(scan: CubeScan) -> Iterator[Finding]:
    """White is the last row: when it and its neighbours are black, the writer stopped before."""
    table = scan.table
    if scan.size < 2 or table.rows < scan.size**3:
        return
    if (table.low == table.high).all():
        shown = " ".join(f"{value:g}" for value in table.low)
        fates = wrong(*_EVERYONE, how="shows one colour")
        yield Finding(f"has the same colour in every row: {shown}", "Export it again.", 0, fates, in_the_file=True)
    elif table.black_tail > 1:
        what = f"ends in {table.black_tail} rows of 0 0 0, where white and its neighbours should be"
        yield Finding(what, "Export it again.", 0, wrong(*_EVERYONE, how="shows white as black"), in_the_file=True)
