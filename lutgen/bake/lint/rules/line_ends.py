"""Line ends of one CR, as old Macintosh programs write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import FFMPEG, OCIO, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """CRLF is read by all; a lone CR ends no line for OpenColorIO and ffmpeg."""
    if "CR" in scan.ends:
        fates = refused(*OCIO, FFMPEG, how="takes it all for one line")
        yield Finding("has line ends of a single CR", "Save it with LF line ends.", 1, fates)
