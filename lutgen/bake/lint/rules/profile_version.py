"""The version of an ICC profile."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import ARGYLL, LCMS_8, LCMS_16, Fate, Finding, refused
from lutgen.bake.lint.rules.profile_header import IGNORED
from lutgen.icc_tags import is_profile

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan

KINDS = ("profile", "link")

#: The newest that LittleCMS opens.
NEWEST = (5, 0)


def check(scan: ProfileScan) -> Iterator[Finding]:
    """Version 2 is everybody's; Argyll reads nothing newer, Chromium from 2 to 4."""
    if not is_profile(scan.head):
        return
    major, minor = scan.version
    fates: dict[str, Fate] = {}
    if major >= 4:
        fates |= refused(ARGYLL, how="reads version 2 alone")
    if not 2 <= major <= 4:
        fates |= IGNORED
    if scan.version > NEWEST:
        fates |= refused(LCMS_8, LCMS_16, how="knows no version as new")
    if fates:
        yield Finding(f"is of version {major}.{minor}", "Export it as version 2.", 0, fates)
