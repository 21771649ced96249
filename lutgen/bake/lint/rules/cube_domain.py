"""DOMAIN_MIN and DOMAIN_MAX: the input that the first and the last row stand for."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan, Entry

KINDS = ("cube",)

_NONE = {"DOMAIN_MIN": 0.0, "DOMAIN_MAX": 1.0}


def check(scan: CubeScan) -> Iterator[Finding]:
    """OpenColorIO and colour honour it, pillow_lut never, ffmpeg after LUT_3D_SIZE and then without the minimum."""
    for entry in scan.named(*_NONE):
        values = domain(entry)
        if values is None:
            yield _malformed(entry, after_size=0 < scan.size_line < entry.line)
        elif any(value != _NONE[entry.keyword.upper()] for value in values):
            yield _narrowed(entry, after_size=0 < scan.size_line < entry.line)
    low, high = (_value(scan, keyword) for keyword in _NONE)
    if any(first >= last for first, last in zip(low, high, strict=True)):
        line = scan.named(*_NONE)[0].line
        fates = wrong(*OCIO, FFMPEG, PILLOW, COLOUR, how="shows something")
        yield Finding("has a domain that ends before it begins", "Export it again.", line, fates)


def domain(entry: Entry) -> tuple[float, ...] | None:
    """Return the three numbers of a DOMAIN line, None where they are not."""
    try:
        values = tuple(float(word) for word in entry.words)
    except ValueError:
        return None
    return values if len(values) == 3 and all(map(isfinite, values)) else None


def _value(scan: CubeScan, keyword: str) -> tuple[float, ...]:
    values = [domain(entry) for entry in scan.named(keyword)]
    return next((each for each in reversed(values) if each is not None), (_NONE[keyword],) * 3)


def _malformed(entry: Entry, *, after_size: bool) -> Finding:
    fates = refused(COLOUR, how="wants three numbers")
    if after_size:
        fates |= refused(*OCIO, how="wants three numbers")
        if domain(entry._replace(words=entry.words[:3])) is None:
            fates |= refused(FFMPEG, how="wants three numbers")
    what = f"has a {entry.keyword} that is not three numbers: {entry.text}"
    return Finding(what, "Leave it out, or write three.", entry.line, fates)


def _narrowed(entry: Entry, *, after_size: bool) -> Finding:
    fates = wrong(PILLOW, how="ignores it: takes 0..1 for the domain")
    if not after_size:
        fates |= wrong(FFMPEG, how="ignores what stands before LUT_3D_SIZE")
    elif entry.keyword.upper() == "DOMAIN_MIN":
        fates |= wrong(FFMPEG, how="does not subtract the minimum")
    return Finding(
        f"has a domain that is not 0..1: {entry.text}",
        "Resample it to 0..1 and leave DOMAIN out (`ociobakelut --format iridas_cube` writes none).",
        entry.line,
        fates,
    )
