"""Whether two sessions have the same transfer curves, at equal drive where their calibrations are known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.calibration import native_ramp
from lutgen.history.patches import CHANNELS, mean_xyz, ramp
from lutgen.history.transfer import lightness

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: Of L*: below this, black and noise rule.
DARKEST = 20.0

#: Levels that a ramp needs to be held against another.
FEWEST = 4


def bend(before: Session, after: Session, *, native: bool) -> float | None:
    """Largest change of a normalised curve, in L*, over the channels and, unless ``native``, the greys.

    None where no ramp of both has enough levels. The sign is that of the largest: above 0 the later one is lighter.
    """
    names = list(CHANNELS) if native else ["grey", *CHANNELS]
    found = [each for name in names if (each := _between(_curve(before, name, native), _curve(after, name, native)))]
    return max(found, key=abs) if found else None


def _curve(session: Session, name: str, native: bool) -> tuple[Array, Array]:
    """Drive, and luminance after black."""
    if native:
        drive, xyz = native_ramp(session, name)
        return drive, xyz[:, 1]
    found, black = ramp(session, name), mean_xyz(session, "black")
    return found.drive, found.xyz[:, 1] - (0.0 if black is None else float(black[1]))


def _between(one: tuple[Array, Array], other: tuple[Array, Array]) -> float | None:
    if min(one[0].size, other[0].size) < FEWEST:
        return None
    top = min(one[0][-1], other[0][-1])
    # A curve is nearly straight in its cube root, so that few levels may be joined by lines there.
    roots = [np.cbrt(np.maximum(light / np.interp(top, drive, light), 0.0)) for drive, light in (one, other)]
    at = other[0][(other[0] <= top) & (other[0] >= one[0][0])]
    first, second = (
        lightness(np.interp(at, drive, root) ** 3) for (drive, _), root in zip((one, other), roots, strict=True)
    )
    kept = (first >= DARKEST) & (at < top)
    if not kept.any():
        return None
    off = (second - first)[kept]
    return float(off[np.argmax(np.abs(off))])
