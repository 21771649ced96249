"""Quantisation by the last printed digit: the step between the values that an instrument can print.

An instrument prints a fixed number of decimals, or of significant digits. Both are inferred from the values and not
from their text, since zeros may have been appended. A step q adds an error of variance q²/12 to a reading. If an
instrument prints chromaticities, X and Z have the steps of x and y: with three decimals these steps exceed the noise of
most meters, above all in blue.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The step of values with more decimals or significant digits than this is negligible.
MOST_DECIMALS, MOST_SIGNIFICANT = 7, 7

#: The step of x and y with more decimals is negligible.
MOST_CHROMATICITY = 5

#: Smallest number of values from which a step is inferred.
ENOUGH = 24

#: A value has a number of digits if rounding to this number changes the value by at most this share of a step.
NOTHING = 1e-6


@dataclass(frozen=True)
class Digits:
    """Number of ``decimals`` or of ``significant`` digits of printed values; both None: no step is known.

    ``chromaticity``: number of decimals of x and y; then the other number is that of Y. None: X, Y and Z are printed.
    """

    decimals: int | None = None
    significant: int | None = None
    chromaticity: int | None = None

    def step(self, values: Array) -> Array:
        """Step between printable values near ``values``, XYZ (..., 3), of the same shape; 0 if unknown.

        From x and y, X and Z have the root sum square of the steps that x, y and Y cause.
        """
        steps = self._of_numbers(values)
        if self.chromaticity is None:
            return steps
        light = np.abs(values)
        of_x = of_y = light.sum(axis=-1) * 10.0**-self.chromaticity
        x_by_y, z_by_y = np.moveaxis(light[..., [0, 2]] / np.maximum(light[..., 1:2], 1e-12), -1, 0)
        # X = x/y · Y and Z = (1 − x − y)/y · Y, by their derivatives by Y, x and y.
        steps[..., 0] = np.sqrt((x_by_y * steps[..., 1]) ** 2 + of_x**2 + (x_by_y * of_y) ** 2)
        steps[..., 2] = np.sqrt((z_by_y * steps[..., 1]) ** 2 + of_x**2 + ((1.0 + z_by_y) * of_y) ** 2)
        return steps

    def farthest(self, values: Array) -> Array:
        """Return the largest distance of two roundings of one light near ``values``: √3 steps if x, y and Y differ."""
        return self.step(values) * (1.0 if self.chromaticity is None else 3.0**0.5)

    def _of_numbers(self, values: Array) -> Array:
        if self.decimals is not None:
            return np.full(values.shape, 10.0**-self.decimals)
        if self.significant is not None:
            size = np.maximum(np.abs(values), 1e-12)
            return np.asarray(10.0 ** (np.floor(np.log10(size)) + 1 - self.significant))
        return np.zeros(values.shape)


def digits_of(xyz: Array) -> Digits:
    """Infer the number of printed digits from readings, XYZ (n, 3): of X, Y and Z, or else of x, y and Y."""
    printed = _digits_of(xyz)
    light = xyz.sum(axis=1)
    lit = np.isfinite(light) & (light > 0)
    if printed != Digits() or not lit.any():
        return printed
    xy = xyz[lit, :2] / light[lit, np.newaxis]
    # Instruments print x and y with a fixed number of decimals, not of significant digits.
    of_xy = _needed(xy.ravel(), np.zeros(xy.size), MOST_CHROMATICITY)
    if xy.size < ENOUGH or of_xy.max() > MOST_CHROMATICITY:
        return printed
    of_y = _digits_of(xyz[:, 1])
    return Digits(of_y.decimals, of_y.significant, int(of_xy.max()))


def _digits_of(values: Array) -> Digits:
    """Infer the number of digits of single numbers."""
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
