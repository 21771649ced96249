"""What noise in the first session leaves open of a native display: its curves and black carry that into every hour.

First sessions are drawn as noise might have had them, and each makes a native display of its own. What these do to the
prediction is spanned by a few modes; a fit treats their sizes as unknowns that all sessions share, so that a point of a
curve that noise has moved, which every later session contradicts alike, is not taken for aging.
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

#: First sessions that are drawn: more than the points of usual ramps, so that modes span what noise does.
DRAWS = 100

#: A mode smaller than this share of the largest is none: curves bend little between their points.
LEAST_MODE = 1e-2

#: Where no prediction moves by more than this many standard deviations there are no modes.
NOTHING = 1e-9


def drawn_displays(
    readings: Measurements, noise: Noise, left_out: Sequence[int], source: str
) -> tuple[NativeDisplay, ...]:
    """Make native displays of ``DRAWS`` first sessions that differ by noise, seeded; ``source`` as of the display."""
    rng = np.random.default_rng(SEED)
    first = np.flatnonzero(readings.hours == 0)
    root = np.linalg.cholesky(noise.covariance(readings.xyz_cd_m2[first]))
    drawn = []
    for _ in range(DRAWS):
        xyz = readings.xyz_cd_m2.copy()
        xyz[first] += np.einsum("nij,nj->ni", root, rng.standard_normal((first.size, 3)))
        drawn.append(NativeDisplay.of(readings.with_light(xyz), left_out, strict=False, source=source))
    return tuple(drawn)


def curve_deviations(problem: Problem) -> Array:
    """What each drawn display does to the prediction, (draws, n, 3), cd/m²; no draws without a native display."""
    tips = problem.measured_tips
    scene, here = problem.scene(tips), tips[problem.hour_of]

    def predicted(native: NativeDisplay | None) -> Array:
        return panel(problem.known, scene, problem.selection, native=native).emit(here)

    usual = predicted(problem.native)
    return np.array([predicted(each) - usual for each in problem.drawn]).reshape(-1, *usual.shape)


def mode_weights(doubt: Array, whitener: Array) -> Array:
    """Principal modes of drawn predictions (draws, n, 3) in units of the noise, as weights of the draws: (q, draws).

    ``whitener`` (n, 3, 3) takes light to those units. Each mode is one standard deviation large.
    """
    draws = len(doubt)
    if not draws:
        return np.zeros((0, 0))
    white = np.einsum("nij,dnj->dni", whitener, doubt).reshape(draws, -1)
    weights, size, _ = np.linalg.svd(white, full_matrices=False)
    kept = size > max(LEAST_MODE * float(size.max(initial=0.0)), NOTHING)
    return np.asarray(weights[:, kept].T / np.sqrt(draws))
