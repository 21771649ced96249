"""Rest: under which conditions a campaign's colour points were read, session by session.

No value is rest for every campaign: rest is the campaign's own, whether its room was dark or had 5 lx, its panel was
24 °C, its patches filled the screen or 90 % of it. In each session the colour points (white, red, green, blue at full
drive) that were read under the same conditions, all four of them, tell the value of every column; a condition says how
far a reading may lie from that. A session without a set of its own takes the rest of its hour's others, else the
campaign's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.readings.conditions import COLUMNS, CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: White and the primaries at full drive, in the order of the paper's index i.
TIP_DRIVES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Rest:
    """Rest of each reading's session.

    Attributes
    ----------
    values
        Column → its value at rest, (n,); NaN where nobody logged it.
    away
        Cell of a condition ("ambient", "cold", …) → readings that were taken away from rest by it, (n,).

    """

    values: Mapping[str, Array]
    away: Mapping[str, NDArray[np.bool_]]

    def reached(self, count: int) -> NDArray[np.bool_]:
        """Readings that are away from rest by no condition, (n,)."""
        rest = np.ones(count, dtype=bool)
        for away in self.away.values():
            rest &= ~away
        return rest


def is_tip(drive: Array) -> NDArray[np.bool_]:
    """Which colour point each code value is, (n, 4)."""
    return np.asarray((drive[:, np.newaxis] == TIP_DRIVES).all(axis=-1))


def rest_of(
    sessions: NDArray[np.intp], hours: Array, drive: Array, capped: NDArray[np.bool_], columns: Mapping[str, Array]
) -> Rest:
    """Find the rest of every session.

    Parameters
    ----------
    sessions, hours
        Number of each reading's session and its hour, (n,) each.
    drive, capped
        Code values (n, 3), and which readings were taken with the lens capped.
    columns
        The columns of conditions, (n,) each.

    """
    # A blank cell of minutes means warm, which is as long on as can be; of temperature, that nobody knows.
    columns = {
        name: np.where(np.isnan(values), COLUMNS[name].usual, values) if np.isinf(COLUMNS[name].usual) else values
        for name, values in columns.items()
    }
    tips = is_tip(drive) & ~capped[:, np.newaxis]
    at = {name: np.full(sessions.size, COLUMNS[name].blank) for name in columns}
    # A set that is complete in its session alone counts most, then one of its hour, then one of the campaign.
    for groups in (np.zeros(sessions.size), hours, sessions):
        for group in np.unique(groups):
            rows = np.flatnonzero((groups == group) & tips.any(axis=1))
            centre = _centre(tips[rows], {name: values[rows] for name, values in columns.items()})
            if centre is not None:
                for name, values in columns.items():
                    at[name][groups == group] = middle(values[rows[centre]])
    spans = {name: np.empty((sessions.size, 2)) for name in columns}
    for session in np.unique(sessions):
        here = sessions == session
        for condition in CONDITIONS:
            for name in (column.name for column in condition.columns if column.name in columns):
                value = float(at[name][here][0])
                spans[name][here] = (-np.inf, np.inf) if np.isnan(value) else condition.span(columns[name][here], value)
    return Rest(at, _away(columns, spans))


def _away(columns: Mapping[str, Array], spans: Mapping[str, Array]) -> dict[str, NDArray[np.bool_]]:
    away = {}
    for condition in CONDITIONS:
        names = [column.name for column in condition.columns if column.name in columns]
        if names:
            outside = np.zeros(len(columns[names[0]]), dtype=bool)
            for name in names:
                low, high = spans[name].T
                outside |= (columns[name] < low) | (columns[name] > high)
            away[condition.cell] = outside & condition.matters(columns)
    return away


def _centre(tips: NDArray[np.bool_], columns: Mapping[str, Array]) -> NDArray[np.intp] | None:
    """Places of the colour points, among those of one session, that were read at rest; None without all four.

    Rest is where most of them were read alike: every column within the span of rest about one reading's value.
    """
    if not columns:
        return np.arange(len(tips)) if tips.any(axis=0).all() else None
    stacked = np.column_stack(list(columns.values()))
    kinds, kind = np.unique(np.where(np.isnan(stacked), -np.inf, stacked), axis=0, return_inverse=True)
    kind = kind.reshape(-1)
    each = {name: np.where(np.isneginf(values), np.nan, values) for name, values in zip(columns, kinds.T, strict=True)}
    alike = _alike(each)
    sets = np.zeros((len(kinds), tips.shape[1]), dtype=int)
    np.add.at(sets, kind, tips.astype(int))
    beside = alike.astype(int) @ sets
    whole = np.flatnonzero((beside > 0).all(axis=1))
    if not whole.size:
        return None
    usual = sum((values == COLUMNS[name].usual).astype(int) for name, values in each.items()) + np.zeros(len(kinds))
    # Most readings first; of as many, those nearer to what is usual: full screen, centre, dark.
    best = max(whole, key=lambda row: (int(beside[row].sum()), float(usual[row])))
    return np.flatnonzero(alike[best][kind])


def _alike(columns: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Which readings (columns of the matrix) lie within the spans of rest about each (its rows), (n, n)."""
    count = next(iter(columns.values())).size
    alike = np.ones((count, count), dtype=bool)
    for condition in CONDITIONS:
        apart = np.zeros_like(alike)
        here = [column.name for column in condition.columns if column.name in columns]
        for name in here:
            values = columns[name]
            for row, value in enumerate(values):
                if not np.isnan(value):
                    low, high = condition.span(values, float(value))
                    apart[row] |= (values < low) | (values > high)
        if here:
            matters = condition.matters(columns)
            alike &= ~(apart & matters & matters[:, np.newaxis])
    return alike


def middle(values: Array) -> float:
    """Median of the values that were logged: one of them, so that replicates name a value that was read."""
    known = np.sort(values[~np.isnan(values)])
    return float(known[(known.size - 1) // 2]) if known.size else float("nan")
