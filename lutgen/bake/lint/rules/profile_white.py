"""Pure white of an ICC profile, which LittleCMS sets on white where it resamples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.lint.finding import LCMS_8, LCMS_16, Finding, wrong

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.profile import ProfileScan

KINDS = ("profile", "link")

#: White that is so near to the screen's is meant to be the same: one code of 255.
SAME = 1 / 255


def check(scan: ProfileScan) -> Iterator[Finding]:
    """Tables are resampled for whole numbers, a matrix for 16-bit ones; not so for the absolute intent."""
    if scan.unasked:
        yield Finding(f"was not asked for its white: {scan.unasked}", "Install it to know.")
    if scan.white is None or np.abs(np.clip(scan.white, 0, 1) - 1).max() <= SAME:
        return
    shown = " ".join(f"{255 * value:.0f}" for value in np.clip(scan.white, 0, 1))
    table = scan.has("A2B0")
    fates = wrong(*([LCMS_8] if table else []), LCMS_16, how="shows code 255 as 255, but in absolute terms")
    remedy = "Take a profile without a table for 8-bit pictures (icc-matrix), or the absolute intent."
    if not table:
        remedy = "Convert 16-bit pictures by the absolute intent."
    yield Finding(f"shows pure white as {shown}, where the screen's is 255 255 255", remedy, 0, fates)
