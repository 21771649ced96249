"""Estimated shifts of the code values: a fast test for effects that round code values, before one of them is fitted.

A rounding has one setting for each table that may precede it; there are too many settings to fit all of them. To first
order a rounding shifts each code value, by the same amount in all channels at all hours. The information matrix of
these shifts is computed once; each setting then costs one product of vectors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.linear import Term
from lutgen.effects.declare import Effect
from lutgen.effects.scene import SOON_H

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem
    from lutgen.effects import Scene

#: Step of a code value for a numerical derivative, towards black.
STEP = 1e-4

#: Largest number of code values whose shifts are estimated: those with the most information.
MOST = 150

#: Number of Legendre polynomials of a smooth function of the code value. A rounding is not smooth.
SMOOTH = 7

#: Directions of the shifts with less information than this, in units of the largest information, are undetermined.
DETERMINED = 1e-9

#: Shifts are jagged if they gain more χ² than a smooth function by this number of standard deviations of chance.
BEYOND_CHANCE = 3.0

#: Largest shift of one code value in units of the root mean square of the others. A rounding shifts no code value by
#: more than half a step, which is 1.7 times the root mean square; noise and tables of unknown slopes give up to 6.5.
LARGEST = 8.0

#: Number of proposed settings that are fitted.
FITTED = 24


@dataclass(frozen=True)
class CodeShifts:
    """Information of the readings on the shift of each code value.

    Attributes
    ----------
    code
        Code values, (m,), without 0 and 1.
    information
        Information matrix of the shifts, tips and admitted effects marginalised, (m, m).
    pull
        Information matrix times the shifts that fit the residuals best, (m,).
    scatter
        Variance of all residuals in units of their noise, at least 1.

    """

    code: Array
    information: Array
    pull: Array
    scatter: float = 1.0

    @classmethod
    def of(
        cls, problem: Problem, changed: Callable[[Term], Array], project: Callable[[Array], Array], residual: Array
    ) -> CodeShifts:
        """Compute the information matrix and the pull.

        Parameters
        ----------
        problem
            The readings.
        changed
            Function that returns the whitened change of the readings, (n, 3), by one more term.
        project
            Function that returns the parts of whitened changes (m, n, 3) that the fit's unknowns cannot absorb, (m, r).
        residual
            The part of the residuals that the fit's unknowns cannot absorb, (r,).

        """
        drive = np.round(problem.drive, 9)
        slope = np.array([changed(shift_of(problem, channel)) for channel in range(3)]) / -STEP
        values = np.unique(drive[(drive > 0.0) & (drive < 1.0)])
        columns = [np.einsum("cni,nc->ni", slope, (drive == value).astype(float)) for value in values]
        strength = np.array([np.vdot(column, column) for column in columns])
        kept = np.sort(np.argsort(-strength, kind="stable")[:MOST])
        if not kept.size:
            return cls(values, np.zeros((0, 0)), np.zeros(0))
        matrix = project(np.array([columns[index] for index in kept]))
        scatter = max(float(residual @ residual) / (3 * problem.rows.size), 1.0)
        return cls(values[kept], matrix @ matrix.T, matrix @ residual, scatter)

    @cached_property
    def most(self) -> float:
        """Largest gain in χ² that a rounding can have, beyond chance and a smooth function of the code value."""
        gain, freedom = self._jagged
        beyond = max(gain - freedom, 0.0)
        return beyond + BEYOND_CHANCE * float(np.sqrt(2.0 * freedom + 4.0 * beyond)) if freedom > 0 else 0.0

    @property
    def is_jagged(self) -> bool:
        """Whether the shifts gain more χ² than chance and a smooth function of the code value."""
        gain, freedom = self._jagged
        return freedom > 0 and bool(gain / self.scatter > freedom + BEYOND_CHANCE * np.sqrt(2.0 * freedom))

    @cached_property
    def are_of_one_step(self) -> bool:
        """Whether no shift is certainly (2 σ) too large for a rounding, beside the other shifts."""
        variances = np.linalg.pinv(self.information, rcond=DETERMINED, hermitian=True)
        shifts, deviations = variances @ self.pull, np.sqrt(np.maximum(np.diag(variances), 0.0))
        weights = np.diag(self.information)
        squares = weights * shifts**2
        others = np.maximum(squares.sum() - squares, 0.0) / np.maximum(weights.sum() - weights, 1e-300)
        return bool((np.abs(shifts) - 2.0 * deviations <= LARGEST * np.sqrt(others)).all())

    @cached_property
    def _jagged(self) -> tuple[float, int]:
        """Gain in χ² of free shifts over a smooth function of the code value, and its degrees of freedom."""
        if self.code.size <= SMOOTH:
            return 0.0, 0
        smooth = np.polynomial.legendre.legvander(2.0 * self.code - 1.0, SMOOTH - 1)
        total, rank = _gain(self.information, self.pull)
        smooth_gain, smooth_rank = _gain(smooth.T @ self.information @ smooth, smooth.T @ self.pull)
        return total - smooth_gain, rank - smooth_rank


def _gain(information: Array, pull: Array) -> tuple[float, int]:
    """Gain in χ² of the best shifts, and the rank of their information matrix."""
    values, vectors = np.linalg.eigh(information)
    determined = values > DETERMINED * max(float(values.max()), 1e-300)
    return float(((vectors[:, determined].T @ pull) ** 2 / values[determined]).sum()), int(determined.sum())


def _shift(code: Array, _scene: Scene, /, **channel: float) -> Array:
    """Shift the code values of one channel by a step towards black."""
    moved = np.array(code)
    moved[..., int(channel["channel"])] -= STEP
    return moved


def _shift_later(code: Array, scene: Scene, /, **channel: float) -> Array:
    """Shift the code values of one channel after the first session, to which a native display is fitted."""
    return np.where(scene.hours >= SOON_H, _shift(code, scene, **channel), code)


_ALWAYS, _LATER = (Effect("shifted-codes", "drive", {}, {}, ((),), moved) for moved in (_shift, _shift_later))


def shift_of(problem: Problem, channel: int) -> Term:
    """Term that shifts a channel's code values by ``STEP`` towards black; native: after the first session only."""
    return Term(_ALWAYS if problem.native is None else _LATER, {"channel": float(channel)})
