"""Rest: the conditions under which the colour points of a session were read.

Rest differs between campaigns: the room was dark or had 5 lx, the panel was at 24 °C, patches filled the screen or 90 %
of the screen. Rest is the set of conditions under which all four colour points (white, red, green, blue at full drive)
of a session were read. Each condition declares the span of values about rest that count as rest. A session without four
colour points under the same conditions takes the rest of the other sessions of its hour, or otherwise the campaign's
rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array
from lutgen.readings.conditions import COLUMNS, CONDITIONS, OF_COLUMN, Condition

#: White and the primaries at full drive, in the order of the paper's index i.
TIP_DRIVES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class RestOfSessions:
    """Conditions at rest of each reading's session, and the readings away from rest."""

    #: Column → value at rest, (n,); NaN: not logged.
    values: Mapping[str, Array]
    #: Name of a condition's cell ("ambient", "cold", …) → whether the condition of each reading is away from rest,
    #: (n,).
    away: Mapping[str, NDArray[np.bool_]]

    def reached(self, count: int) -> NDArray[np.bool_]:
        """Return whether all conditions of each reading are at rest, (n,)."""
        return np.asarray(~np.logical_or.reduce([np.zeros(count, dtype=bool), *self.away.values()]))


def is_tip(drive: Array) -> NDArray[np.bool_]:
    """Return for each code value whether it is white, red, green and blue at full drive, (n, 4)."""
    return np.asarray((drive[:, np.newaxis] == TIP_DRIVES).all(axis=-1))


def rest_of(
    sessions: NDArray[np.intp], hours: Array, drive: Array, capped: NDArray[np.bool_], columns: Mapping[str, Array]
) -> RestOfSessions:
    """Return the rest of every session.

    ``sessions``, ``hours``: session number and hour of each reading, (n,). ``drive``: code values, (n, 3). ``capped``:
    whether the lens was capped, (n,). ``columns``: the columns of conditions, (n,) each.
    """
    columns = {name: _filled(values, COLUMNS[name].usual, sessions) for name, values in columns.items()}
    tips = is_tip(drive) & ~capped[:, np.newaxis]
    at = {name: np.full(sessions.size, COLUMNS[name].blank) for name in columns}
    # Later assignments replace earlier assignments: the rest of the campaign, then of the hour, then of the session.
    for groups in (np.zeros(sessions.size), hours, sessions):
        for group in np.unique(groups):
            rows = np.flatnonzero((groups == group) & tips.any(axis=1))
            centre = _centre(tips[rows], {name: values[rows] for name, values in columns.items()})
            if centre is not None:
                for name, values in columns.items():
                    at[name][groups == group] = middle(values[rows[centre]])
    outside = {name: np.zeros(sessions.size, dtype=bool) for name in columns}
    for session in np.unique(sessions):
        here = sessions == session
        for name, values in columns.items():
            outside[name][here] = _outside(name, values[here], float(at[name][here][0]))
    away = {
        condition.cell: np.logical_or.reduce([outside[name] for name in names]) & condition.matters(columns)
        for condition, names in _logged(columns)
    }
    return RestOfSessions(at, away)


def _logged(columns: Mapping[str, Array]) -> list[tuple[Condition, list[str]]]:
    """Return the conditions with at least one of the columns, and their columns among these."""
    each = [(condition, [one.name for one in condition.columns if one.name in columns]) for condition in CONDITIONS]
    return [(condition, names) for condition, names in each if names]


def _outside(name: str, values: Array, rest: float) -> NDArray[np.bool_]:
    """Return whether values of a column lie outside the span of rest about a value, (n,); NaN has no span."""
    if np.isnan(rest):
        return np.zeros(values.size, dtype=bool)
    low, high = OF_COLUMN[name].span(values, rest)
    return np.asarray((values < low) | (values > high))


def _filled(values: Array, usual: float, sessions: NDArray[np.intp]) -> Array:
    """Return a column, (n,), with the usual value in its blank cells if blank means usual.

    In the column of minutes, a blank cell means warm. In the column of temperature, it usually means unknown. If more
    than half but not all readings of a session have no temperature, blank means the usual 25 °C: people often log only
    the heated readings.
    """
    blank = np.isnan(values)
    if not np.isinf(usual):
        shares = {session: blank[sessions == session].mean() for session in np.unique(sessions)}
        blank &= np.isin(sessions, [session for session, share in shares.items() if 0.5 < share < 1.0])
    return np.where(blank, usual, values)


def _centre(tips: NDArray[np.bool_], columns: Mapping[str, Array]) -> NDArray[np.intp] | None:
    """Return the rows of colour points at rest; None if one of the four colour points is missing."""
    # Rest is the set of conditions with the most colour points: all columns lie within the spans of rest about one
    # reading.
    if not columns:
        return np.arange(len(tips)) if tips.any(axis=0).all() else None
    stacked = np.column_stack(list(columns.values()))
    kinds, kind = np.unique(np.where(np.isnan(stacked), -np.inf, stacked), axis=0, return_inverse=True)
    kind = kind.reshape(-1)
    each = {name: np.where(np.isneginf(values), np.nan, values) for name, values in zip(columns, kinds.T, strict=True)}
    alike = _alike(each)
    sets = np.zeros((len(kinds), tips.shape[1]), dtype=int)
    np.add.at(sets, kind, tips.astype(int))
    counts = alike.astype(int) @ sets
    whole = np.flatnonzero((counts > 0).all(axis=1))
    if not whole.size:
        return None
    usual = sum((values == COLUMNS[name].usual).astype(int) for name, values in each.items()) + np.zeros(len(kinds))
    # Choose the conditions with the most colour-point readings. If several have equally many, choose the conditions
    # with the most usual values: full screen, centre, dark.
    best = max(whole, key=lambda row: (int(counts[row].sum()), float(usual[row])))
    return np.flatnonzero(alike[best][kind])


def _alike(columns: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Return whether each reading (column) lies within the spans of rest about each reading (row), (n, n)."""
    count = next(iter(columns.values())).size
    alike = np.ones((count, count), dtype=bool)
    for condition, names in _logged(columns):
        each = [[_outside(name, columns[name], value) for value in columns[name].tolist()] for name in names]
        matters = condition.matters(columns)
        alike &= ~(np.logical_or.reduce(each) & matters & matters[:, np.newaxis])
    return alike


def middle(values: Array) -> float:
    """Return the median of the logged values; of two middle values the lower, so that the result is a logged value."""
    known = np.sort(values[~np.isnan(values)])
    return float(known[(known.size - 1) // 2]) if known.size else float("nan")
