"""LUT_3D_INPUT_RANGE and LUT_1D_INPUT_RANGE, DaVinci Resolve's way to state a domain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Fate, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan, Entry

KINDS = ("cube",)

RANGES = ("LUT_3D_INPUT_RANGE", "LUT_1D_INPUT_RANGE")


def check(scan: CubeScan) -> Iterator[Finding]:
    """OpenColorIO knows two dialects, one with TITLE and DOMAIN, one with these; mixed, it takes neither."""
    mixed = scan.named("TITLE", "DOMAIN_MIN", "DOMAIN_MAX")
    for entry in scan.named(*RANGES):
        fates = _fates(span(entry), after_size=0 < scan.size_line < entry.line)
        if mixed:
            fates |= refused(*OCIO, how=f"{mixed[0].keyword} belongs to another dialect")
        yield Finding(
            f"states its input range as DaVinci Resolve does: {entry.text}",
            "Leave it out where it says 0 1; else resample to 0..1.",
            entry.line,
            fates,
        )


def span(entry: Entry) -> tuple[float, float] | None:
    """Return the two numbers of a range, None where they are not."""
    try:
        first, last = (float(word) for word in entry.words)
    except ValueError:
        return None
    return first, last


def _fates(ends: tuple[float, float] | None, *, after_size: bool) -> dict[str, Fate]:
    fates: dict[str, Fate] = {}
    if ends is None:
        fates |= refused(*OCIO, COLOUR, how="wants two numbers")
    elif not ends[0] < ends[1]:
        fates |= wrong(*OCIO, FFMPEG, PILLOW, COLOUR, how="shows something for a range that ends before it begins")
    elif ends != (0.0, 1.0):
        fates |= wrong(PILLOW, how="ignores it: takes 0..1 for the range")
        fates |= wrong(FFMPEG, how="ignores what stands before LUT_3D_SIZE")
    if after_size:
        fates |= refused(FFMPEG, how="takes it for a row")
    return fates
