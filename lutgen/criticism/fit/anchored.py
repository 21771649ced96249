"""The prediction of a baked model: tips are solved from their own readings alone, all other readings are predicted.

In a fit all readings influence the tips. This is right for statistical tests, but shows errors at the wrong readings: a
fault off the centre of the screen would appear as an error of white. Here the effects are given, and the tips are
solved from their own readings only, so that an error appears at the readings that have it. Simulated noise gives the
errors that this procedure shows if the model is true.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, predict
from lutgen.readings.rest import TIP_DRIVES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.fit.problem import Problem

SEED = 20150319

#: Number of simulated campaigns of pure noise; their mean is the noise floor of an error.
DRAWS = 32


def anchored(problem: Problem, terms: Sequence[Term]) -> Array:
    """XYZ that the model predicts, (n, 3), cd/m²: effects given, tips solved from their own readings.

    Tips are solved at every hour; under baselines that predict from the first hour, at hour 0 only.
    """
    return predict(problem, State(_given(terms), anchored_tips(problem, terms), np.zeros(problem.gain_count)))


def anchored_tips(problem: Problem, terms: Sequence[Term]) -> Array:
    """Latent tips of :func:`anchored`, (H, 4, 3), cd/m²."""
    # Readings at full drive have no information on curves: the curve modes are left out.
    part = replace(problem, rows=problem.rows[problem.is_tip_anchor], drawn=())
    solved = fit(part, _given(terms))
    tips = problem.measured_tips.copy()
    if problem.from_first_hour:
        tips[:] = solved.tips[0]
        return tips
    tips[np.isin(problem.hours, part.hours)] = solved.tips
    return problem.interpolated(tips)


def _given(terms: Sequence[Term]) -> tuple[Term, ...]:
    return tuple(replace(term, free=()) for term in terms)


def noise_only(problem: Problem, predicted: Array, draws: int = DRAWS) -> Iterator[Array]:
    """Simulate campaigns in which the prediction is true and noise is added: yield residuals (n, 3), cd/m²; seeded."""
    rng = np.random.default_rng(SEED)
    cholesky = np.linalg.cholesky(problem.covariance(predicted))
    unwhitened = np.linalg.pinv(problem.whitener)
    anchor, before = problem.is_tip_anchor, problem.panel(())
    first_hour_only = problem.from_first_hour
    drive = problem.drive
    tip_rows = [
        (hour, tip, anchor & (problem.hour_of == hour) & (drive == TIP_DRIVES[tip]).all(axis=1))
        for hour in np.flatnonzero(problem.is_knot)[: 1 if first_hour_only else None]
        for tip in range(4)
    ]
    for draw in range(draws):
        noise = np.einsum("nij,nj->ni", cholesky, rng.standard_normal(predicted.shape))
        gains = problem.noise.session * rng.standard_normal(problem.gain_count)
        noise += np.where(problem.gains >= 0, gains[problem.gains], 0.0)[:, np.newaxis] * predicted
        shared = np.zeros_like(noise)
        for whole in problem.blocks:
            columns = problem.shared[int(whole[0])]
            shared[whole] = np.tensordot(rng.standard_normal(len(columns)), columns, axes=1)
        noise += (unwhitened @ shared[..., np.newaxis])[..., 0]
        shift = np.zeros((problem.hours.size, 4, 3))
        for hour, tip, here in tip_rows:
            shift[hour, tip] = noise[here].mean(axis=0)
        shift = np.broadcast_to(shift[0], shift.shape) if first_hour_only else problem.interpolated(shift)
        # At hours between sessions the tips also have the error of their interpolation.
        error = np.where(
            np.isfinite(problem.interpolation_sigma), problem.interpolation_sigma, 0.0
        ) * rng.standard_normal(shift.shape)
        shift = shift + (0.0 if first_hour_only else error)
        if problem.drawn:
            noise = noise - problem.curve_deviations[draw]
        # No light of the display reaches the meter through a cap, whatever code values the display shows behind it.
        yield noise - np.where(problem.is_capped[:, np.newaxis], 0.0, before.emit(shift[problem.hour_of]))
