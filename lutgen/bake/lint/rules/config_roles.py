"""Roles that programs look for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)

#: Role → who looks for it.
WANTED = {
    "scene_linear": "Blender and Nuke work in it",
    "default": "files without a rule are read as it",
    "color_picking": "Blender's colour picker uses it",
    "texture_paint": "Nuke and Blender paint in it",
    "compositing_log": "Nuke reads log files as it",
    "data": "masks and normals are read as it",
    "aces_interchange": "other configs are connected through it, and later OpenColorIO asks for it",
    "cie_xyz_d65_interchange": "other configs are connected through it, and later OpenColorIO asks for it",
}


def check(scan: ConfigScan) -> Iterator[Finding]:
    """Notes: whoever misses a role falls back on something."""
    if scan.config is None:
        return
    wanted = {role: why for role, why in WANTED.items() if scan.version >= (2, 0) or "interchange" not in role}
    missing = {role: why for role, why in wanted.items() if not scan.config.hasRole(role)}
    if missing:
        listed = "; ".join(f"{role} ({why})" for role, why in missing.items())
        yield Finding(f"has no role {listed}", "Add them under roles.", scan.line_of("roles:"))
    if scan.config.hasRole("default") and scan.config.getColorSpace("default").isData():
        yield Finding(
            "has a default colour space that holds data: files without a rule pass every view unchanged, silently",
            "Make the role default a colour space with colours.",
            scan.line_of("default:"),
        )
