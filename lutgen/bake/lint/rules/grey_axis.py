"""Greys that get darker while the input gets lighter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.lint.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.cube import CubeScan

KINDS = ("cube",)

#: A fall of the neutral axis that is more than rounding: one code of 10 bit.
FALL = 1 / 1023


def check(scan: CubeScan) -> Iterator[Finding]:
    """A note: an inversion is meant in some tables and a fault in others, and every reader shows it."""
    falls = -np.diff(scan.table.greys, axis=0)
    if not len(falls) or falls.max() < FALL:
        return
    where, channel = np.unravel_index(int(np.argmax(falls)), falls.shape)
    name = ("red", "green", "blue")[int(channel)]
    what = f"lets {name} fall by {falls.max():.4f} along the greys, between points {where} and {where + 1}"
    yield Finding(what, "Look at a grey ramp through it.")
