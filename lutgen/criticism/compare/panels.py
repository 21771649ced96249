"""Residuals by dimension: the error over the noise, and its direction, for each hour, colour and condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_lab
from lutgen.criticism.compare.slices import labels_of
from lutgen.criticism.fit.anchored import noise_only
from lutgen.criticism.fit.linear import whiten
from lutgen.readings.conditions import CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.compare.comparison import Comparison
    from lutgen.criticism.fit.problem import Problem

#: Colour families in the order of a panel.
FAMILIES = (
    "black", "grey", "red ramp", "green ramp", "blue ramp", "secondary", "mixture", "colour points", "lens cap",
)  # fmt: skip


@dataclass(frozen=True)
class ResidualPanel:
    """Errors by one dimension, k slices in order.

    Attributes
    ----------
    by
        The dimension.
    headed
        Index of the slice in the panel's title: the worst slice. Slices of a condition hold the same patches.
    labels, places
        Name and position on the axis of each slice; u, v of shape (k, 2) for a condition of two columns.
    ratio, band
        Root mean square over that of noise alone, (k,), and its range in campaigns of noise alone, (k, 2).
    lab, scatter
        Mean ΔL*, Δa*, Δb*, measured minus predicted, (k, 3), and two standard deviations of noise alone, (k, 3).

    """

    by: str
    headed: int
    labels: tuple[str, ...]
    places: Array
    ratio: Array
    band: Array
    lab: Array
    scatter: Array

    @property
    def worst(self) -> float:
        """Error over noise in the slice of the title."""
        return float(self.ratio[self.headed])


def panels(comparison: Comparison) -> list[ResidualPanel]:
    """Return the panels of a comparison, one for each dimension with at least two slices."""
    problem, predicted = comparison.problem, comparison.predicted
    judged = ~problem.is_anchor
    white = problem.measured_tips[0, 0]
    lab = xyz_to_lab(predicted, white)

    def sizes(residual: Array) -> tuple[Array, Array]:
        return (whiten(problem, residual) ** 2).mean(axis=1), xyz_to_lab(predicted + residual, white) - lab

    measured = sizes(comparison.residual)
    noise = [sizes(each) for each in noise_only(problem, predicted)]
    by_dimension = []
    for by, label in labels_of(problem).items():
        among = judged & (label != "")
        names = _in_order(problem, by, label, among)
        chosen = [among & (label == name) for name in names]
        if len(names) < 2:
            continue
        drawn = np.array([[each[0][here].mean() for here in chosen] for each in noise])
        floor = np.sqrt(drawn.mean(axis=0))
        means = np.array([[each[1][here].mean(axis=0) for here in chosen] for each in noise])
        ratio = np.sqrt([measured[0][here].mean() for here in chosen]) / floor
        by_dimension.append(
            ResidualPanel(
                by,
                int(np.argmax(ratio)),
                tuple(names),
                _places(problem, by, chosen),
                ratio,
                np.stack([np.sqrt(drawn.min(axis=0)), np.sqrt(drawn.max(axis=0))], axis=1) / floor[:, np.newaxis],
                np.array([measured[1][here].mean(axis=0) for here in chosen]),
                2.0 * np.sqrt((means**2).mean(axis=0)),
            )
        )
    return by_dimension


def _column(problem: Problem, by: str) -> Array:
    if by == "hour":
        return problem.hours[problem.hour_of]
    if by == "level":
        return np.asarray(problem.drive.max(axis=1))
    columns = _columns(problem, by)
    return columns[0] if len(columns) == 1 else np.asarray(columns[1] * 1e3 + columns[0])


def _columns(problem: Problem, by: str) -> list[Array]:
    """Return the columns of the condition of a dimension, (n,) each; [] for other dimensions."""
    columns = [column.name for condition in CONDITIONS if condition.key == by for column in condition.columns]
    return [problem.readings.conditions[name][problem.rows] for name in columns]


def _in_order(problem: Problem, by: str, label: NDArray[np.str_], among: NDArray[np.bool_]) -> list[str]:
    """Return the names of a dimension's slices in the order of its axis."""
    names = [str(name) for name in np.unique(label[among])]
    if by == "family":
        return sorted(names, key=FAMILIES.index)
    column = np.nan_to_num(_column(problem, by), nan=np.inf)
    return sorted(names, key=lambda name: float(column[among & (label == name)].mean()))


def _places(problem: Problem, by: str, chosen: Sequence[NDArray[np.bool_]]) -> Array:
    if by == "hour":
        return np.array([float(_column(problem, by)[here].mean()) for here in chosen])
    columns = _columns(problem, by)
    if len(columns) == 2:
        return np.array([[float(column[here].mean()) for column in columns] for here in chosen])
    return np.arange(len(chosen), dtype=np.float64)
