"""The tips (white and primaries) over time, and the two references."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import LINEAR_TO_XYZ, SRGB_XY, xyY_to_xyz
from lutgen.errors import LutgenError, pick_one
from lutgen.names import REFERENCES
from lutgen.readings import TIP_NAMES
from lutgen.time_law import between

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

#: Colour points whose matrix is worse conditioned than this lie on a line, as far as any meter can tell.
MAX_CONDITION = 1e5


@dataclass(frozen=True)
class Tips:
    """White and primaries over a display's life."""

    #: Measured times, increasing from 0, shape (N,); one time alone tells the display at hour 0, and no aging.
    hours: Array
    #: x, y and Y in cd/m² of white, red, green, blue, shape (N, 4, 3).
    xyY: Array  # noqa: N815 - the CIE's own spelling
    source: str = "<memory>"

    @classmethod
    def of(cls, measurements: Measurements) -> Tips:
        """Take the tips of ``measurements``. Raises LutgenError when they do not make a history."""
        return cls(*measurements.tips(), source=measurements.file)

    def __post_init__(self) -> None:
        """Refuse primaries on a line."""
        xyz = np.swapaxes(xyY_to_xyz(self.xyY), -1, -2)
        for i, name in enumerate(TIP_NAMES):
            condition = np.linalg.cond(np.delete(xyz, i, axis=-1) / xyz[:, 1:2, :1])
            if (condition > MAX_CONDITION).any():
                hour = self.hours[np.argmax(condition)]
                others = ", ".join(other for other in TIP_NAMES if other != name)
                message = (
                    f"{self.source}: hour {hour:g}: {others} lie on one line in the chromaticity diagram, so the "
                    f"matrix through them is singular. Check the x and y of these rows."
                )
                raise LutgenError(message)

    def check_span(self, hours: float) -> None:
        """Raise LutgenError when ``hours`` lies outside the measured span: lutgen does not extrapolate."""
        first, last = self.hours[0], self.hours[-1]
        if not first <= hours <= last:
            if self.hours.size == 1:
                message = (
                    f"{self.source}: white and primaries were measured at one time only (hour 0), and hour "
                    f"{hours:.12g} is asked. Aging is a change: add the white, red, green and blue of a later hour, "
                    f"or take hour 0."
                )
                raise LutgenError(message)
            message = (
                f"hour {hours:.12g} is outside the measured span {first:.12g}..{last:.12g} h of {self.source}. "
                f"Choose hours inside it: nothing is extrapolated."
            )
            raise LutgenError(message)

    def at(self, hours: float) -> Array:
        """Return xyY at ``hours``, shape (4, 3): x, y and Y each by the law of :mod:`lutgen.time_law`."""
        self.check_span(hours)
        if self.hours.size == 1:
            return np.asarray(self.xyY[0])
        return between(self.hours, self.xyY, hours)

    def referenced(self, hours: float, reference: str) -> Array:
        """Return xyY at ``hours`` with white's Y = 1 at hour 0, shape (4, 3), by ``relative`` or ``absolute``."""
        now, fresh = self.at(hours), self.xyY[0]
        if reference == "absolute":
            return np.column_stack([now[:, :2], now[:, 2] / fresh[0, 2]])
        if reference != "relative":
            raise pick_one("reference", reference, REFERENCES)
        luminance = np.concatenate([[1.0], LINEAR_TO_XYZ[1]])
        moved = SRGB_XY + (now[:, :2] - fresh[:, :2])
        self._check_gamut(moved, hours)
        return np.column_stack([moved, luminance * (now[:, 2] / fresh[:, 2])])

    def _check_gamut(self, xy: Array, hours: float) -> None:
        bad = (xy[:, 1] <= 0) | (xy.sum(axis=1) > 1)
        if bad.any():
            name = TIP_NAMES[int(np.argmax(bad))]
            message = (
                f"{self.source}: by hour {hours:g} {name} has moved so far that sRGB's {name}, moved alike, is no "
                f"colour any more. Check these rows, or use --reference absolute."
            )
            raise LutgenError(message)
