"""What the errors that a session shares do to its readings: a dark offset, and a gain that wanders while it is read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.problem import Problem

#: Modes of a wandering gain: the first of those of Brownian motion, whose sizes fall as 1, 1/3, 1/5.
WANDER_MODES = 3


def shared_columns(problem: Problem, here: NDArray[np.intp]) -> Array:
    """Errors shared by readings ``here`` of a block, one standard deviation each, whitened: (k, m, 3).

    For each session the dark offset in X, Y and Z, and, where the order of reading is known, the Karhunen-Loève modes
    of a gain that wanders as Brownian motion does.
    """
    columns = [np.zeros((0, here.size, 3))]
    readings = problem.readings
    sessions, whitener = readings.sessions[problem.rows][here], problem.whitener[here]
    order = None if readings.order is None else readings.order[problem.rows][here]
    for session in np.unique(sessions):
        mine = sessions == session
        if problem.offset_cd_m2 > 0:
            columns.append(np.moveaxis(whitener * problem.offset_cd_m2, 2, 0) * mine[:, np.newaxis])
        if problem.wander > 0 and order is not None:
            light = np.einsum("nij,nj->ni", whitener, problem.xyz[here]) * mine[:, np.newaxis]
            columns.append(problem.wander * _wander(order, mine)[:, :, np.newaxis] * light)
    return np.concatenate(columns)


def _wander(order: Array, mine: NDArray[np.bool_]) -> Array:
    """Modes of Brownian motion over the order of reading of a session, (modes, m); 0 in other sessions."""
    time = np.zeros(order.size)
    read = order[mine]
    time[mine] = (read - read.min()) / max(float(np.ptp(read)), 1e-300)
    turns = np.pi * (np.arange(1, WANDER_MODES + 1) - 0.5)[:, np.newaxis]
    return np.asarray(np.sqrt(2.0) * np.sin(turns * time) / turns)
