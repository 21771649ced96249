"""Views, colour spaces, looks and named transforms that cannot be shown, which ``validate()`` does not tell."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import BLENDER, DJV, NUKE, OCIO, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.config import ConfigScan

KINDS = ("config",)


def check(scan: ConfigScan) -> Iterator[Finding]:
    """Whoever chooses such a part gets an error; Debian's oiiotool aborts."""
    reasons: dict[str, list[str]] = {}
    for part, reason in scan.broken:
        reasons.setdefault(reason.partition(" The following attempts")[0], []).append(part)
    for reason, parts in reasons.items():
        missing = "could not be located" in reason
        yield Finding(
            f"{', '.join(parts[:3])}{f' and {len(parts) - 3} more' if len(parts) > 3 else ''} cannot be shown: "
            f"{reason[:200]}",
            "Put the file on the search path." if missing else "Correct it or take it out.",
            scan.line_of(reason.split("'")[1]) if reason.count("'") > 1 else 0,
            refused(*OCIO, BLENDER, NUKE, DJV, how="stops with an error when it is chosen"),
        )
