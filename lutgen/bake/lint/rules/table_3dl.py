"""The one form of ``.3dl`` that ffmpeg reads: a line of places, then 17³ rows of 12 bits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import FFMPEG, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.table import TableScan

KINDS = ("3dl",)

#: Rows of the table that ffmpeg takes every file for.
ROWS = 17**3

#: The largest numbers of files of 12 bits, as OpenColorIO guesses them.
TWELVE_BITS = range(2048, 4096)


def check(scan: TableScan) -> Iterator[Finding]:
    """The lut3d of ffmpeg skips the first line, takes 17³ rows, and divides by 4096; the rest it never looks at."""
    places = len(scan.head.split()) > 3
    behind = scan.rows - (not places and bool(scan.rows))
    remedy = "Make a .cube for ffmpeg of it: `ociobakelut --lut FILE --format iridas_cube OUT`."
    if scan.head.upper().startswith("3DMESH"):
        yield Finding("begins with 3DMESH", remedy, 0, refused(FFMPEG, how="takes its second line for a row"))
    elif behind < ROWS:
        fates = refused(FFMPEG, how=f"wants {ROWS} rows behind the first line")
        yield Finding(f"has {scan.rows} rows" + ("" if places else " and no line of places"), remedy, 0, fates)
    elif behind > ROWS:
        fates = wrong(FFMPEG, how=f"takes the first {ROWS} rows for a table of 17³")
        yield Finding(f"has {scan.rows} rows, and ffmpeg reads tables of 17³ alone", remedy, 0, fates)
    elif scan.largest not in TWELVE_BITS:
        fates = wrong(FFMPEG, how="takes its numbers for 12 bits")
        yield Finding(f"has numbers up to {scan.largest}, and ffmpeg divides by 4096", remedy, 0, fates)
