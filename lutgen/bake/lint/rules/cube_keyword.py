"""Words that are no keyword of the .cube that everybody reads."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, OCIO_26, PILLOW, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan, Entry

KINDS = ("cube",)

#: Keywords that other rules speak of.
KNOWN = {
    "TITLE", "DOMAIN_MIN", "DOMAIN_MAX", "LUT_3D_SIZE", "LUT_1D_SIZE", "LUT_3D_INPUT_RANGE", "LUT_1D_INPUT_RANGE",
}  # fmt: skip

RANGE_FLAGS = {"LUT_IN_VIDEO_RANGE", "LUT_OUT_VIDEO_RANGE", "LUT_IN_FULL_RANGE", "LUT_OUT_FULL_RANGE"}


def check(scan: CubeScan) -> Iterator[Finding]:
    """Before the size most readers skip what they do not know; behind it, it stands where a row should."""
    unknown = [entry for entry in scan.entries if entry.keyword.upper() not in KNOWN]
    small = [entry for entry in scan.entries if entry.keyword != entry.keyword.upper() and entry not in unknown]
    late = [entry for entry in scan.named(*KNOWN) if entry.rows_before and 0 < scan.size_line < entry.line]
    if unknown:
        yield _unknown(scan, unknown[0])
    if small:
        yield _small(scan, small)
    if late:
        fates = refused(OCIO_26, PILLOW, how="takes it for a row")
        yield Finding(f"has a keyword among its rows: {late[0].text}", "Put it before them.", late[0].line, fates)


def _unknown(scan: CubeScan, entry: Entry) -> Finding:
    fates = refused(COLOUR, how="knows no such word")
    if 0 < scan.size_line < entry.line:
        fates |= refused(*OCIO, how="takes it for a row")
        if entry.rows_before < scan.size**3:
            fates |= refused(FFMPEG, how="takes it for a row")
    if entry.rows_before:
        fates |= refused(PILLOW, how="takes it for a row")
    flag = entry.keyword.upper() in RANGE_FLAGS
    return Finding(
        f"{'says which range it is for, which no reader heeds' if flag else 'has a word that is no keyword'}: "
        f"{entry.text[:60]}",
        "Leave it out" + (", and convert to full range." if flag else "."),
        entry.line,
        fates,
    )


def _small(scan: CubeScan, entries: list[Entry]) -> Finding:
    fates = refused(COLOUR, how="knows keywords in capitals alone")
    if any(entry.keyword.upper() == "LUT_3D_SIZE" for entry in entries):
        fates |= refused(FFMPEG, PILLOW, how="knows keywords in capitals alone")
    elif any(0 < scan.size_line < entry.line for entry in entries):
        fates |= refused(FFMPEG, how="knows keywords in capitals alone")
    return Finding(f"writes a keyword in small letters: {entries[0].text}", "Write capitals.", entries[0].line, fates)
