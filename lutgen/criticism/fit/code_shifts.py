"""How far each code value seems to be shifted: what the readings say of effects that round codes, before one is fitted.

A rounding has as many settings as there are tables in front of it, far too many to fit. But what it does to the light
is, to first order, a shift of each code value, the same in all channels at all hours. The readings' information on
those shifts is worked out once; after that a setting costs one product of vectors.
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

#: Step of a code value for a derivative, towards black.
STEP = 1e-4

#: Code values whose shifts are asked for at most: those of which the readings say most.
MOST = 150

#: A smooth curve of the code value of so many terms is no rounding.
SMOOTH = 7

#: Jagged is what gains more than a smooth curve of the code value by so many standard deviations of chance.
BEYOND_CHANCE = 3.0

#: Settings that are fitted of all that are proposed.
FITTED = 24


@dataclass(frozen=True)
class CodeShifts:
    """What readings say of the shift of each code value.

    Attributes
    ----------
    code
        Code values, (m,), without 0 and 1.
    information
        Of their shifts with the tips and all admitted effects free, (m, m).
    pull
        Product of that with the shifts that the residuals ask for, (m,).
    scatter
        Variance of all residuals in units of their noise, 1 at least.

    """

    code: Array
    information: Array
    pull: Array
    scatter: float = 1.0

    @classmethod
    def of(
        cls, problem: Problem, changed: Callable[[Term], Array], project: Callable[[Array], Array], residual: Array
    ) -> CodeShifts:
        """Work them out.

        Parameters
        ----------
        problem
            The readings.
        changed
            Whitened change of the readings (n, 3) by one more term.
        project
            What of such a change (n, 3) the fit's unknowns cannot absorb, (r,).
        residual
            The same of the residuals, (r,).

        """
        drive = np.round(problem.readings.drive[problem.rows], 9)
        slope = np.array([changed(shift_of(problem, channel)) for channel in range(3)]) / -STEP
        values = np.unique(drive[(drive > 0.0) & (drive < 1.0)])
        columns = [np.einsum("cni,nc->ni", slope, (drive == value).astype(float)) for value in values]
        strength = np.array([float((column**2).sum()) for column in columns])
        kept = np.sort(np.argsort(-strength, kind="stable")[:MOST])
        if not kept.size:
            return cls(values, np.zeros((0, 0)), np.zeros(0))
        matrix = np.array([project(columns[index]) for index in kept])
        scatter = max(float(residual @ residual) / (3 * problem.rows.size), 1.0)
        return cls(values[kept], matrix @ matrix.T, matrix @ residual, scatter)

    @cached_property
    def most(self) -> float:
        """Gain in χ² that a rounding can have at most: that of shifts beyond chance and a smooth curve of the code."""
        gain, freedom = self._jagged
        beyond = max(gain - freedom, 0.0)
        return beyond + BEYOND_CHANCE * float(np.sqrt(2.0 * freedom + 4.0 * beyond)) if freedom > 0 else 0.0

    @property
    def is_jagged(self) -> bool:
        """Whether the shifts gain more than chance and a smooth curve of the code value do."""
        gain, freedom = self._jagged
        return freedom > 0 and bool(gain / self.scatter > freedom + BEYOND_CHANCE * np.sqrt(2.0 * freedom))

    @cached_property
    def _jagged(self) -> tuple[float, int]:
        """What shifts of any size gain in χ² beside a smooth curve of the code value, and how many numbers they are."""
        if self.code.size <= SMOOTH:
            return 0.0, 0
        smooth = np.polynomial.legendre.legvander(2.0 * self.code - 1.0, SMOOTH - 1)
        everything, rank = _gain(self.information, self.pull)
        curve, terms = _gain(smooth.T @ self.information @ smooth, smooth.T @ self.pull)
        return everything - curve, rank - terms


def _gain(information: Array, pull: Array) -> tuple[float, int]:
    values, vectors = np.linalg.eigh(information)
    seen = values > 1e-9 * max(float(values.max()), 1e-300)
    return float(((vectors[:, seen].T @ pull) ** 2 / values[seen]).sum()), int(seen.sum())


def _shift(code: Array, _scene: Scene, /, **channel: float) -> Array:
    """Shift one channel's code values by a step towards black."""
    moved = np.array(code)
    moved[..., int(channel["channel"])] -= STEP
    return moved


def _shift_soon(code: Array, scene: Scene, /, **channel: float) -> Array:
    """Shift them after the first session, which a display's own model contains."""
    return np.where(scene.hours >= SOON_H, _shift(code, scene, **channel), code)


_ALWAYS, _SOON = (Effect("shifted-codes", "drive", {}, {}, ((),), moved) for moved in (_shift, _shift_soon))


def shift_of(problem: Problem, channel: int) -> Term:
    """Shift of all code values of a channel by ``STEP`` towards black; of a native display after its first session."""
    return Term(_ALWAYS if problem.native is None else _SOON, {"channel": float(channel)})
