"""Bounded steps of the fit against the conditions of Karush, Kuhn and Tucker; what is known of local unknowns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lutgen.criticism.fit.linear import State, tip_scale
from lutgen.criticism.fit.local_unknowns import prior_rows
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.fit.system import Block, bounded
from tests.criticism_twin import FAULTS, HOURS, TIPS, display, noisy, session, table

pytestmark = pytest.mark.numbers

#: Boxes of four unknowns: no bounds, some bounds, two unknowns fixed at a value beside 0, all four fixed.
BOXES = {
    "free": (np.full(4, -np.inf), np.full(4, np.inf)),
    "cut": (np.array([-0.1, -0.2, -np.inf, 0.0]), np.array([0.1, 0.05, 0.3, np.inf])),
    "held": (np.array([0.4, -0.3, -1.0, -1.0]), np.array([0.4, -0.3, 1.0, 1.0])),
    "still": (np.array([0.4, -0.3, 0.2, 0.1]), np.array([0.4, -0.3, 0.2, 0.1])),
}


@pytest.mark.parametrize("damping", [0.0, 0.01, 3.0])
@pytest.mark.parametrize("box", BOXES)
def test_a_step_is_the_least_of_the_damped_squares_within_its_bounds(box: str, damping: float) -> None:
    low, high = BOXES[box]
    for seed in range(8):
        rng = np.random.default_rng([seed, 21])
        # Columns of very different sizes, like the columns of parameters.
        A, z = rng.standard_normal((9, 4)) * (1.0, 30.0, 0.2, 5.0), rng.standard_normal(9)
        change = bounded(A, z, low, high, damping)
        step = change.parameters
        assert (step >= low).all()
        assert (step <= high).all()
        # Marquardt's damping weighs each unknown by the sum of its column's squares.
        slope = (A.T @ (A @ step - z) + damping * (A**2).sum(axis=0) * step) / np.linalg.norm(A, axis=0)
        inside = (step > low) & (step < high)
        np.testing.assert_allclose(slope[inside], 0.0, atol=1e-6)
        assert (slope[(step == low) & (low < high)] > -1e-6).all()
        assert (slope[(step == high) & (low < high)] < 1e-6).all()
        assert change.chi2 == pytest.approx(((z - A @ step) ** 2).sum())


def test_unknowns_that_only_trade_off_stay_small() -> None:
    A = np.array([[1.0, 1.0], [2.0, 2.0], [0.0, 0.0]])
    step = bounded(A, np.array([1.0, 2.0, 5.0]), np.full(2, -np.inf), np.full(2, np.inf)).parameters
    np.testing.assert_allclose(step, 0.5, rtol=1e-9)


@pytest.mark.parametrize(("upper", "wanted"), [
    # Two unknowns, one parameter, the residual: the parameter's step leaves 1.5 and 2.
    ([[2.0, 1.0, 0.5, 2.0], [0.0, 4.0, -1.0, 1.0]], [0.5, 0.5]),
    # Only the sum of both unknowns is known: in the smallest step each unknown gets half.
    ([[1.0, 1.0, 0.5, 2.0], [0.0, 0.0, 0.0, 0.0]], [0.75, 0.75]),
])  # fmt: skip
def test_local_unknowns_follow_from_a_triangle_though_it_be_singular(
    upper: list[list[float]], wanted: list[float]
) -> None:
    block = Block(np.array(upper), np.zeros((0, 2)), None, ())
    np.testing.assert_allclose(block.local_step(np.array([1.0])), wanted, rtol=1e-12)


@pytest.mark.parametrize("correlated", [1.0, 9.0])
def test_local_unknowns_are_drawn_to_rest_and_to_their_neighbours(correlated: float) -> None:
    every = [each for hour in HOURS for name in "ab" for each in session(hour, name)]
    patches = [each for each in every if each.hour != HOURS[1] or each.code not in TIPS]
    readings = noisy(patches, display(), FAULTS["crosstalk"], {"new": 0.0, "grown": 0.0}, seed=5)
    problem = Problem.of(table(readings), instrument="0.002,0.003")
    problem = replace(problem, noise=replace(problem.noise, session=0.004))
    problem.__dict__["correlated"] = correlated
    rng = np.random.default_rng(6)
    tips = problem.measured_tips * (1.0 + 0.01 * rng.standard_normal(problem.measured_tips.shape))
    state = State((), tips, rng.standard_normal(len(problem.gain_keys)))
    assert len(state.gains) > 0
    assert problem.is_knot.tolist() == [True, False, True]
    for hour, knot in enumerate(problem.is_knot):
        gains = tuple(range(len(state.gains)))
        rows, off = prior_rows(problem, state, hour, gains, 1)
        back = np.concatenate([np.zeros(12), -state.gains, [0.0]])
        scale = np.concatenate([np.zeros(12), np.full(len(gains), 0.004 / correlated**0.5), [1.0]])
        if not knot:
            back[:12] = ((problem.interpolated(tips)[hour] - tips[hour]) / tip_scale(problem)).ravel()
            scale[:12] = (problem.interpolation_sigma[hour] / tip_scale(problem)).ravel()
        # Each known unknown has one equation, which the back substitution solves and whose σ is 1.
        known = scale > 0
        assert np.count_nonzero(rows) == np.count_nonzero(known) == len(rows)
        np.testing.assert_allclose(rows @ back, off, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(np.abs(rows).sum(axis=0)[known] * scale[known], 1.0)
