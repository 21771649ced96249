"""The profile version, which older readers refuse when it is newer than themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import BLENDER, DJV, NUKE, OCIO, OCIO_21, Finding, refused, wrong
from lutgen.bindings import ocio

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)


def check(scan: ConfigScan) -> Iterator[Finding]:
    """2.1 refuses 2.2 and later; what else the installed version says of it, all are taken to say."""
    line = scan.line_of("ocio_profile_version")
    installed = str(ocio().__version__)
    if scan.version == (0, 0) and not scan.refusal:
        fates = wrong(*OCIO, BLENDER, NUKE, DJV, how="takes it for an empty config")
        yield Finding("states no ocio_profile_version: it is no config", "Export it again.", 0, fates)
    elif scan.version > (2, 6):
        fates = refused(*OCIO, BLENDER, NUKE, DJV, how="knows no version as new")
        yield Finding(f"asks for profile version {_said(scan)}", "Write 2.1 where nothing newer is used.", line, fates)
    elif scan.version > (2, 1):
        fates = refused(OCIO_21, how="knows no version after 2.1")
        yield Finding(f"asks for profile version {_said(scan)}", "Write 2.1 where nothing newer is used.", line, fates)
    too_new = scan.version > (2, 6) or (scan.version > (2, 1) and installed.startswith("2.1."))
    if scan.refusal and not too_new:
        fates = refused(*OCIO, BLENDER, NUKE, DJV, how=f"OpenColorIO {installed} was asked")
        yield Finding(
            f"does not load: {scan.refusal[:300]}", "Correct it; `lutgen lint --try` asks ociocheck.", 0, fates
        )


def _said(scan: ConfigScan) -> str:
    return ".".join(str(part) for part in scan.version)
