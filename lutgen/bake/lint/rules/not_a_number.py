"""NaN, infinity, and numbers that float32 cannot hold: read by all or most, and then shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """NaN becomes 0 in OpenColorIO and ffmpeg; numbers of 3.4e38 and more are refused by OpenColorIO alone."""
    everyone = (*OCIO, FFMPEG, PILLOW, COLOUR)
    if "nan" in scan.oddities:
        odd = scan.oddities["nan"]
        fates = wrong(*OCIO, FFMPEG, PILLOW, how="shows black or noise there") | wrong(COLOUR, how="gives NaN")
        yield Finding(f"has NaN in {_rows(odd.count)}: {odd.sample}", "Compute these rows anew.", odd.line, fates)
    if "infinite" in scan.oddities:
        odd = scan.oddities["infinite"]
        fates = wrong(*everyone, how="shows the largest or the smallest value there")
        yield Finding(f"has infinity in {_rows(odd.count)}: {odd.sample}", "Compute these rows anew.", odd.line, fates)
    if "overflow" in scan.oddities:
        odd = scan.oddities["overflow"]
        fates = refused(*OCIO, how="float32 cannot hold it") | wrong(
            FFMPEG, PILLOW, COLOUR, how="shows the largest or the smallest value there"
        )
        yield Finding(
            f"has numbers beyond float32 in {_rows(odd.count)}: {odd.sample}", "Scale to 0..1.", odd.line, fates
        )


def _rows(count: int) -> str:
    return f"{count} row{'s' if count != 1 else ''}"
