"""The size that an ICC profile says it has."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import ARGYLL, LCMS_8, LCMS_16, Finding, refused
from lutgen.bindings import LARGEST_LUT
from lutgen.icc_tags import is_profile

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan

KINDS = ("profile", "link")


def check(scan: ProfileScan) -> Iterator[Finding]:
    """Nobody minds a size that is too large, or bytes behind the end, as long as all tags are there."""
    if scan.length > LARGEST_LUT:
        what = f"has {scan.length >> 20} MiB, more than any profile"
        yield Finding(what, "Is it the right file?")
    if is_profile(scan.head) and scan.size != scan.length:
        outside = [tag for tag in scan.tags if scan.size < tag.start + tag.size <= scan.length]
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="leaves out tags behind that end") if outside else {}
        what = f"says that it has {scan.size} bytes, and has {scan.length}"
        yield Finding(what, "Copy or export it again.", 0, fates)
