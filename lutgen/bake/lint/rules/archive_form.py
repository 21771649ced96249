"""The form of an ``.ocioz``: whether it can be unpacked, what leads out of it, and its config."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.archive import CONFIG
from lutgen.bake.lint.finding import OCIO_26, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.archive import ArchiveScan

KINDS = ("archive",)


def check(scan: ArchiveScan) -> Iterator[Finding]:
    """An archive is unpacked by whoever opens it."""
    fates = refused(OCIO_26, how="opens no such archive")
    if scan.broken:
        yield Finding(scan.broken, "Do not unpack it; make it again with ocioarchive.", 0, fates)
        return
    for name, reason in scan.unsafe[:3]:
        what = f"holds {name!r}, which {reason}"
        yield Finding(what, "Do not unpack it; make it again with ocioarchive.", 0, fates)
    if CONFIG not in scan.names:
        yield Finding(f"has no {CONFIG} at its root", "Make it again with ocioarchive.", 0, fates)
    yield Finding("is not read by OpenColorIO 2.1, which knows no archives", "Unpack it for that.")
