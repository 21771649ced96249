"""Rows that are too few or too many, have other than three numbers, or are no rows at all."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, OCIO_21, OCIO_26, PILLOW, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)

#: Three words that begin as numbers do.
_NUMBERS = re.compile(r"(?:[-+]?\.?[0-9]\S*\s*){3}$")

_REMEDY = "It was cut off or edited by hand; export it again."


def check(scan: CubeScan) -> Iterator[Finding]:
    """Only ffmpeg stops counting when it has enough."""
    strict = refused(*OCIO, PILLOW, COLOUR, how="counts the rows")
    rows, wanted = scan.table.rows, scan.size**3
    if wanted and rows < wanted:
        what = f"has {rows} rows where LUT_3D_SIZE {scan.size} asks for {wanted}"
        yield Finding(what, _REMEDY, scan.size_line, strict | refused(FFMPEG, how="misses rows"))
    elif wanted and rows > wanted:
        what = f"has {rows} rows where LUT_3D_SIZE {scan.size} asks for {wanted}"
        yield Finding(what, _REMEDY, scan.size_line, strict | wrong(FFMPEG, how=f"reads the first {wanted} rows"))
    yield from _curve_rows(scan)
    if "columns" in scan.oddities:
        odd = scan.oddities["columns"]
        few = len(odd.sample.split()) < 3
        fates = strict | (
            refused(FFMPEG, how="misses a number")
            if few
            else wrong(FFMPEG, how="leaves what comes after three numbers out")
        )
        yield Finding(f"has rows of other than three numbers: {odd.sample}", _REMEDY, odd.line, fates)
    if "text" in scan.oddities:
        odd = scan.oddities["text"]
        fates = refused(*OCIO, FFMPEG, PILLOW, COLOUR, how="finds no number")
        if _NUMBERS.match(odd.sample):
            fates |= wrong(*OCIO, how="reads each word as far as it is a number: 1.0D-2 is 1")
        yield Finding(f"has a row that is no numbers: {odd.sample}", _REMEDY, odd.line, fates)
    if "NUL" in scan.oddities:
        odd = scan.oddities["NUL"]
        fates = refused(OCIO_21, PILLOW, COLOUR, how="finds no number")
        fates |= wrong(OCIO_26, FFMPEG, how="takes the line for an empty one")
        yield Finding("has NUL bytes, so it is no text", _REMEDY, odd.line, fates)


def _curve_rows(scan: CubeScan) -> Iterator[Finding]:
    """Rows of a 1D table that stands alone."""
    rows = scan.shaper_rows + scan.table.rows
    if scan.size_line or not scan.size_1d or rows == scan.size_1d:
        return
    fates = wrong(COLOUR, how="takes the rows that are there for all")
    if rows < scan.size_1d:
        fates |= refused(*OCIO, how="counts the rows")
    else:
        fates |= wrong(*OCIO, how="takes the rows that are there for all")
    line = scan.named("LUT_1D_SIZE")[0].line
    yield Finding(f"has {rows} rows where LUT_1D_SIZE asks for {scan.size_1d}", _REMEDY, line, fates)
