"""LUT_3D_SIZE: missing, odd, said twice or too late, and the largest that each reader takes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, OCIO_26, PILLOW, REFUSES, Fate, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan, Entry

KINDS = ("cube",)

#: Points an axis, at most.
LARGEST = {PILLOW: 65, **dict.fromkeys(OCIO, 129), FFMPEG: 256}

EVERYONE = (*OCIO, FFMPEG, PILLOW, COLOUR)


def check(scan: CubeScan) -> Iterator[Finding]:
    """All that can be wrong with the size, apart from a wrong number of rows."""
    sizes = scan.named("LUT_3D_SIZE")
    if not sizes and not scan.named("LUT_1D_SIZE"):
        what = "is empty" if not scan.bytes else "has no LUT_3D_SIZE"
        yield Finding(what, "Export it again; no reader knows its size.", 0, refused(*EVERYONE, how="finds no size"))
    for entry in sizes[:1]:
        yield from _size(scan, entry)
    for entry in sizes[1:]:
        fates = refused(*EVERYONE, how="reads two sizes")
        yield Finding(f"states its size twice: {entry.text}", "Leave one.", entry.line, fates)


def _size(scan: CubeScan, entry: Entry) -> Iterator[Finding]:
    word = entry.words[0] if entry.words else ""
    if entry.rows_before:
        fates = refused(FFMPEG, PILLOW, how="finds no rows behind the size")
        yield Finding("states its size after its rows", "Put LUT_3D_SIZE before them.", entry.line, fates)
    if scan.size < 1:
        fates = refused(*EVERYONE, how="makes no table of that size")
        yield Finding(f"has a size that is none: {entry.text}", "Export it again.", entry.line, fates)
    elif scan.size == 1:
        fates = refused(OCIO_26, FFMPEG, PILLOW, how="wants 2 or more")
        yield Finding("has one colour for everything: size 1", "Export it again.", entry.line, fates)
    elif not re.fullmatch(r"[0-9]+", word):
        fates = refused(PILLOW, COLOUR, how="wants a whole number")
        yield Finding(f"has a size that is no whole number: {entry.text}", f"Write {scan.size}.", entry.line, fates)
    too_large = {
        reader: Fate(REFUSES, f"takes {largest} at most") for reader, largest in LARGEST.items() if scan.size > largest
    }
    if too_large:
        yield Finding(f"has {scan.size} points an axis", "Resample it to 65 or 33.", entry.line, too_large)
