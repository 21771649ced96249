"""What the errors that a session shares do to its readings: a dark offset, and a gain that wanders while it is read.

Where the file tells the order of reading, the gain wanders along it. Where it does not, readings of one kind (a ramp,
positions, windows) are taken to have been read one after the other, with a gain of their own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.criticism.fit.families import kind_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem

#: Modes of a wandering gain: the first of those of Brownian motion, whose sizes fall as 1, 1/3, 1/5.
WANDER_MODES = 4


class Marginal(NamedTuple):
    """Errors that readings share, taken for noise: what of whitened readings they make, U diag(variances) Uᵀ.

    ``directions`` U (m, k); ``variances`` (k,) beside the 1 of each reading's own noise.
    """

    directions: Array
    variances: Array

    @classmethod
    def of(cls, columns: Array) -> Marginal:
        """Take whitened columns (k, n, 3) of one standard deviation each."""
        rows = columns.reshape(len(columns), columns.shape[1] * 3)
        directions, sizes, _ = np.linalg.svd(rows.T, full_matrices=False)
        return cls(directions, sizes**2)

    def whitened(self, rows: Array) -> Array:
        """Bring readings (..., m) to independent noise of 1, the shared errors in it."""
        return np.asarray(rows - self._along(rows, 1.0 - 1.0 / np.sqrt(1.0 + self.variances)))

    def expected(self, residual: Array) -> Array:
        """What shared errors make of residuals (..., m), as far as one can tell."""
        return self._along(residual, self.variances / (1.0 + self.variances))

    def _along(self, rows: Array, shares: Array) -> Array:
        return np.asarray(((rows @ self.directions) * shares) @ self.directions.T)


def shared_columns(problem: Problem, here: NDArray[np.intp]) -> tuple[list[str], Array]:
    """Errors shared by readings ``here`` of a block, one standard deviation each: names, whitened columns (k, m, 3).

    For each session the dark offset in X, Y and Z, and what the wandering gain does.
    """
    names: list[str] = []
    columns = [np.zeros((0, here.size, 3))]
    sessions, whitener = problem.readings.sessions[problem.rows][here], problem.whitener[here]
    for session in np.unique(sessions):
        mine = sessions == session
        # A native display's black has the dark offset of the first session in it (``first_session_model.errors``).
        if problem.offset_cd_m2 > 0 and not (problem.native and (problem.hour_of[here][mine] == 0).all()):
            names += ["X", "Y", "Z"]
            columns.append(np.moveaxis(whitener * problem.offset_cd_m2, 2, 0) * mine[:, np.newaxis])
        if problem.wander > 0:
            gains = _gains(problem, here, mine)
            names += gains
            light = np.einsum("nij,nj->ni", whitener, problem.wander * problem.xyz[here])
            columns.append(np.array([*gains.values()]).reshape(-1, here.size, 1) * light)
    return names, np.concatenate(columns)


def _gains(problem: Problem, here: NDArray[np.intp], mine: NDArray[np.bool_]) -> dict[str, Array]:
    """Name → gain of the readings of a session at one standard deviation of its wandering, (m,)."""
    if problem.readings.order is not None:
        modes = _wander(problem.readings.order[problem.rows][here], mine)
        return {f"mode {number}": mode for number, mode in enumerate(modes)}
    # The gain of white and primaries is the session's own, beside which those of other kinds are told.
    kinds, others = kind_of(problem)[here], mine & ~problem.is_tip_anchor[here]
    return {str(kind): np.asarray(others & (kinds == kind), dtype=float) for kind in np.unique(kinds[others])}


def _wander(order: Array, mine: NDArray[np.bool_]) -> Array:
    """Modes of Brownian motion over the order of reading of a session, (modes, m); 0 in other sessions."""
    time = np.zeros(order.size)
    read = order[mine]
    time[mine] = (read - read.min()) / max(float(np.ptp(read)), 1e-300)
    turns = np.pi * (np.arange(1, WANDER_MODES + 1) - 0.5)[:, np.newaxis]
    return np.asarray(np.sqrt(2.0) * np.sin(turns * time) / turns)
