"""The form of a Hald image: whole, square, of a level, in full colours and steps, and without a colour space."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import HALDCLUT, Finding, refused, wrong
from lutgen.bake.lint.hald import COLOURS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.hald import HaldScan

KINDS = ("hald",)

#: Levels that ffmpeg takes: a table of 4 to 256 points an edge.
LEVELS = range(2, 17)

#: Bits of a number without visible steps in a table.
FINE = 16


def check(scan: HaldScan) -> Iterator[Finding]:
    """A Hald image of level L has L³ pixels a side."""
    if not scan.width:
        fates = refused(HALDCLUT, how="reads no such picture")
        yield Finding("is empty" if not scan.bytes else "is no PNG", "Export it again.", 0, fates)
        return
    sides = f"has {scan.width} × {scan.height} pixels"
    if scan.level not in LEVELS or scan.height < scan.width:
        fates = refused(HALDCLUT, how="wants a cube's number of pixels a side")
        yield Finding(f"{sides}: no Hald image", "One of level 8 has 512 × 512.", 0, fates)
    elif scan.height > scan.width:
        fates = wrong(HALDCLUT, how="reads the upper square alone")
        yield Finding(f"{sides}, and a Hald image is square", "Cut it to the square.", 0, fates)
    if not scan.whole:
        fates = wrong(HALDCLUT, how="reads what is missing as black, or nothing")
        yield Finding("is cut off: its last chunk is missing", "Copy or export it again.", 0, fates)
    elif scan.missing:
        fates = wrong(HALDCLUT, how="reads what is missing as black, or nothing")
        what = f"holds {scan.missing} bytes of pixels fewer than {sides.removeprefix('has ')} of {scan.depth} bits"
        yield Finding(what, "Copy or export it again.", 0, fates)
    if scan.colour not in COLOURS:
        fates = wrong(HALDCLUT, how="shows the few colours that it has")
        yield Finding("is a picture of greys or of a palette", "Save it as RGB.", 0, fates, in_the_file=True)
    elif scan.depth < FINE:
        yield Finding(f"has {scan.depth} bits: dark greys move in steps of half a code", "Save it with 16 bits.")
    if scan.chunks:
        yield Finding(
            f"says how its numbers are to be seen ({', '.join(scan.chunks)}): ffmpeg ignores it, an editor that "
            "manages colours may convert the table",
            "Save it without a colour profile and gamma.",
        )
