"""What an ICC profile says that it is: its signature, class and colour spaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import ARGYLL, CHROMIUM, LCMS_8, LCMS_16, Finding, refused, wrong
from lutgen.icc_tags import is_profile

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan

KINDS = ("profile", "link")

#: Classes that describe a device or a space, and those that do something else (ICC.1:2022, 7.2.7).
DEVICES, OTHERS = ("mntr", "scnr", "prtr", "spac"), ("link", "abst", "nmcl")

#: What Chromium does with every profile that it refuses.
IGNORED = wrong(CHROMIUM, how="ignores the profile and shows the picture un-aged")


def check(scan: ProfileScan) -> Iterator[Finding]:
    """A browser says nothing where it refuses a profile."""
    everyone = refused(LCMS_8, LCMS_16, ARGYLL, how="opens no such profile") | IGNORED
    if not is_profile(scan.head):
        what = "is empty" if not scan.length else "is no ICC profile: the signature acsp is missing"
        yield Finding(what, "Export it again.", 0, everyone)
        return
    kind, space = scan.word(12), scan.word(16)
    if kind not in (*DEVICES, *OTHERS):
        yield Finding(f"is of class {kind!r}, which does not exist", "Export it as a display profile.", 0, everyone)
    elif kind in {"abst", "nmcl"}:
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="cannot convert by it")
        yield Finding(f"is of class {kind!r}, which no picture has", "Export it as a display profile.", 0, fates)
    if space != "RGB ":
        fates = refused(LCMS_8, LCMS_16, how="does not take it for RGB pictures") | IGNORED
        yield Finding(f"is for colours of {space!r}, and displays are RGB", "Export it for RGB.", 0, fates)
    if not scan.link and scan.word(20) not in {"XYZ ", "Lab "}:
        what = f"connects through {scan.word(20).strip()!r}, and profiles do through XYZ or Lab"
        yield Finding(what, "Export it again.", 0, everyone)
