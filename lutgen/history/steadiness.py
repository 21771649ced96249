"""Patches that were read again: how well readings repeat, and how the display drifted while it was read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xy_to_uv, xyz_to_xyY
from lutgen.history.patches import repeats

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: A patch counts as bright from this share of the brightest on: there a meter's noise is a share of the light.
BRIGHT = 0.05

#: Fewest readings whose steps tell scatter from a course.
FEWEST = 6

#: Median of |x| where x is normal with standard deviation 1.
_MEDIAN_OF_NORMAL = 0.6745


@dataclass(frozen=True)
class Steadiness:
    """What repeated patches say.

    Attributes
    ----------
    patches, readings
        How many bright patches were repeated, and all their readings.
    noise
        Standard deviation of Y over its patch's mean, pooled over bright patches. A drift is in it.
    dark_noise
        Pooled standard deviation of Y of dark patches, in the session's unit; None: none was repeated.
    order, ratio
        Of bright patches: place in the order read as a share of the session, (n,), and Y over the patch's first
        reading, (n,).
    shift
        Largest Δu'v' of a bright patch against its first reading.

    """

    patches: int
    readings: int
    noise: float
    dark_noise: float | None
    order: Array
    ratio: Array
    shift: float

    @property
    def drift(self) -> float:
        """Largest change of Y against the first reading of a bright patch, with its sign, as a share."""
        return float(self.ratio[np.argmax(np.abs(self.ratio - 1.0))] - 1.0)

    @property
    def scatter(self) -> float:
        """Standard deviation of Y of a bright patch, as a share, with next to no drift in it; 0 of few readings.

        By the median step from one reading to the next, which a jump does not move, or by that of the steps' own steps,
        which a steady course does not move: the smaller.
        """
        if self.readings < FEWEST:
            return 0.0
        steps = np.diff(self.ratio)
        noise = [np.median(np.abs(steps)) / np.sqrt(2.0), np.median(np.abs(np.diff(steps))) / np.sqrt(6.0)]
        return float(min(noise) / _MEDIAN_OF_NORMAL)


def steadiness(session: Session) -> Steadiness | None:
    """Return what the session's repeated patches say; None where no bright patch was repeated."""
    groups = repeats(session)
    brightest = float(session.xyz[:, 1].max())
    is_bright = [float(session.xyz[rows, 1].min()) >= BRIGHT * brightest > 0 for rows in groups]
    bright = [rows for rows, each in zip(groups, is_bright, strict=True) if each]
    dark = [rows for rows, each in zip(groups, is_bright, strict=True) if not each]
    if not bright:
        return None
    last = max(len(session.drive) - 1, 1)
    order = np.concatenate(bright)
    ratio = np.concatenate([session.xyz[rows, 1] / session.xyz[rows[0], 1] for rows in bright])
    by_order = np.argsort(order, kind="stable")
    uv = [xy_to_uv(xyz_to_xyY(session.xyz[rows])[:, :2]) for rows in bright]
    return Steadiness(
        patches=len(bright),
        readings=order.size,
        noise=_pooled([session.xyz[rows, 1] / session.xyz[rows, 1].mean() for rows in bright]),
        dark_noise=_pooled([session.xyz[rows, 1] for rows in dark]) if dark else None,
        order=order[by_order] / last,
        ratio=ratio[by_order],
        shift=max(float(np.hypot(*(each - each[0]).T).max()) for each in uv),
    )


def _pooled(groups: list[Array]) -> float:
    """Standard deviation within groups, each about its own mean."""
    squares = sum(float(((each - each.mean()) ** 2).sum()) for each in groups)
    return float(np.sqrt(squares / sum(each.size - 1 for each in groups)))
