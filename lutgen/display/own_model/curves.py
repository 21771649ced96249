"""Rungs with curves: sRGB's, one curve for each channel, X, Y and Z curves of each channel, products of code values.

The lowest rung is the paper's fresh display: sRGB's curves, with measured white and primaries.

The next rung has one curve for each channel, fitted to all readings: XYZ(d) = K + Σ_c l_c(d_c)·P_c. Curves from
single-channel ramps alone are worse, because mixtures are brighter than the sum of their channels.

The next rung has curves for X, Y and Z of each channel: XYZ(d) = K + Σ_c C_c(d_c), where C_c are three curves. The
chromaticity of a channel changes with its drive (a liquid crystal's transmission depends on wavelength and voltage), so
that one curve for each channel is not enough. The curve of Y never falls.

The last rung with curves adds products of code values d_i·d_j, three terms for each of X, Y and Z. Mixtures are
brighter than the sum of their channels, mostly in mid-tones; products of light would act only on the brightest colours.
Curves and products are fitted together, because curves that are fitted without products absorb the mean of the
products.

Each curve is sRGB's light times a smooth gain. Every display's curve is near sRGB's curve, so the gain bends little,
and levels without readings keep the shape of sRGB. The gain is a cubic B-spline over the code value, with a penalty on
the second differences of its coefficients, the stiffness (P-splines: Eilers & Marx, Statist. Sci. 11, 89-121 (1996),
doi:10.1214/ss/1038425655).
"""

from dataclasses import dataclass

import numpy as np
import scipy  # scipy loads its parts lazily; most displays need none

from lutgen.colorimetry import Array, code_to_linear
from lutgen.display.own_model.drive import Drive
from lutgen.display.own_model.least_squares import solve, trust
from lutgen.display.own_model.sample import Sample
from lutgen.display.paper import tip_shares

SRGB_NAME = "curves of sRGB with white and primaries as measured"
SCALAR_NAME = "one curve of each channel"
XYZ_NAME = "X, Y and Z curves of each channel"
PRODUCTS_NAME = "products of code values"

#: Number of splines of a gain: about one for every 12 codes of 8 bits. The largest public sessions have 97 greys.
SPLINES = 24

#: Factor of the penalty: with stiffness 1 a bend of 0.01 in the gain costs as much as one CIELAB unit in one reading.
BEND = 100.0

#: Number of code values at which the curves are checked not to fall.
STEPS = 65

_KNOTS = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, SPLINES - 2), np.ones(3)])

#: Number of columns: black, and the splines of three channels.
COLUMNS = 1 + 3 * SPLINES

#: Number of iterations; each iteration uses the weights of the readings from the previous residuals.
ROUNDS = 3


@dataclass(frozen=True)
class SrgbCurves:
    """Code values (m, 3) → shares of white's X, Y and Z, (m, 3), by the paper's ``nearest`` matrices.

    ``tips`` (4, 3) are the shares of white's X, Y and Z for white, red, green and blue.
    """

    tips: Array

    def __call__(self, code: Array) -> Array:
        """See the class."""
        return np.asarray(tip_shares(code_to_linear(code), code, "nearest") @ self.tips)


@dataclass(frozen=True)
class Curves:
    """Code values (m, 3) → shares of white's X, Y and Z, (m, 3)."""

    #: Conversion of code values to the drive of the panel.
    drive: Drive
    #: Coefficients of black, of the channels' splines, and of the products if there are any: (COLUMNS or COLUMNS + 3,
    #: 3).
    coefficients: Array

    def __call__(self, code: Array) -> Array:
        """See the class."""
        driven = np.clip(self.drive(code), 0.0, 1.0)
        light, shares = code_to_linear(driven), np.tile(self.coefficients[0], (len(code), 1))
        for channel, curve in enumerate(self.coefficients[1:COLUMNS].reshape(3, SPLINES, 3)):
            spline = scipy.interpolate.BSpline(_KNOTS, curve, 3)
            shares += light[:, [channel]] * spline(driven[:, channel])
        if len(self.coefficients) > COLUMNS:
            shares += _products(code) @ self.coefficients[COLUMNS:]
        return shares


def _products(code: Array) -> Array:
    """Return the products of each two code values, (m, 3)."""
    red, green, blue = code.T
    return np.stack([red * green, red * blue, green * blue], axis=1)


