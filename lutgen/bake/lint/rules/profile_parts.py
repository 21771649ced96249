"""The tags that an ICC profile needs, and those that the standard asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import ARGYLL, LCMS_8, LCMS_16, Finding, refused
from lutgen.bake.lint.rules.profile_header import DEVICES, IGNORED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan

KINDS = ("profile", "link")

MATRIX = ("rXYZ", "gXYZ", "bXYZ", "rTRC", "gTRC", "bTRC")

#: What the standard asks of profiles besides (ICC.1:2001-04, 6.3); nobody who shows pictures looks for it.
ASKED = {"profile": ("desc", "cprt", "wtpt"), "link": ("desc", "cprt", "pseq")}


def check(scan: ProfileScan) -> Iterator[Finding]:
    """A table or a matrix with curves; a device link has a table."""
    if scan.word(12) not in (*DEVICES, "link"):
        return
    needed = "a table (A2B0)" if scan.link else f"a table (A2B0) or all of {', '.join(MATRIX)}"
    if not (scan.has("A2B0") or (not scan.link and scan.has(*MATRIX)) or scan.has("D2B0")):
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="cannot convert by it") | IGNORED
        yield Finding(f"lacks {needed}", "Export it again.", 0, fates)
    missing = [name for name in ASKED["link" if scan.link else "profile"] if not scan.has(name)]
    if missing:
        yield Finding(f"lacks {', '.join(missing)}, which the standard asks for", "Export it again.")
