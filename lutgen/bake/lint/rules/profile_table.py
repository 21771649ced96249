"""The tables of an ICC profile: whether they are as large as they say, and Chromium's reading of XYZ."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import ARGYLL, CHROMIUM, LCMS_8, LCMS_16, Fate, Finding, refused, wrong
from lutgen.bake.lint.rules.profile_parts import MATRIX

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan, TableHead

KINDS = ("profile", "link")

#: Bytes that may follow a table: padding.
PADDING = 3


def check(scan: ProfileScan) -> Iterator[Finding]:
    """Where the number of points is too small for the bytes that are there, everybody shows nonsense."""
    for table in scan.tables:
        said = f"{table.tag.name} says that it has {table.points} points an edge from {table.inputs} colours"
        lacks = table.needs > table.tag.size
        if table.points < 2 or table.inputs != 3 or table.outputs != 3 or lacks:
            what = f"{said} to {table.outputs}"
            what += f", which is {table.needs} bytes, and it has {table.tag.size}" if lacks else ""
            yield Finding(what, "Export it again.", 0, _unusable(scan, table))
        elif table.needs + PADDING < table.tag.size:
            fates = wrong(LCMS_8, LCMS_16, ARGYLL, CHROMIUM, how="reads the wrong numbers")
            what = f"{said}, which is {table.needs} bytes, and it has {table.tag.size}"
            yield Finding(what, "Export it again.", 0, fates)
    if scan.tables and not scan.link and scan.word(20) == "XYZ ":
        fates = wrong(CHROMIUM, how="shows it half as bright")
        yield Finding("has a table of XYZ", "Export it with a table of L*a*b*.", 0, fates)
    if scan.link:
        yield Finding("is a device link: viewers and browsers take profiles, not links", "Use it to convert pictures.")


def _unusable(scan: ProfileScan, table: TableHead) -> dict[str, Fate]:
    """Who goes on by the matrix, where there is one; Argyll does not where the table has a single point."""
    fates = refused(LCMS_8, LCMS_16, ARGYLL, how="cannot convert by it")
    if table.points >= 2 and scan.has(*MATRIX):
        fates |= wrong(ARGYLL, how="goes by the matrix without a word")
    return fates | wrong(CHROMIUM, how="goes by the matrix, or shows the picture un-aged")
