"""A 1D part: alone, or before the 3D table as DaVinci Resolve writes it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """The lut3d of ffmpeg knows no 1D part, and takes its rows for the first ones of the table."""
    for entry in scan.named("LUT_1D_SIZE")[:1]:
        fates = refused(PILLOW, how="reads no 1D tables")
        if not scan.size_line:
            yield Finding(
                f"is a 1D table: {entry.text}",
                "Apply it with ffmpeg's lut1d, or bake it into a 3D table.",
                entry.line,
                fates | refused(FFMPEG, how="finds no LUT_3D_SIZE"),
            )
            continue
        if entry.line > scan.size_line:
            fates |= refused(FFMPEG, how="takes LUT_1D_SIZE for a row")
            fates |= wrong(COLOUR, how="takes the 1D part's rows for the last ones")
        else:
            fates |= wrong(FFMPEG, how="takes the 1D part's rows for the first of the table")
        if scan.named("TITLE", "DOMAIN_MIN", "DOMAIN_MAX"):
            fates |= refused(*OCIO, how="a 1D part belongs to the dialect without TITLE and DOMAIN")
        yield Finding(
            f"has a 1D part before its 3D table: {entry.text}",
            "Bake both into one 3D table: `ociobakelut --lut FILE --format iridas_cube --cubesize 65 OUT`.",
            entry.line,
            fates,
        )