def stiffening(count: int, stiffness: float) -> Array:
    """Return the rows of the penalty on the curves' bends, (3·(SPLINES − 2), count)."""
    bend = BEND * np.diff(np.eye(SPLINES), 2, axis=0)
    return np.asarray(np.sqrt(stiffness) * _of_each_channel(bend, count))


def rising(count: int) -> Array:
    """Return the rows of the rises of the three channels' curves, (3·(STEPS − 1), count); none may be negative."""
    return _of_each_channel(np.diff(lit(np.linspace(0.0, 1.0, STEPS)), axis=0), count)


def _of_each_channel(rows: Array, count: int) -> Array:
    """Repeat rows for one channel (k, SPLINES) for all three channels in ``count`` columns: (3·k, count)."""
    placed = np.zeros((3 * len(rows), count))
    placed[:, 1:COLUMNS] = scipy.linalg.block_diag(rows, rows, rows)
    return placed


def fit_scalar(sample: Sample, stiffness: float, drive: Drive) -> Curves:
    """Fit curves and primaries alternately, with residuals in CIELAB units; outliers have little weight."""
    driven = drive(sample.drive)
    splines = [lit(driven[:, channel]) for channel in range(3)]
    primaries, black = sample.tips[1:] - sample.black, sample.black
    weight = sample.certainty
    curves = np.zeros((3, SPLINES))
    for _ in range(ROUNDS):
        weights = np.sqrt(weight)[:, np.newaxis] * sample.slope
        curves = _curves(splines, primaries, (sample.share - black) * weights, weights, stiffness)
        light = np.stack([spline @ curve for spline, curve in zip(splines, curves, strict=True)], axis=1)
        at = np.column_stack([np.ones(len(light)), light])
        mixed = [
            solve(at * w[:, np.newaxis], y * w, np.zeros((1, 4)))
            for w, y in zip(weights.T, sample.share.T, strict=True)
        ]
        black, primaries = np.array(mixed).T[0], np.array(mixed).T[1:]
        weight = sample.certainty * trust((sample.share - black - light @ primaries) * sample.slope)
    of_channels = (curves[:, :, np.newaxis] * primaries[:, np.newaxis, :]).reshape(-1, 3)
    return Curves(drive, np.vstack([black, of_channels]))


def _curves(splines: list[Array], primaries: Array, target: Array, weights: Array, stiffness: float) -> Array:
    """Return the coefficients of three curves, (3, SPLINES), fitted to X, Y and Z together for fixed primaries."""
    at = np.hstack([
        (spline[:, np.newaxis, :] * (primary * weights)[:, :, np.newaxis]).reshape(-1, SPLINES)
        for spline, primary in zip(splines, primaries, strict=True)
    ])  # fmt: skip
    penalty = stiffening(COLUMNS, stiffness)[:, 1:]
    coefficients = solve(at, target.reshape(-1), penalty, rising(COLUMNS)[:, 1:])
    return coefficients.reshape(3, SPLINES)


def fit_xyz(sample: Sample, stiffness: float, drive: Drive, *, products: bool = False) -> Curves:
    """Fit the curves to all readings, with residuals in CIELAB units; outliers have little weight."""
    code, driven = sample.drive, drive(sample.drive)
    parts = [np.ones((len(code), 1)), *(lit(driven[:, channel]) for channel in range(3))]
    at = np.hstack([*parts, _products(code)] if products else parts)
    penalty, rise = stiffening(at.shape[1], stiffness), rising(at.shape[1])
    weight = sample.certainty
    coefficients = np.zeros((at.shape[1], 3))
    for _ in range(ROUNDS):
        for k in range(3):
            weights = np.sqrt(weight) * sample.slope[:, k]
            target = sample.share[:, k] * weights
            coefficients[:, k] = solve(at * weights[:, np.newaxis], target, penalty, rise if k == 1 else None)
        weight = sample.certainty * trust((sample.share - at @ coefficients) * sample.slope)
    return Curves(drive, coefficients)


def lit(code: Array) -> Array:
    """Return sRGB's linear light times every spline at code values (m,) in 0..1, (m, SPLINES)."""
    within = np.clip(code, 0.0, 1.0)
    return np.asarray(
        scipy.interpolate.BSpline.design_matrix(within, _KNOTS, 3).toarray() * code_to_linear(within)[:, np.newaxis]
    )
