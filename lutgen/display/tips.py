"""The tips (white and primaries) over time, the two references, and the hours that ``--hours`` asks for."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from lutgen.cells import BLANKS, number
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
        """Take the tips of ``measurements``. Raises LutgenError where primaries lie on a line."""
        return cls(*measurements.tips(), source=measurements.file)

    def __post_init__(self) -> None:
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
        """Raise LutgenError where ``hours`` lies outside the measured span: lutgen does not extrapolate."""
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


#: More hours than this in one request are treated as a typing error: at 1 MB a LUT they would be 10 GB.
MAX_HOURS = 10_000

#: No display reaches this hour. Larger hours are not rounded; the check of the measured span refuses them.
_ENDLESS = 10**9

#: Value of hours that are larger than any double.
_BEYOND = Decimal("1e309")

_ALLOWED = "Write 0..18000 (every measured time), 0..18000:500 (a step) or 0,5000,10000 (a list)"


def parse_hours(text: str, tips: Tips) -> list[float]:
    """Return the hours that ``text`` asks for, increasing, each once.

    ``0..18000`` is every measured time in the span and its two ends, ``0..18000:500`` a step from its start,
    ``0,5000,10000`` a list.

    Raises LutgenError: not of these forms, reversed, endless, too many, or outside the measured span.
    """
    if ".." not in text:
        return _checked({_number(part, text) for part in text.split(",")}, tips)
    span, colon, step = text.partition(":")
    first_text, _, last_text = span.partition("..")
    first, last = _number(first_text, text), _number(last_text, text)
    if first > last:
        message = f"--hours {text}: the span runs backwards. Write {last_text}..{first_text}."
        raise LutgenError(message)
    tips.check_span(float(first))
    tips.check_span(float(last))
    if colon:
        return _checked(_steps(first, last, step, text), tips)
    measured = {Decimal(repr(float(hour))) for hour in tips.hours if first <= hour <= last}
    return _checked(measured | {first, last}, tips)


def _steps(first: Decimal, last: Decimal, given: str, text: str) -> set[Decimal]:
    step = _number(given, text)
    if step <= 0:
        message = f"--hours {text}: a step of {given} does not advance. Give one from 0.000001 on, such as 500."
        raise LutgenError(message)
    count = int((last - first) / step) + 1
    if count > MAX_HOURS:
        message = f"--hours {text}: that is {count} hours, more than {MAX_HOURS}. Give a larger step."
        raise LutgenError(message)
    return {first + i * step for i in range(count)}


def _checked(hours: set[Decimal], tips: Tips) -> list[float]:
    if len(hours) > MAX_HOURS:
        message = f"--hours asks for {len(hours)} hours, more than {MAX_HOURS}. Give fewer."
        raise LutgenError(message)
    for hour in sorted(hours):
        tips.check_span(float(hour))
    return [float(hour) for hour in sorted(hours)]


def _number(part: str, text: str) -> Decimal:
    part = part.strip(BLANKS)
    hours = number(part, non_finite=True)
    # A point without a digit before it is a slip: `0...5` is not the span 0 to a half.
    if hours is None or part.lstrip("+-").startswith("."):
        message = f"--hours {text}: {part!r} is not a number of hours. {_ALLOWED}."
        raise LutgenError(message)
    named = part.lstrip("+-")[0].isalpha()  # nan, inf
    if named or hours < 0:
        message = f"--hours {text}: {part!r} is not a finite number of hours from 0 on. {_ALLOWED}."
        raise LutgenError(message)
    exact = Decimal(repr(hours)) if isfinite(hours) else _BEYOND
    # Folder names carry six decimals, so finer hours could collide: 0.0036 s is enough for any display.
    return exact if exact > _ENDLESS else round(exact, 6)
