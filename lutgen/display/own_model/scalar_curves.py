"""Rung: one curve of each channel, fitted on all readings: XYZ(d) = K + Σ_c l_c(d_c)·P_c.

Single-channel ramps alone are a bad source of curves, since mixtures are brighter than their channels together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.display.own_model.least_squares import solve, trust
from lutgen.display.own_model.xyz_curves import COLUMNS, ROUNDS, SPLINES, Curves, lit, rising, stiffening

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.display.own_model.drive import Drive
    from lutgen.display.own_model.sample import Sample

NAME = "one curve of each channel"


def fit(sample: Sample, drive: Drive, stiffness: float) -> Curves:
    """Fit curves and primaries in turns, with errors in CIELAB's units; outliers have little weight."""
    driven = drive(sample.drive)
    splines = [lit(driven[:, channel]) for channel in range(3)]
    primaries, black = sample.tips[1:] - sample.black, sample.black
    weight = sample.certainty
    curves = np.zeros((3, SPLINES))
    for _ in range(ROUNDS):
        counted = np.sqrt(weight)[:, np.newaxis] * sample.slope
        curves = _curves(splines, primaries, (sample.share - black) * counted, counted, stiffness)
        light = np.stack([spline @ curve for spline, curve in zip(splines, curves, strict=True)], axis=1)
        at = np.column_stack([np.ones(len(light)), light])
        mixed = [
            solve(at * w[:, np.newaxis], y * w, np.zeros((1, 4)))
            for w, y in zip(counted.T, sample.share.T, strict=True)
        ]
        black, primaries = np.array(mixed).T[0], np.array(mixed).T[1:]
        weight = sample.certainty * trust((sample.share - black - light @ primaries) * sample.slope)
    coefficients = np.zeros((COLUMNS, 3))
    coefficients[0] = black
    coefficients[1:] = (curves[:, :, np.newaxis] * primaries[:, np.newaxis, :]).reshape(-1, 3)
    return Curves(drive, coefficients)


def _curves(splines: list[Array], primaries: Array, wanted: Array, counted: Array, stiffness: float) -> Array:
    """Coefficients of three curves, (3, SPLINES), with the primaries given: X, Y and Z together."""
    at = np.hstack([
        (spline[:, np.newaxis, :] * (primary * counted)[:, :, np.newaxis]).reshape(-1, SPLINES)
        for spline, primary in zip(splines, primaries, strict=True)
    ])  # fmt: skip
    penalty = stiffening(COLUMNS, stiffness)[:, 1:]
    found = solve(at, wanted.reshape(-1), penalty, rising(COLUMNS)[:, 1:])
    return found.reshape(3, SPLINES)
