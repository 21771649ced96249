"""Quantisation by the last printed digit: the step between the values that an instrument can print.

An instrument prints a fixed number of decimals, or of significant digits. Both are inferred from the values and not
from their text, since zeros may have been appended. A step q adds an error of variance q²/12 to a reading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The step of values with more decimals or significant digits than this is negligible.
MOST_DECIMALS, MOST_SIGNIFICANT = 7, 7

#: Smallest number of values from which a step is inferred.
ENOUGH = 24

#: A value has a number of digits if rounding to this number changes the value by at most this share of a step.
NOTHING = 1e-6


@dataclass(frozen=True)
class Digits:
    """Number of ``decimals`` or of ``significant`` digits of printed values; both None: no step is known."""

    decimals: int | None = None
    significant: int | None = None

    def step(self, values: Array) -> Array:
        """Step between printable values near ``values``, of the same shape; 0 if unknown."""
        if self.decimals is not None:
            return np.full(values.shape, 10.0**-self.decimals)
        if self.significant is not None:
            size = np.maximum(np.abs(values), 1e-12)
            return np.asarray(10.0 ** (np.floor(np.log10(size)) + 1 - self.significant))
        return np.zeros(values.shape)


def digits_of(values: Array) -> Digits:
    """Infer the number of printed digits from the values."""
    numbers = values[(values != 0) & np.isfinite(values)]
    if numbers.size < ENOUGH:
        return Digits()
    decimals = _needed(numbers, np.zeros(numbers.size), MOST_DECIMALS)
    top = np.floor(np.log10(np.abs(numbers))) + 1
    significant = _needed(numbers, top, MOST_SIGNIFICANT)
    # The last printed digit is not 0 in nine of ten values: choose the rule under which most values use all digits.
    rules = [
        (float((needed == needed.max()).mean()), kind, int(needed.max()))
        for kind, needed, most in (
            ("decimals", decimals, MOST_DECIMALS),
            ("significant", significant, MOST_SIGNIFICANT),
        )
        if needed.max() <= most
    ]
    if not rules:
        return Digits()
    _, kind, count = max(rules)
    return Digits(decimals=count) if kind == "decimals" else Digits(significant=count)


def _needed(numbers: Array, top: Array, most: int) -> NDArray[np.intp]:
    """Digits that each number needs, counted from ``top`` digits before the point; ``most`` + 1 if more."""
    needed = np.full(numbers.size, most + 1)
    for count in range(most, -1, -1):
        scaled = numbers * 10.0 ** (count - top)
        needed[np.abs(scaled - np.round(scaled)) <= np.maximum(NOTHING, 1e-9 * np.abs(scaled))] = count
    return needed
