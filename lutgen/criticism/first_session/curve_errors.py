"""Errors of a native display's curves and black by noise of the first session, which propagate to every hour.

First sessions are simulated with noise, and a native display is made from each. A few principal modes span the changes
of the prediction. A fit treats the sizes of the modes as unknowns that all sessions share. An error of one curve point
gives the same residual in all later sessions; the fit attributes it to the curve, not to aging.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.display.native import NativeDisplay
from lutgen.display.trace import panel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.noise.model import Noise
    from lutgen.readings import Measurements

SEED = 20150319

#: Number of simulated first sessions: more than the points of usual ramps, so that modes span the effects of noise.
DRAWS = 100

#: Smallest size of a mode relative to the largest mode; smaller modes bend curves between their points only.
LEAST_MODE = 1e-2

#: Smallest size of a mode in standard deviations of the noise.
NOTHING = 1e-9


def drawn_displays(
    readings: Measurements, noise: Noise, left_out: Sequence[int], source: str
) -> tuple[NativeDisplay, ...]:
    """Make native displays of ``DRAWS`` simulated first sessions with seeded noise; ``source``: that of the curves."""
    rng = np.random.default_rng(SEED)
    first = np.flatnonzero(readings.hours == 0)
    cholesky = np.linalg.cholesky(noise.covariance(readings.xyz_cd_m2[first]))
    drawn = []
    for _ in range(DRAWS):
        xyz = readings.xyz_cd_m2.copy()
        xyz[first] += np.einsum("nij,nj->ni", cholesky, rng.standard_normal((first.size, 3)))
        drawn.append(NativeDisplay.of(readings.with_light(xyz), left_out, strict=False, source=source))
    return tuple(drawn)


def curve_deviations(problem: Problem) -> Array:
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
