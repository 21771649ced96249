"""Drift within a session: a patch that was read again gave different light.

The noise is estimated from repeated readings, and the discrepancy of a display's own model from readings of one
session. A drift increases both estimates to its own size, so that any model agrees with the readings.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.noise.replicates import replicate_groups
from lutgen.criticism.noise.tails import OUTLIER
from lutgen.errors import listed
from lutgen.numerals import in_percent
from lutgen.readings.steadiness import FEWEST, SessionDrift, steadiness_of
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from lutgen.criticism.fit.problem import Problem

#: Verdict that names no effect → its meaning in the sentence on a drift.
MEANING = {
    "consistent": "apart from that nothing is above the noise",
    "unexplained": "no known effect explains the residual",
}


@dataclass(frozen=True)
class Drift:
    """The largest change of luminance in a session, as a share, and the reading that shows it."""

    change: float
    hour: float
    #: The reading's line, with the name of its file if there are several files.
    line: str
    code: tuple[float, float, float]

    def sentence(self) -> str:
        """Say how large the change is, and what it means for the readings of the session."""
        code = ", ".join(f"{value:.4g}" for value in self.code)
        return (
            f"Luminance changed within the session at {self.hour:g} h: code {code}, read again in {self.line}, changed "
            f"by {in_percent(self.change, 1, signed=True)}. Unless one of the two readings is wrong, the cause is "
            f"automatic brightness, dimming or warm-up, and all readings of the session are uncertain by as much. "
            f"Switch these off, or wait, and measure again."
        )


def drifts(problem: Problem) -> tuple[Drift, ...]:
    """Return the drifts of all sessions, in their order."""
    numbers, group, wrong = problem.readings.sessions, replicate_groups(problem.readings), _wrong(problem)
    uncapped = ~is_capped(problem.readings)
    sessions = [np.flatnonzero((numbers == each) & uncapped) for each in np.unique(numbers)]
    return tuple(drift for here in sessions for drift in _drift(problem, here, group[here], wrong[here]))


def drift_problem(problem: Problem, verdict: str) -> str:
    """Say which drift makes the measurement unreliable; "" if the verdict names an effect or nothing drifts."""
    unsteady = drifts(problem) if verdict in MEANING else ()
    if not unsteady:
        return ""
    at = listed(f"at {each.hour:g} h by {in_percent(each.change, 1, signed=True)}" for each in unsteady)
    return (
        f"The measurement cannot be trusted: luminance changed within the session {at}, and {MEANING[verdict]}. "
        f"Measure again when brightness is steady."
    )


def _drift(
    problem: Problem, here: NDArray[np.intp], group: NDArray[np.intp], wrong: NDArray[np.bool_]
) -> Iterator[Drift]:
    """Yield the drift of one session, whose readings have the indices ``here``, if there is one."""
    readings, noise = problem.readings, problem.noise
    order = readings.lines if readings.order is None else readings.order
    place = np.argsort(np.argsort(order[here], kind="stable"))
    repeated = np.flatnonzero(np.bincount(group) > 1)
    has_outliers = problem.weights is not None
    patches = [_trusted(np.flatnonzero(group == each), place, wrong, has_outliers=has_outliers) for each in repeated]
    steady = steadiness_of(readings.xyz_cd_m2[here], place, [rows for rows in patches if rows.size > 1])
    if steady is None:
        return
    stated = noise.relative if noise.source == "instrument" else 0.0
    # A drift increases the estimated noise proportional to the light, but not photon noise and floor: these are added.
    other_noise = noise.beside_share(readings.xyz_cd_m2[here[steady.rows], 1])
    changes = [
        SessionDrift(float(change), "repeats", float(np.hypot(max(steady.scatter, stated), other)))
        for change, other in zip(steady.ratio - 1.0, other_noise, strict=True)
    ]
    # A single reading of many may be an outlier; a drift changes several, so the second largest change counts.
    most = sorted(range(len(changes)), key=lambda each: -changes[each].size)[1 if steady.readings >= FEWEST else 0]
    if changes[most].drifted:
        change, row = changes[most].change, int(here[steady.rows[most]])
        red, green, blue = readings.drive[row].tolist()
        yield Drift(change, float(readings.hours[row]), readings.places([row]), (red, green, blue))


def _wrong(problem: Problem) -> NDArray[np.bool_]:
    """Return a mask of the readings that replicates show to be wrong, or that have little weight, (n,)."""
    wrong = np.zeros(problem.readings.hours.size, dtype=bool) if problem.weights is None else problem.weights < OUTLIER
    wrong[list(problem.noise.outliers)] = True
    return wrong


def _trusted(
    rows: NDArray[np.intp], place: NDArray[np.intp], wrong: NDArray[np.bool_], *, has_outliers: bool
) -> NDArray[np.intp]:
    """Leave out the wrong readings of a patch, except its first and last reading, which may show a jump.

    ``has_outliers``: the instrument sometimes gives outliers, so the first and last reading are left out too if wrong.
    """
    ordered = rows[np.argsort(place[rows])]
    between = np.isin(ordered, ordered[1:-1]) | has_outliers
    return np.asarray(ordered[~(between & wrong[ordered])])
