"""Slices: groups of readings by hour, level, colour family or condition, their errors, and which errors are large."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.families import family_of
from lutgen.readings.conditions import CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lutgen.criticism.fit.problem import Problem
    from lutgen.readings.conditions import Condition

#: A slice stands out if its error over noise exceeds 1 by this many standard deviations of that ratio ...
NOTICED = 4.0

#: ... and if it exceeds the ratio of all slices of the same dimension by this factor. Slices of a condition are
#: compared only with each other, because they hold the same patches.
BEYOND = 1.1

#: Limits of the bands of the largest code value, in which errors by level are reported.
LEVELS = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)

#: Dimensions to which every reading belongs; other dimensions are conditions.
OF_EVERY_READING = ("hour", "level", "family")


@dataclass(frozen=True)
class Errors:
    """Size of residuals: ΔE2000 (reference white: white of hour 0), and root mean square in σ of the noise."""

    delta_e_mean: float
    delta_e_p95: float
    delta_e_max: float
    rms_sigma: float


@dataclass(frozen=True)
class Slice:
    """Errors of readings that belong together.

    ``mean_residual_xyz`` is measured minus predicted in cd/m²; the floors are the errors that noise alone gives.
    """

    by: str
    slice: str
    n: int
    delta_e_mean: float
    rms_sigma: float
    mean_residual_xyz: tuple[float, float, float]
    floor_delta_e_mean: float
    floor_rms_sigma: float


@dataclass(frozen=True)
class Reading:
    """One reading and its error."""

    line: int
    hour: float
    code: tuple[float, float, float]
    delta_e: float
    sigma: float


def labels_of(problem: Problem) -> Mapping[str, NDArray[np.str_]]:
    """Label every reading for each dimension in which errors are reported: dimension → labels (n,); '': left out.

    For a condition, only comparable readings are labelled: those of patches that were also read with this condition,
    and no other condition, away from rest.
    """
    hours = np.array([f"{hour:g} h" for hour in problem.hours])[problem.hour_of]
    top = problem.drive.max(axis=1)
    band = np.clip(np.searchsorted(LEVELS, top, side="left"), 0, len(LEVELS) - 1)
    level = np.array(["0", *(f"{low:g}–{high:g}" for low, high in pairwise(LEVELS))])[band]
    labels: dict[str, NDArray[np.str_]] = {"hour": hours, "level": level, "family": family_of(problem)}
    patch = np.unique(problem.drive, axis=0, return_inverse=True)[1].reshape(-1)
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
    eligible &= ~problem.is_capped
    away = problem.readings.rest.away[condition.cell][problem.rows]
    read_away, read_at_rest = patch[eligible & away], patch[eligible & ~away & ~problem.is_anchor]
    common = np.intersect1d(read_away, read_at_rest)
    return np.asarray(eligible & (np.isin(patch, common) if common.size else away))


def _related_cells(condition: Condition) -> set[str]:
    """Cells of the conditions that vary with this condition, for example a window and its surround."""
    return {each.cell for each in CONDITIONS if each.depends == condition.depends}


def standing_out(where: Sequence[Slice]) -> list[Slice]:
    """Return the slices with errors above the noise and above those of other slices, the most prominent first."""
    usual = _usual(where)
    prominent = [
        each for each in where if over_noise(each) > max(1.0 + NOTICED / (6 * each.n) ** 0.5, BEYOND * usual[each.by])
    ]
    return sorted(prominent, key=prominence, reverse=True)


def prominence(each: Slice) -> float:
    """Return the excess error of a slice, weighted by the root of its number of readings."""
    return float((each.rms_sigma**2 - each.floor_rms_sigma**2) * each.n**0.5)


def informative(where: Sequence[Slice]) -> list[Slice]:
    """Return the slices that can locate the error: a slice of a condition only if its error exceeds the usual."""
    usual = _usual(where)
    return [each for each in where if each.by in OF_EVERY_READING or over_noise(each) > BEYOND * usual[each.by]]


def _usual(where: Sequence[Slice]) -> dict[str, float]:
    """Return the error over noise of each dimension."""
    return {by: _together([each for each in where if each.by == by]) for by in {each.by for each in where}}


def _together(slices: Sequence[Slice]) -> float:
    """Return the error over noise of all slices of one dimension together."""
    error = sum(each.n * each.rms_sigma**2 for each in slices)
    floor = sum(each.n * each.floor_rms_sigma**2 for each in slices)
    return float((error / floor) ** 0.5) if floor else 0.0


def over_noise(each: Slice) -> float:
    """Return the error of a slice over that of noise alone, by root mean square."""
    return each.rms_sigma / each.floor_rms_sigma if each.floor_rms_sigma else 0.0
