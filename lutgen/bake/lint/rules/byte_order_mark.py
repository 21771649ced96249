"""A UTF-8 byte order mark glues itself to the first word of the file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """Where the mark hides LUT_3D_SIZE nobody reads on; where it hides a TITLE most do not miss it."""
    if not scan.marked:
        return
    fates = refused(COLOUR, how="cannot read the marked line")
    if scan.size_line == 1:
        fates |= refused(FFMPEG, PILLOW, *OCIO, how="the mark hides LUT_3D_SIZE")
    yield Finding("starts with a UTF-8 byte order mark", "Save it as ASCII, without the mark.", 1, fates)
