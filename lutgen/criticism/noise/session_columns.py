"""Errors that the readings of a session share: changes of the readings by a dark offset and by a drift of the gain.

If the file states the order of reading, the gain drifts along this order. Otherwise readings of one kind (a ramp,
positions, windows) are assumed to be consecutive, and each kind has a gain.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.criticism.fit.families import kind_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.data import FitData

#: Number of modes of the gain drift: the first modes of Brownian motion, whose sizes fall as 1, 1/3, 1/5.
DRIFT_MODES = 4


class Marginal(NamedTuple):
    """Marginal covariance of whitened readings with shared errors as noise: 1 + U diag(variances) Uᵀ.

    ``directions`` U (m, k); ``variances`` (k,).
    """

    directions: Array
    variances: Array

    @classmethod
    def of(cls, columns: Array) -> Marginal:
        """Make the covariance by errors with whitened columns (k, n, 3), 1 σ each."""
        rows = columns.reshape(len(columns), columns.shape[1] * 3)
        directions, sizes, _ = np.linalg.svd(rows.T, full_matrices=False)
        return cls(directions, sizes**2)

    def whitened(self, rows: Array) -> Array:
        """Whiten rows (..., m) by the marginal covariance."""
        return np.asarray(rows - self._along(rows, 1.0 - 1.0 / np.sqrt(1.0 + self.variances)))

    def expected(self, residual: Array) -> Array:
        """Posterior mean of the shared errors' part of residuals (..., m)."""
        return self._along(residual, self.variances / (1.0 + self.variances))

    def _along(self, rows: Array, shares: Array) -> Array:
        """Projection of rows on the directions, scaled by ``shares`` (k,)."""
        return np.asarray(((rows @ self.directions) * shares) @ self.directions.T)


class SessionEstimate(NamedTuple):
    """Estimates of the errors that the readings of a block share: names (k,), estimates (k,), covariance (k, k)."""

    hour: float
    names: list[str]
    estimate: Array
    covariance: Array


def shared_columns(problem: FitData, here: NDArray[np.intp], whitener: Array) -> tuple[list[str], Array]:
    """Errors shared by readings ``here`` of a block: names, and whitened changes of the readings by 1 σ, (k, m, 3).

    ``whitener``: the matrices (n, 3, 3) of all readings. The errors of each session are the dark offset in X, Y and Z,
    and the modes of the gain drift.
    """
    names: list[str] = []
    columns = [np.zeros((0, here.size, 3))]
    sessions, whitener = problem.readings.sessions[problem.rows][here], whitener[here]
    for session in np.unique(sessions):
        in_session = sessions == session
        # The dark offset of a native display's first session is one of the errors of that session
        # (``first_session_model.errors``).
        if problem.offset_cd_m2 > 0 and not (problem.native and (problem.hour_of[here][in_session] == 0).all()):
            names += ["X", "Y", "Z"]
            offsets = whitener @ (problem.offset_cd_m2 * problem.noise.dark_offset)
            columns.append(np.moveaxis(offsets, 2, 0) * in_session[:, np.newaxis])
        if problem.wander > 0:
            gains = _gains(problem, here, in_session)
            names += gains
            light = np.einsum("nij,nj->ni", whitener, problem.wander * problem.xyz[here])
            columns.append(np.array([*gains.values()]).reshape(-1, here.size, 1) * light)
    return names, np.concatenate(columns)


def _gains(problem: FitData, here: NDArray[np.intp], in_session: NDArray[np.bool_]) -> dict[str, Array]:
    """Modes of the gain drift of a session: name → relative change of the readings by 1 σ, (m,), for a drift of 1."""
    if problem.readings.order is not None:
        modes = _drift_modes(problem.readings.order[problem.rows][here], in_session)
        return {f"mode {number}": mode for number, mode in enumerate(modes)}
    # The gain of white and primaries is the session gain; the gains of other kinds are relative to it.
    kinds, others = kind_of(problem)[here], in_session & ~problem.is_tip_anchor[here]
    return {str(kind): np.asarray(others & (kinds == kind), dtype=float) for kind in np.unique(kinds[others])}


def _drift_modes(order: Array, in_session: NDArray[np.bool_]) -> Array:
    """Modes of Brownian motion along the order of reading of a session, (modes, m); 0 in other sessions."""
    time = np.zeros(order.size)
    read = order[in_session]
    time[in_session] = (read - read.min()) / max(float(np.ptp(read)), 1e-300)
    frequencies = np.pi * (np.arange(1, DRIFT_MODES + 1) - 0.5)[:, np.newaxis]
    return np.asarray(np.sqrt(2.0) * np.sin(frequencies * time) / frequencies)
