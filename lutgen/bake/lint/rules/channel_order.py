"""A table written blue fastest, as CLF and .3dl are: every reader would swap red and blue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import COLOUR, FFMPEG, OCIO, PILLOW, Finding, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)

#: How much better red must follow the slowest index than the fastest, and blue the other way round.
MARGIN = 0.3


def check(scan: CubeScan) -> Iterator[Finding]:
    """Red follows the first index in every table for pictures, unless its author meant to swap channels."""
    follows = scan.table.correlation
    red, blue = follows[0, 2] - follows[0, 0], follows[2, 0] - follows[2, 2]
    if red > MARGIN and blue > MARGIN:
        yield Finding(
            "looks written blue fastest: red follows the slowest index "
            f"(correlation {follows[0, 2]:.2f}, with the fastest {follows[0, 0]:.2f}), blue the fastest",
            "Reorder the rows so that red changes fastest.",
            0,
            wrong(*OCIO, FFMPEG, PILLOW, COLOUR, how="swaps red and blue"),
            in_the_file=True,
        )
