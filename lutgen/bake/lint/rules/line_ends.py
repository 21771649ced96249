"""Line ends of one CR, as old Macintosh programs write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import FFMPEG, OCIO, Finding, refused, wrong
from lutgen.bake.lint.table import TableScan

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube", "3dl")


def check(scan: CubeScan | TableScan) -> Iterator[Finding]:
    """CRLF is read by all; a lone CR ends no line for OpenColorIO and ffmpeg."""
    if "CR" in scan.ends:
        fates = refused(*OCIO, FFMPEG, how="takes it all for one line")
        if isinstance(scan, TableScan):
            fates |= wrong(*OCIO, how="takes all numbers for one curve")
        yield Finding("has line ends of a single CR", "Save it with LF line ends.", 1, fates)
