"""Groups of readings: by hour, level, colour family, position and condition."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from lutgen.readings.conditions import CONDITIONS
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lutgen.criticism.fit.problem import Problem
    from lutgen.readings.conditions import Condition

#: Limits of the bands of the largest code value, in which errors by level are reported.
LEVELS = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)


def family_of(problem: Problem) -> NDArray[np.str_]:
    """Colour family of each reading, (n,): tips, black, grey, red, green, blue, secondary, mixture, lens cap."""
    drive = problem.readings.drive[problem.rows]
    red, green, blue = (drive > 0).T
    lit = red.astype(int) + green + blue
    top = drive.max(axis=1)
    full = ((drive == 0) | (drive == 1)).all(axis=1)
    is_grey = np.ptp(drive, axis=1) == 0
    is_secondary = (lit == 2) & (np.ptp(np.sort(drive, axis=1)[:, 1:], axis=1) == 0)
    names = np.select(
        [
            is_capped(problem.readings)[problem.rows],
            top == 0,
            full & ((lit == 1) | (lit == 3)),
            is_grey,
            (lit == 1) & red,
            (lit == 1) & green,
            (lit == 1) & blue,
            is_secondary,
        ],
        ["lens cap", "black", "colour points", "grey", "red ramp", "green ramp", "blue ramp", "secondary"],
        "mixture",
    )
    return np.asarray(names)


def condition_of(problem: Problem) -> NDArray[np.str_]:
    """Cell name of the first condition that is away from rest at each reading, or '', (n,)."""
    named = np.full(problem.rows.size, "", dtype="<U16")
    for cell, away in reversed(list(problem.readings.rest.away.items())):
        named[away[problem.rows]] = cell
    return named


def kind_of(problem: Problem) -> NDArray[np.str_]:
    """Kind of each reading, (n,): the cell name of the condition that is away from rest, or the colour family."""
    condition = condition_of(problem)
    return np.where(condition == "", family_of(problem), condition)


def slices(problem: Problem) -> Mapping[str, NDArray[np.str_]]:
    """Label every reading for each dimension in which errors are reported: dimension → labels (n,); '': left out.

    For a condition, only comparable readings are labelled: those of patches that were also read with this condition,
    and no other condition, away from rest.
    """
    hours = np.array([f"{hour:g} h" for hour in problem.hours])[problem.hour_of]
    top = problem.readings.drive[problem.rows].max(axis=1)
    band = np.clip(np.searchsorted(LEVELS, top, side="left"), 0, len(LEVELS) - 1)
    level = np.array(["0", *(f"{low:g}–{high:g}" for low, high in pairwise(LEVELS))])[band]
    labels: dict[str, NDArray[np.str_]] = {"hour": hours, "level": level, "family": family_of(problem)}
    patch = np.unique(problem.readings.drive[problem.rows], axis=0, return_inverse=True)[1].reshape(-1)
    for condition in CONDITIONS:
        names = [column.name for column in condition.columns]
        if condition.heading and any(name in problem.readings.conditions for name in names):
            comparable = _comparable(problem, condition, patch)
            values = np.column_stack([problem.readings.column(name)[problem.rows] for name in names])
            cells, cell = np.unique(values, axis=0, return_inverse=True)
            names_of_cells = np.array([condition.label(*each) for each in cells])[cell.reshape(-1)]
            labels[condition.key] = np.where(comparable, names_of_cells, "")
    return {by: label for by, label in labels.items() if np.unique(label[label != ""]).size > 1}


def _comparable(problem: Problem, condition: Condition, patch: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Whether a reading is away from rest by this condition alone, or at rest and of the same patch: (n,).

    ``patch`` numbers the patches, (n,). Anchors are left out of the readings at rest. If no patch was read both ways,
    only the readings away from rest count.
    """
    others = [
        away[problem.rows] for cell, away in problem.readings.rest.away.items() if cell not in _related_cells(condition)
    ]
    eligible = ~np.any(others, axis=0) if others else np.ones(problem.rows.size, dtype=bool)
    eligible &= ~is_capped(problem.readings)[problem.rows]
    away = problem.readings.rest.away[condition.cell][problem.rows]
    read_away, read_at_rest = patch[eligible & away], patch[eligible & ~away & ~problem.is_anchor]
    common = np.intersect1d(read_away, read_at_rest)
    return np.asarray(eligible & (np.isin(patch, common) if common.size else away))


def _related_cells(condition: Condition) -> set[str]:
    """Cells of the conditions that vary with this condition, for example a window and its surround."""
    return {each.cell for each in CONDITIONS if each.depends == condition.depends}
