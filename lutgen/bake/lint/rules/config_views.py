"""How many views there are, and which need looks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import DJV, Finding, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)

#: What fits into a menu.
MANY = 10


def check(scan: ConfigScan) -> Iterator[Finding]:
    """DJV shows a view without its looks."""
    if scan.config is None:
        return
    pairs = [(display, view) for display in scan.config.getDisplays() for view in scan.config.getViews(display)]
    if len(pairs) > MANY:
        yield Finding(
            f"has {len(pairs)} views on its displays: Nuke lists every one",
            "Keep ten or fewer active.",
            scan.line_of("displays:"),
        )
    looks = [pair for pair in pairs if scan.config.getDisplayViewLooks(*pair)]
    if looks:
        display, view = looks[0]
        yield Finding(
            f"has looks in the view {view} of {display}",
            "For DJV, build the look into a colour space or a view transform.",
            scan.line_of("looks:"),
            wrong(DJV, how="leaves looks out"),
        )
