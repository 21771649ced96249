"""The tag table of an ICC profile: how many, where they lie, and whether one is there twice."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import ARGYLL, LCMS_8, LCMS_16, Fate, Finding, refused, wrong
from lutgen.bake.lint.rules.profile_header import IGNORED
from lutgen.bake.lint.rules.profile_parts import MATRIX
from lutgen.icc_tags import HEADER, MOST_TAGS, SMALLEST_TAG, is_profile

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan
    from lutgen.icc_tags import Tag

KINDS = ("profile", "link")


def check(scan: ProfileScan) -> Iterator[Finding]:
    """What is left without a tag that lies outside, ``profile-parts`` says."""
    if not is_profile(scan.head):
        return
    room = max(0, scan.length - HEADER - 4) // 12
    if scan.count > min(MOST_TAGS, room):
        what = f"claims {scan.count} tags, and {min(MOST_TAGS, room)} are the most that a file of this size may have"
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="opens no such profile") | (IGNORED if scan.count > room else {})
        yield Finding(what, "It was cut off or damaged; export it again.", 0, fates)
        return  # What stands behind the true ones is no row.
    outside = [tag for tag in scan.tags if tag.start + tag.size > scan.length or tag.size < SMALLEST_TAG]
    if outside:
        what = f"has the tag {outside[0].name!r} outside the file"
        fates = _left_out(scan, outside) | IGNORED
        yield Finding(what, "It was cut off or damaged; export it again.", 0, fates)
    names = [tag.name for tag in scan.tags]
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled:
        fates = refused(LCMS_8, LCMS_16, how="opens no such profile")
        if len({tag for tag in scan.tags if tag.name == doubled}) > 1:
            fates |= refused(ARGYLL, how="opens no such profile")
        yield Finding(f"has the tag {doubled!r} twice", "Export it again.", 0, fates)
    across = _across(scan.tags)
    if across:
        one, other = across
        what = f"has the tags {one.name!r} and {other.name!r} across each other"
        yield Finding(what, "It was edited by hand; export it again.")


def _left_out(scan: ProfileScan, outside: list[Tag]) -> dict[str, Fate]:
    """LittleCMS, and Argyll where a tag only ends outside, go on without it: by the matrix, where a table is lost."""
    far = any(tag.start >= scan.length for tag in outside)
    going_on = (LCMS_8, LCMS_16) if far else (LCMS_8, LCMS_16, ARGYLL)
    by_the_matrix = any(tag.name == "A2B0" for tag in outside) and scan.has(*MATRIX)
    fates = wrong(*going_on, how="goes by the matrix without a word") if by_the_matrix else {}
    return fates | (refused(ARGYLL, how="opens no such file") if far else {})


def _across(tags: tuple[Tag, ...]) -> tuple[Tag, Tag] | None:
    """Find two tags that share some bytes, but not all: to share all is allowed, and common for curves."""
    ordered = sorted({(tag.start, tag.size): tag for tag in tags}.values(), key=lambda tag: tag.start)
    return next(((one, other) for one, other in pairwise(ordered) if other.start < one.start + one.size), None)
