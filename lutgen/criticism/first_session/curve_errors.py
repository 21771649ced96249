"""Errors of a native display's curves and black by noise of the first session, which propagate to every hour.

First sessions are simulated with noise, and a native display is made from each. Between their levels these curves
differ by errors of the interpolation too. A few principal modes span the changes of the prediction. A fit treats the
sizes of the modes as unknowns that all sessions share. An error of one curve point gives the same residual in all later
sessions; the fit attributes it to the curve, not to aging.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import code_to_linear, linear_to_code
from lutgen.display.native import NativeDisplay
from lutgen.display.trace import panel
from lutgen.display.transfer_curve import TransferCurve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.data import FitData
    from lutgen.criticism.noise.model import Noise
    from lutgen.readings import Measurements

SEED = 20150319

#: Number of simulated first sessions: more than the points of usual ramps, so that modes span the effects of noise.
DRAWS = 100

#: Smallest size of a mode relative to the largest mode; smaller modes bend curves between their points only.
LEAST_MODE = 1e-2

#: Smallest size of a mode in standard deviations of the noise.
NOTHING = 1e-9

#: Error of an interpolation between two levels, as a share of its error between levels at twice the distance. The error
#: of a smooth curve falls with the square of the distance, or faster.
HALVED = 0.25

#: Where between two levels curves differ by errors of the interpolation, as shares of the distance.
BETWEEN = (0.3, 0.7)


def drawn_displays(
    readings: Measurements, noise: Noise, left_out: Sequence[int], native: NativeDisplay | None
) -> tuple[NativeDisplay, ...]:
    """Make native displays of ``DRAWS`` simulated first sessions with seeded noise, with the source of ``native``.

    Without a native display, or with an own model, whose errors are a discrepancy, there are no such displays.
    """
    if native is None or native.own:
        return ()
    rng = np.random.default_rng(SEED)
    first = np.flatnonzero(readings.hours == 0)
    cholesky = np.linalg.cholesky(noise.covariance(readings.xyz_cd_m2[first]))
    drawn = []
    for _ in range(DRAWS):
        xyz = readings.xyz_cd_m2.copy()
        xyz[first] += np.einsum("nij,nj->ni", cholesky, rng.standard_normal((first.size, 3)))
        drawn.append(NativeDisplay.of(readings.with_light(xyz), left_out, strict=False, source=native.source))
    return tuple(drawn)


def bent_between_levels(drawn: Sequence[NativeDisplay], native: NativeDisplay | None) -> tuple[NativeDisplay, ...]:
    """Return the drawn displays with errors of the interpolation between the levels of ``native``, seeded.

    For curves without a discrepancy: a discrepancy contains these errors.
    """
    if native is None:
        return ()
    rng = np.random.default_rng(SEED)
    errors = [_interpolation_errors(curve) for curve in native.curves]
    most, result = max(error.size for error in errors), []
    for one in drawn:
        # The curves of one display are alike, and so are half of the errors between their levels.
        common = rng.standard_normal((len(BETWEEN), most))
        red, green, blue = (
            _bent_between(curve, error * (common[:, : error.size] + rng.standard_normal((len(BETWEEN), error.size))))
            for curve, error in zip(one.curves, errors, strict=True)
        )
        result.append(replace(one, curves=(red, green, blue)))
    return tuple(result)


def _interpolation_errors(curve: TransferCurve) -> Array:
    """Return 1 σ of the error of a curve between its points, in sRGB-encoded light, (K − 1,).

    Each inner point is predicted from the other points. The larger error of a gap's two ends, times ``HALVED``, counts.
    """
    off = np.zeros(len(curve.codes))
    for place in range(1, off.size - 1):
        codes, light = (values[:place] + values[place + 1 :] for values in (curve.codes, curve.light))
        by_others = TransferCurve(curve.channel, codes, light)(np.array(curve.codes[place]))
        off[place] = abs(linear_to_code(by_others) - linear_to_code(np.array(curve.light[place])))
    return np.asarray(HALVED * np.maximum(off[:-1], off[1:]))


def _bent_between(curve: TransferCurve, change: Array) -> TransferCurve:
    """Return the curve with encoded light changed ``BETWEEN`` its points, (2, K − 1), as far as it stays monotone."""
    codes, light = np.array(curve.codes), np.array(curve.light)
    if change.shape[1] != codes.size - 1:  # the noise has left out a level
        return curve
    places = [codes[:-1] + share * np.diff(codes) for share in BETWEEN]
    moved = [code_to_linear(linear_to_code(curve(at)) + each) for at, each in zip(places, change, strict=True)]
    inside = np.clip(np.sort(moved, axis=0), light[:-1], light[1:])
    all_codes, all_light = np.concatenate([codes, *places]), np.concatenate([light, *inside])
    order = np.argsort(all_codes, kind="stable")
    return TransferCurve(curve.channel, all_codes[order].tolist(), all_light[order].tolist())


def curve_deviations(problem: FitData) -> Array:
    """Change of the prediction by each of ``problem.drawn``, (draws, n, 3), cd/m²; no draws without native display."""
    tips = problem.measured_tips
    scene, here = problem.scene(tips), tips[problem.hour_of]

    def predicted(native: NativeDisplay | None) -> Array:
        return panel(problem.known, scene, problem.selection, native=native).emit(here)

    usual = predicted(problem.native)
    return np.array([predicted(each) - usual for each in problem.drawn]).reshape(-1, *usual.shape)


def mode_weights(deviations: Array, whitener: Array) -> Array:
    """Principal modes of changes of predictions (draws, n, 3), 1 σ each, as weights of the draws: (q, draws).

    ``whitener`` (n, 3, 3) whitens light by the noise; the modes are principal in these units.
    """
    draws = len(deviations)
    if not draws:
        return np.zeros((0, 0))
    white = np.einsum("nij,dnj->dni", whitener, deviations).reshape(draws, -1)
    weights, size, _ = np.linalg.svd(white, full_matrices=False)
    kept = size > max(LEAST_MODE * float(size.max(initial=0.0)), NOTHING)
    return np.asarray(weights[:, kept].T / np.sqrt(draws))
