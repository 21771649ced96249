"""Held-out confirmation: whether an effect predicts readings that it was not fitted to.

Readings are withheld in cells that belong together, one colour family of one hour at a time, never at random: readings
of a cell share what is wrong with them. The tips of the hour stay known. Each cell is predicted from all others by one
Gauss-Newton step from the full fit, which is exact where the model is linear and near it for small effects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.families import condition_of, family_of
from lutgen.criticism.linear import State
from lutgen.criticism.system import Block, System, bounded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit import Fit
    from lutgen.criticism.problem import Problem


#: Fewer cells, or sessions, than this do not tell the error of their mean gain.
FEW_CELLS, FEW_SESSIONS = 20, 6


@dataclass(frozen=True)
class HeldOut:
    """Squared whitened error of every withheld cell, (cells,), the numbers withheld, and from how many hours."""

    squares: Array
    numbers: int
    sessions: int

    @property
    def rms_sigma(self) -> float:
        """Root mean square in σ; 0 when nothing could be withheld."""
        return float(np.sqrt(self.squares.sum() / self.numbers)) if self.numbers else 0.0

    def gain_over(self, other: HeldOut) -> tuple[float, float]:
        """Return by how much this predicts better than another, in χ², and the standard error of that."""
        gain = other.squares - self.squares
        if gain.size < 2:
            return 0.0, np.inf
        total, spread = float(gain.sum()), float(np.sqrt(gain.size) * gain.std(ddof=1))
        if gain.size < FEW_CELLS or self.sessions < FEW_SESSIONS:
            # An effect that shows in one cell of a session, in a few sessions, cannot tell by its spread. Where the
            # better model is true, the gain is the squared distance of the predictions, ± twice its root.
            return total, min(spread, 2.0 * float(np.sqrt(max(abs(total), 1.0))))
        return total, spread


def cells(problem: Problem) -> list[NDArray[np.intp]]:
    """Readings to withhold together: a colour family, or a condition, of one hour.

    What the prediction starts from is never withheld: tips at rest, and what a native display is made of.
    """
    family, condition = family_of(problem), condition_of(problem)
    named = np.where(condition == "", family, condition)
    kept = (named == "tips") | problem.curve_points
    found = []
    for hour in range(problem.hours.size):
        here = (problem.hour_of == hour) & ~kept
        found += [np.flatnonzero(here & (named == name)) for name in np.unique(named[here])]
    return found


def held_out(found: Fit) -> HeldOut:
    """Withhold cell after cell and predict it from the rest."""
    problem = found.problem
    state = State(found.terms, found.tips, found.gains)
    system = System(problem, found.linear, state)
    whole = [block.reduced for block in system.blocks]
    number = np.empty(problem.rows.size, dtype=np.intp)
    for index, here in enumerate(problem.blocks):
        number[here] = index
    limits = system.limits(found.terms)
    if problem.baseline == "fresh":
        return _sessions_held_out(problem, system, limits)
    withheld = cells(problem)
    squares = []
    for cell in withheld:
        index = int(number[cell[0]])
        block = Block.of(problem, found.linear, state, problem.blocks[index], without=cell)
        others = [*whole[:index], block.reduced, *whole[index + 1 :]]
        step = _step(np.concatenate(others), limits)
        squares.append(_error(found, block, cell, step))
    hours = np.unique([problem.hour_of[cell[0]] for cell in withheld]).size
    return HeldOut(np.array(squares), 3 * sum(cell.size for cell in withheld), hours)


def _sessions_held_out(problem: Problem, system: System, limits: tuple[Array, Array]) -> HeldOut:
    """Withhold whole sessions: what is told from hour 0 must foretell them, but for a gain within its σ.

    The sessions of hour 0 are what everything is told from: they stay.
    """
    later = [index for index, here in enumerate(problem.blocks) if problem.hour_of[here[0]] > 0]
    squares = []
    for index in later:
        others = [block.reduced for place, block in enumerate(system.blocks) if place != index]
        step, block = _step(np.concatenate(others), limits), system.blocks[index]
        squares.append(float(((block.reduced[:, -1] - block.reduced[:, :-1] @ step) ** 2).sum()))
    return HeldOut(np.array(squares), 3 * sum(problem.blocks[index].size for index in later), len(later))


def _step(reduced: Array, limits: tuple[Array, Array]) -> Array:
    return bounded(reduced[:, :-1], reduced[:, -1], *limits).parameters


def _error(found: Fit, block: Block, cell: NDArray[np.intp], step: Array) -> float:
    """Squared whitened error of a cell's readings after a step of all unknowns."""
    linear, tips = found.linear, 12 if block.tips_of is not None else 0
    columns = [*range(tips), *(tips + gain for gain in block.gains)]
    left = linear.residual[cell].ravel()
    if columns:
        left = left - block.local_step(step) @ linear.local[columns][:, cell].reshape(len(columns), -1)
    if step.size:
        left = left - step @ linear.free[:, cell].reshape(step.size, -1)
    return float(left @ left)
