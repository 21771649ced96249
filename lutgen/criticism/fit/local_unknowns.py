"""The local unknowns of a block of readings: tips of its hour, gains and shared errors of its sessions.

The functions return derivatives of the readings by these unknowns, priors of the unknowns as equations, and the span
of the changes that the unknowns make in the readings of a block.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.data import readings_at
from lutgen.criticism.fit.linear import tip_scale

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import State
    from lutgen.criticism.fit.problem import Problem


def local_basis(problem: Problem, local: Array, state: State, here: NDArray[np.intp]) -> Array:
    """Orthonormal basis of the changes that a block's unknowns make in its readings and priors, (3m + k, l)."""
    columns, gains = local_columns(problem, local, here, here)
    prior, _ = prior_rows(problem, state, int(problem.hour_of[here[0]]), gains, len(problem.shared[int(here[0])]))
    return spanned(np.concatenate([columns.reshape(len(columns), 3 * here.size).T, prior]))


def spanned(columns: Array) -> Array:
    """Orthonormal basis of the span of columns (m, k), (m, ≤ k)."""
    if not columns.shape[1]:
        return columns
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(u[:, s > 1e-9 * max(float(s.max(initial=0.0)), 1e-300)])


def local_columns(
    problem: Problem, local: Array, whole: NDArray[np.intp], here: NDArray[np.intp]
) -> tuple[Array, tuple[int, ...]]:
    """Derivatives of readings ``here`` of a ``whole`` block by its local unknowns, (L, m, 3), and numbers of its gains.

    The order of the unknowns: tips of the hour, gains of sessions, shared errors of sessions. ``local`` holds the
    derivatives of all readings by tips and gains.
    """
    columns, gains = own_columns(problem, local, whole, here)
    shared = problem.shared[int(whole[0])]
    shared = shared if here is whole else shared[:, np.searchsorted(whole, here)]
    return np.concatenate([columns, shared]), gains


def own_columns(
    problem: Problem, local: Array, whole: NDArray[np.intp], here: NDArray[np.intp]
) -> tuple[Array, tuple[int, ...]]:
    """Return what :func:`local_columns` returns, without the shared errors of sessions."""
    gains = problem.gains_of[int(whole[0])]
    tips = 0 if problem.from_first_hour else 12
    rows, of_gains = readings_at(here), local[[tips + gain for gain in gains]]
    return np.concatenate([local[:tips, rows], of_gains[:, rows]]), gains


def prior_rows(problem: Problem, state: State, hour: int, gains: tuple[int, ...], shared: int) -> tuple[Array, Array]:
    """Priors of local unknowns as equations in units of σ: coefficients (k, L) and right sides (k,).

    Gains are 0 ± the session's σ, and ``shared`` errors 0 ± 1. The tips of an hour between sessions are those
    interpolated from its neighbours, ± the error of the interpolation.
    """
    tips = 0 if problem.from_first_hour else 12
    if not gains and not shared and (not tips or problem.is_knot[hour]):
        return np.zeros((0, tips)), np.zeros(0)
    # Correlated readings increase χ² by the factor ``correlated``. Weight the prior of a gain by the same factor.
    sigma = max(problem.noise.session / problem.correlated**0.5, 1e-6)
    rows = np.column_stack([np.zeros((len(gains) + shared, tips)), np.eye(len(gains) + shared)])
    rows[: len(gains)] /= sigma
    off = np.concatenate([-state.gains[list(gains)] / sigma, np.zeros(shared)])
    if not tips or problem.is_knot[hour]:
        return rows, off
    interpolation_sigma = problem.interpolation_sigma[hour]
    of_tips = np.column_stack(
        [np.diag((tip_scale(problem) / interpolation_sigma).ravel()), np.zeros((12, len(gains) + shared))]
    )
    off_tips = ((problem.interpolated(state.tips)[hour] - state.tips[hour]) / interpolation_sigma).ravel()
    return np.concatenate([rows, of_tips]), np.concatenate([off, off_tips])
