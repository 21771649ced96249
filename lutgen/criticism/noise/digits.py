"""The last digit of an instrument: the step between the values that it can print.

An instrument prints a fixed number of decimals, or of significant digits. The digits of the values tell which and how
many, not those of the text: appended zeros say nothing. A step q adds an error of variance q²/12 to a reading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Values with more decimals or significant digits than this have no step that matters.
MOST_DECIMALS, MOST_SIGNIFICANT = 7, 7

#: Fewer values than this tell no step.
ENOUGH = 24

#: A value is printed with so many digits when rounding to them changes it by no more than this share of a step.
NOTHING = 1e-6


@dataclass(frozen=True)
class Digits:
    """Digits of printed values: ``decimals``, or ``significant`` ones; None of both: no step is known."""

    decimals: int | None = None
    significant: int | None = None

    def step(self, values: Array) -> Array:
        """Step between the values that can be printed near ``values``, of their shape."""
        if self.decimals is not None:
            return np.full(values.shape, 10.0**-self.decimals)
        if self.significant is not None:
            size = np.maximum(np.abs(values), 1e-12)
            return np.asarray(10.0 ** (np.floor(np.log10(size)) + 1 - self.significant))
        return np.zeros(values.shape)


def digits_of(values: Array) -> Digits:
    """Find how values were printed, from the values themselves."""
    numbers = values[(values != 0) & np.isfinite(values)]
    if numbers.size < ENOUGH:
        return Digits()
    decimals = _needed(numbers, np.zeros(numbers.size), MOST_DECIMALS)
    top = np.floor(np.log10(np.abs(numbers))) + 1
    significant = _needed(numbers, top, MOST_SIGNIFICANT)
    # Nine of ten values use the last digit that there is: the rule that most values use to the full is the right one.
    found = [
        (float((needed == needed.max()).mean()), kind, int(needed.max()))
        for kind, needed, most in (
            ("decimals", decimals, MOST_DECIMALS),
            ("significant", significant, MOST_SIGNIFICANT),
        )
        if needed.max() <= most
    ]
    if not found:
        return Digits()
    _, kind, count = max(found)
    return Digits(decimals=count) if kind == "decimals" else Digits(significant=count)


def _needed(numbers: Array, top: Array, most: int) -> NDArray[np.intp]:
    """Digits that each number needs, counted from ``top`` digits before the point; ``most`` + 1 where more."""
    needed = np.full(numbers.size, most + 1)
    for count in range(most, -1, -1):
        scaled = numbers * 10.0 ** (count - top)
        needed[np.abs(scaled - np.round(scaled)) <= np.maximum(NOTHING, 1e-9 * np.abs(scaled))] = count
    return needed
