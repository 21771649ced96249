"""Drift within a session: a patch that was read again gave other light.

Noise is told by readings that were repeated, and the discrepancy of a display's own model by readings of one session. A
drift makes both as large as itself, and any model then agrees with the readings.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.noise.replicates import replicate_groups
from lutgen.criticism.noise.tails import OUTLIER
from lutgen.readings.steadiness import FEWEST, SessionDrift, steadiness_of
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from lutgen.criticism.fit.problem import Problem

#: Verdict that names nothing → what is there beside a drift.
BESIDE = {
    "consistent": "beside that nothing is above the noise",
    "unexplained": "no known effect explains what is left",
}


@dataclass(frozen=True)
class Drift:
    """A session's largest change of luminance, as a share, and the reading that shows it."""

    change: float
    hour: float
    #: The reading's line, beside the name of its file where there are several.
    line: str
    code: tuple[float, float, float]

    def sentence(self) -> str:
        """Say the change, and what readings of such a session are worth."""
        code = ", ".join(f"{value:.4g}" for value in self.code)
        return (
            f"Luminance changed within the session at {self.hour:g} h: code {code}, read before, has "
            f"{self.change:+.1%} in {self.line}. Unless one of the two was misread, that is automatic brightness, "
            f"dimming or warm-up, and all readings of the session are uncertain by as much. Switch these off, or wait, "
            f"and measure again."
        )


def drifts(problem: Problem) -> tuple[Drift, ...]:
    """Return the drifts of all sessions, in their order."""
    numbers, group, wrong = problem.readings.sessions, replicate_groups(problem.readings), _wrong(problem)
    seen = ~is_capped(problem.readings)
    sessions = [np.flatnonzero((numbers == each) & seen) for each in np.unique(numbers)]
    return tuple(found for here in sessions for found in _drift(problem, here, group[here], wrong[here]))


def doubt(problem: Problem, verdict: str) -> str:
    """Say why the measurement, before the display, is to be doubted; "" where an effect is named or nothing drifts."""
    unsteady = drifts(problem) if verdict in BESIDE else ()
    if not unsteady:
        return ""
    at = " and ".join(f"at {each.hour:g} h by {each.change:+.1%}" for each in unsteady)
    return (
        f"The measurement cannot be trusted: luminance changed within the session {at}, and {BESIDE[verdict]}. Measure "
        f"again when brightness is steady."
    )


def _drift(
    problem: Problem, here: NDArray[np.intp], group: NDArray[np.intp], wrong: NDArray[np.bool_]
) -> Iterator[Drift]:
    """Yield the drift of one session, whose readings are ``here``, if there is any."""
    readings, noise = problem.readings, problem.noise
    order = readings.lines if readings.order is None else readings.order
    place = np.argsort(np.argsort(order[here], kind="stable"))
    repeated = np.flatnonzero(np.bincount(group) > 1)
    slips = problem.weights is not None
    patches = [_believed(np.flatnonzero(group == each), place, wrong, slips=slips) for each in repeated]
    steady = steadiness_of(readings.xyz_cd_m2[here], place, [rows for rows in patches if rows.size > 1])
    if steady is None:
        return
    stated = noise.relative if noise.source == "instrument" else 0.0
    # What a drift makes larger is the noise that goes with the light; not that of photons and of the floor.
    dim = noise.beside_share(readings.xyz_cd_m2[here[steady.rows], 1])
    found = [
        SessionDrift(float(change), "repeats", float(np.hypot(max(steady.scatter, stated), own)))
        for change, own in zip(steady.ratio - 1.0, dim, strict=True)
    ]
    # One reading of many may be a slip; a drift moves more of them.
    most = sorted(range(len(found)), key=lambda each: -found[each].size)[1 if steady.readings >= FEWEST else 0]
    if found[most].ran_away:
        change, row = found[most].change, int(here[steady.rows[most]])
        red, green, blue = readings.drive[row].tolist()
        yield Drift(change, float(readings.hours[row]), readings.places([row]), (red, green, blue))


def _wrong(problem: Problem) -> NDArray[np.bool_]:
    """Readings that replicates show to be wrong, or that hardly count, (n,)."""
    wrong = np.zeros(problem.readings.hours.size, dtype=bool) if problem.weights is None else problem.weights < OUTLIER
    wrong[list(problem.noise.outliers)] = True
    return wrong


def _believed(
    rows: NDArray[np.intp], place: NDArray[np.intp], wrong: NDArray[np.bool_], *, slips: bool
) -> NDArray[np.intp]:
    """Leave out those of a patch's readings that are wrong between others; the first and last may show a jump.

    ``slips``: of an instrument that slips now and then, these too.
    """
    ordered = rows[np.argsort(place[rows])]
    between = np.isin(ordered, ordered[1:-1]) | slips
    return np.asarray(ordered[~(between & wrong[ordered])])
