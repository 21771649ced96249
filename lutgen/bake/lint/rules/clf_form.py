"""What CLF readers ask of a file: an id, a version, arrays of the size that they state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import CLF_IO, OCIO, OCIO_21, Finding, refused, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.clf import ClfScan

KINDS = ("clf",)

#: The namespace of SMPTE ST 2136-1.
SMPTE = "smpte-ra.org/ns/2136-1"


def check(scan: ClfScan) -> Iterator[Finding]:
    """OpenColorIO refuses most faults with a clear sentence; scale faults it shows."""
    if scan.broken:
        fates = refused(*OCIO, CLF_IO, how="reads no broken XML")
        yield Finding(f"is no XML that can be read: {scan.broken}", "Export it again.", scan.broken_line, fates)
        return
    smpte = in_smptes_namespace(scan)
    if smpte:
        fates = refused(CLF_IO, how="knows the Academy's namespace alone")
        yield Finding("is in SMPTE 2136's namespace", "Write version 3 without it.", 1, fates)
    if "id" not in scan.root:
        fates = refused(OCIO_21, CLF_IO, how="asks for an id") | ({} if smpte else refused(*OCIO, how="asks for an id"))
        yield Finding("has no id", "Give ProcessList an id.", 1, fates)
    for node in scan.nodes:
        if node.name == "LUT3D" and "interpolation" not in node.attributes:
            what = "does not say how its LUT3D is interpolated: readers choose"
            yield Finding(what, 'Write interpolation="tetrahedral".', node.line)
        depth = node.attributes.get("outBitDepth", "")
        if node.name.startswith("LUT") and depth.endswith("i") and 0 < node.largest <= 2:
            fates = wrong(*OCIO, CLF_IO, how="divides by the largest integer: almost black")
            yield Finding(
                f"says outBitDepth {depth}, and has values up to {node.largest:g}", "Write 32f.", node.line, fates
            )


def in_smptes_namespace(scan: ClfScan) -> bool:
    """Whether a file is of SMPTE ST 2136-1, which needs no id."""
    return SMPTE in scan.root.get("xmlns", "")
