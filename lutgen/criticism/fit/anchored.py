"""Prediction as a user would bake it: tips from their own readings alone, everything else predicted.

A fit lets all readings pull at the tips, which is right for weighing evidence and wrong for looking: a fault off the
centre would seem to darken the white. Here the tips are solved, with the effects in place, from their own readings, so
that the error shows where it is. The floor is what noise alone does to the same procedure.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, predict
from lutgen.criticism.fit.measured_tips import interpolated
from lutgen.readings.rest import TIP_DRIVES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.fit.problem import Problem

SEED = 20150319

#: Campaigns of pure noise that the floor is the mean of.
DRAWS = 32


def anchored(problem: Problem, terms: Sequence[Term]) -> Array:
    """XYZ that the model predicts, (n, 3), cd/m², solved from the readings that it is anchored to, effects given.

    Tips are solved at every hour, under baselines that foretell at hour 0 only.
    """
    return predict(problem, State(_given(terms), anchored_tips(problem, terms), np.zeros(problem.gain_count)))


def anchored_tips(problem: Problem, terms: Sequence[Term]) -> Array:
    """Latent tips behind that prediction, (H, 4, 3), cd/m²."""
    # White and primaries are full drive, which says nothing of curves: none but the first session's own is drawn.
    part = replace(problem, rows=problem.rows[problem.is_tip_anchor], drawn=())
    solved = fit(part, _given(terms))
    tips = problem.measured_tips.copy()
    if problem.from_first_hour:
        tips[:] = solved.tips[0]
        return tips
    tips[np.isin(problem.hours, part.hours)] = solved.tips
    return interpolated(problem, tips)


def _given(terms: Sequence[Term]) -> tuple[Term, ...]:
    return tuple(replace(term, free=()) for term in terms)


def noise_only(problem: Problem, predicted: Array, draws: int = DRAWS) -> Iterator[Array]:
    """Residuals (n, 3) in cd/m² of campaigns in which the prediction is true and only noise is added; seeded."""
    rng = np.random.default_rng(SEED)
    root = np.linalg.cholesky(problem.covariance(predicted))
    unwhitened = np.linalg.pinv(problem.whitener)
    anchor, before = problem.is_tip_anchor, problem.panel(())
    fresh = problem.from_first_hour
    drive = problem.readings.drive[problem.rows]
    of_tip = [
        (hour, tip, anchor & (problem.hour_of == hour) & (drive == TIP_DRIVES[tip]).all(axis=1))
        for hour in np.flatnonzero(problem.is_knot)[: 1 if fresh else None]
        for tip in range(4)
    ]
    for draw in range(draws):
        noise = np.einsum("nij,nj->ni", root, rng.standard_normal(predicted.shape))
        gains = problem.noise.session * rng.standard_normal(problem.gain_count)
        noise += np.where(problem.gains >= 0, gains[problem.gains], 0.0)[:, np.newaxis] * predicted
        shared = np.zeros_like(noise)
        for whole in problem.blocks:
            columns = problem.shared[int(whole[0])]
            shared[whole] = np.tensordot(rng.standard_normal(len(columns)), columns, axes=1)
        noise += (unwhitened @ shared[..., np.newaxis])[..., 0]
        shift = np.zeros((problem.hours.size, 4, 3))
        for hour, tip, here in of_tip:
            shift[hour, tip] = noise[here].mean(axis=0)
        shift = np.broadcast_to(shift[0], shift.shape) if fresh else interpolated(problem, shift)
        # Between sessions the tips are off by what a straight line misses as well.
        bend = np.where(
            np.isfinite(problem.interpolation_sigma), problem.interpolation_sigma, 0.0
        ) * rng.standard_normal(shift.shape)
        shift = shift + (0.0 if fresh else bend)
        if problem.drawn:
            noise = noise - problem.curve_doubt[draw]
        yield noise - before.emit(shift[problem.hour_of])
