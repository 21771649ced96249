"""Numbers below float32's smallest normal number, which programs that compute curves write near black."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import OCIO, Finding, refused

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)


def check(scan: CubeScan) -> Iterator[Finding]:
    """OpenColorIO takes such a row for no row at all."""
    if "subnormal" in scan.oddities:
        odd = scan.oddities["subnormal"]
        yield Finding(
            f"has numbers below 1.2e-38: {odd.sample}",
            "Write them as 0; seven decimals do.",
            odd.line,
            refused(*OCIO, how="takes a number that small for none"),
        )
