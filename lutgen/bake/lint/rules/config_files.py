"""How a config names its LUT files: by absolute paths, outside its folder, and without an interpolation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Finding
from lutgen.bake.merge_files import leads_out, search_path

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)

#: What has a table to interpolate; a .spimtx and a .cc have none, and a CLF states its own.
TABLES = (".cube", ".3dl", ".spi3d", ".csp", ".vf", ".lut", ".mga", ".m3d", ".itx")


def check(scan: ConfigScan) -> Iterator[Finding]:
    """Notes: such a config works where it stands."""
    if scan.config is None:
        return
    files = [transform.getSrc() for transform in scan.file_transforms]
    absolute = [each for each in [*files, *search_path(scan.config)] if Path(each).is_absolute()]
    if absolute:
        what = f"names {absolute[0]} by an absolute path: it works on this machine alone"
        yield Finding(what, "Name it relative to the config.", scan.line_of(absolute[0]))
    outside = [each for each in search_path(scan.config) if leads_out(each)]
    if outside:
        what = f"searches {outside[0]}, outside its folder: moving the folder breaks it"
        yield Finding(what, "Keep LUT files below the config.", scan.line_of(outside[0]))
    unsaid = [
        transform.getSrc()
        for transform in scan.file_transforms
        if transform.getSrc().lower().endswith(TABLES) and _says_nothing(transform)
    ]
    if unsaid:
        yield Finding(
            f"does not say how {unsaid[0]} is interpolated: trilinear, then, where cells of a 3D table split best "
            "along the greys",
            "Add interpolation: tetrahedral for 3D tables.",
            scan.line_of(unsaid[0]),
        )


def _says_nothing(transform: object) -> bool:
    # Its text, since OpenColorIO's object says the same of "default" and of nothing.
    return "interpolation=default" in str(transform) or "interpolation" not in str(transform)
