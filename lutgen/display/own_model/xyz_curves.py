"""Rung: a curve for X, for Y and for Z of each channel, fitted on all readings; the curve of Y never falls.

The chromaticity of a channel moves with its drive (a liquid crystal's transmission depends on wavelength and voltage),
so that one curve a channel is not enough: XYZ(d) = K + Σ_c C_c(d_c), C_c three curves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.display.own_model.gain import SPLINES, bends, lit, rises
from lutgen.display.own_model.least_squares import solve, trust

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.display.own_model.drive import Drive
    from lutgen.display.own_model.sample import Sample

NAME = "X, Y and Z curves of each channel"

#: Black, and the splines of three channels.
COLUMNS = 1 + 3 * SPLINES

#: Fits that follow each other, each with the readings' weights from the one before.
ROUNDS = 3


@dataclass(frozen=True)
class Curves:
    """Code values (m, 3) → shares of white's X, Y and Z, (m, 3)."""

    #: What the code values go through first.
    drive: Drive
    #: Of black and the channels' splines, and perhaps of products of code values: (COLUMNS or COLUMNS + 3, 3).
    coefficients: Array

    def __call__(self, code: Array) -> Array:
        """See the class."""
        return np.asarray(columns(code, self.drive, products=len(self.coefficients) > COLUMNS) @ self.coefficients)


def columns(code: Array, drive: Drive, *, products: bool = False) -> Array:
    """Black, the splines of each channel, and where asked the products of code values, (m, COLUMNS or COLUMNS + 3)."""
    driven = drive(code)
    parts = [np.ones((len(code), 1)), *(lit(driven[:, channel]) for channel in range(3))]
    if products:
        red, green, blue = code.T
        parts.append(np.stack([red * green, red * blue, green * blue], axis=1))
    return np.hstack(parts)


def stiffening(count: int, stiffness: float) -> Array:
    """Rows that make the curves' bends small: (3·(SPLINES − 2), count)."""
    bend = bends()
    rows = np.zeros((3 * len(bend), count))
    for channel in range(3):
        rows[channel * len(bend) : (channel + 1) * len(bend), 1 + channel * SPLINES : 1 + (channel + 1) * SPLINES] = (
            bend
        )
    return np.asarray(np.sqrt(stiffness) * rows)


def rising(count: int) -> Array:
    """Rises of the three channels' curves, (3·(STEPS − 1), count): none is to be negative."""
    rise = rises()
    rows = np.zeros((3 * len(rise), count))
    for channel in range(3):
        here, splines = channel * len(rise), 1 + channel * SPLINES
        rows[here : here + len(rise), splines : splines + SPLINES] = rise
    return rows


def fit(sample: Sample, drive: Drive, stiffness: float, *, products: bool = False) -> Curves:
    """Fit the curves on all readings, as the eye counts errors; readings that contradict all others count little."""
    at = columns(sample.drive, drive, products=products)
    penalty, rise = stiffening(at.shape[1], stiffness), rising(at.shape[1])
    weight = sample.certainty
    found = np.zeros((at.shape[1], 3))
    for _ in range(ROUNDS):
        for k in range(3):
            counted = np.sqrt(weight) * sample.slope[:, k]
            wanted = sample.share[:, k] * counted
            found[:, k] = solve(at * counted[:, np.newaxis], wanted, penalty, rise if k == 1 else None)
        weight = sample.certainty * trust((sample.share - at @ found) * sample.slope)
    return Curves(drive, found)
