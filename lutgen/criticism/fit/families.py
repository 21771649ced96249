"""Kinds of readings: by colour family, and by the condition that is away from rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.criticism.fit.data import FitData


def family_of(problem: FitData) -> NDArray[np.str_]:
    """Colour family of each reading, (n,): tips, black, grey, red, green, blue, secondary, mixture, lens cap."""
    drive = problem.drive
    red, green, blue = (drive > 0).T
    lit = red.astype(int) + green + blue
    top = drive.max(axis=1)
    full = ((drive == 0) | (drive == 1)).all(axis=1)
    is_grey = np.ptp(drive, axis=1) == 0
    is_secondary = (lit == 2) & (np.ptp(np.sort(drive, axis=1)[:, 1:], axis=1) == 0)
    names = np.select(
        [
            problem.is_capped,
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


def condition_of(problem: FitData) -> NDArray[np.str_]:
    """Cell name of the first condition that is away from rest at each reading, or '', (n,)."""
    named = np.full(problem.rows.size, "", dtype="<U16")
    for cell, away in reversed(list(problem.readings.rest.away.items())):
        named[away[problem.rows]] = cell
    return named


def kind_of(problem: FitData) -> NDArray[np.str_]:
    """Kind of each reading, (n,): the cell name of the condition that is away from rest, or the colour family."""
    condition = condition_of(problem)
    return np.where(condition == "", family_of(problem), condition)
