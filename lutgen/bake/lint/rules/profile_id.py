"""The ID of an ICC profile: the MD5 of its bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan

KINDS = ("profile", "link")


def check(scan: ProfileScan) -> Iterator[Finding]:
    """Nobody who shows pictures compares it, but it tells that bytes were changed."""
    if scan.identifier is False:
        yield Finding("has an ID that is not that of its bytes: it was changed after it was made", "Export it again.")
