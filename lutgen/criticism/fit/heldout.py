"""Held-out confirmation: whether an effect predicts readings that it was not fitted to.

Readings are withheld in cells that belong together, one colour family of one hour at a time, never at random: readings
of a cell share what is wrong with them. The tips of the hour stay known. Each cell is predicted from all others by one
Gauss-Newton step from the full fit, which is exact where the model is linear and near it for small effects. A cell that
holds nearly all that the readings say of a parameter cannot be predicted from the rest: it is left out, and counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.families import kind_of
from lutgen.criticism.fit.linear import State
from lutgen.criticism.fit.system import Block, System, bounded, local_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem


#: Held-out readings must improve by this many standard errors.
STANDARD_ERRORS = 2.0

#: What one parameter adds to the gain of the fit that held-out readings do not see.
OPTIMISM = 2.0

#: A cell with more than this share of the information on a parameter is not withheld.
NEARLY_ALL = 0.99


@dataclass(frozen=True)
class HeldOut:
    """Errors of withheld readings.

    Attributes
    ----------
    squares
        Squared whitened error of every cell, (cells,); NaN where the cell could not be withheld.
    numbers
        Numbers withheld in each cell, (cells,).
    of_one_session
        Whether the cells are of the one session that tells what has changed since hour 0. What all colours share then
        hides in that session's gain, and cells cannot confirm it.

    """

    squares: Array
    numbers: NDArray[np.intp]
    of_one_session: bool = False

    @property
    def rms_sigma(self) -> float:
        """Root mean square in σ; 0 when nothing could be withheld."""
        kept = np.isfinite(self.squares)
        return float(np.sqrt(self.squares[kept].sum() / self.numbers[kept].sum())) if kept.any() else 0.0

    @property
    def left_out(self) -> int:
        """Number of cells that could not be withheld, since a parameter rests on them."""
        return int(np.isnan(self.squares).sum())

    @property
    def may_miss(self) -> bool:
        """Whether an effect may be there that withheld readings cannot confirm, since a parameter rests on some."""
        return self.of_one_session or self.left_out > 0

    def gain_over(self, other: HeldOut) -> tuple[float, float]:
        """Return by how much this predicts better than another, in χ², and the standard error of that.

        Only cells that both could withhold are compared.
        """
        gain = other.squares - self.squares
        gain = gain[np.isfinite(gain)]
        if gain.size < 2:
            return 0.0, np.inf
        total, spread = float(gain.sum()), float(np.sqrt(gain.size) * gain.std(ddof=1))
        # An effect that shows in a few cells cannot tell by their spread. Where the better model is true, the gain is
        # the squared distance of the predictions, ± twice its root.
        return total, min(spread, 2.0 * float(np.sqrt(max(abs(total), 1.0))))


def confirmed_gain() -> float:
    """Return the gain of a fit in χ² from which on held-out readings confirm an effect of one parameter.

    Their gain g has a standard error of 2√g where the effect is true (:meth:`HeldOut.gain_over`).
    """
    return (2.0 * STANDARD_ERRORS) ** 2 + OPTIMISM


def cells(problem: Problem) -> list[NDArray[np.intp]]:
    """Readings to withhold together: a colour family, or a condition, of one hour.

    What the prediction starts from is never withheld: tips at rest, and what a native display is made of.
    """
    named = kind_of(problem)
    kept = problem.is_anchor
    found = []
    for hour in range(problem.hours.size):
        here = (problem.hour_of == hour) & ~kept
        found += [np.flatnonzero(here & (named == name)) for name in np.unique(named[here])]
    return found


def held_out_gain(found: Fit, base: Fit) -> float:
    """By how much χ² of withheld readings falls from one fit to another.

    One session that can be withheld as a whole, as the later one of two, says nothing: its cells are withheld then.
    """
    if found.withheld.squares.size - found.withheld.left_out > 1:
        return found.withheld.gain_over(base.withheld)[0]
    return held_out(found, by_cells=True).gain_over(held_out(base, by_cells=True))[0]


def held_out(found: Fit, *, by_cells: bool = False) -> HeldOut:
    """Withhold cell after cell and predict it from the rest; of what is told from hour 0, session after session.

    A single later session holds all that is told of the years: withheld as a whole it would confirm nothing, so that
    its cells are withheld. ``by_cells``: cells in any case.
    """
    problem = found.problem
    state = State(found.terms, found.tips, found.gains)
    system = System(problem, found.linear, state)
    whole = [block.reduced for block in system.blocks]
    number = np.empty(problem.rows.size, dtype=np.intp)
    for index, here in enumerate(problem.blocks):
        number[here] = index
    limits = system.limits(found.terms)
    later = [index for index, here in enumerate(problem.blocks) if problem.hour_of[here[0]] > 0]
    if problem.from_first_hour and len(later) > 1 and not by_cells:
        return _sessions_held_out(problem, system, limits, later)
    withheld = cells(problem)
    squares = []
    whole_information = _information(np.concatenate([*whole, system.rest]), system.effect_count)
    for cell in withheld:
        index = int(number[cell[0]])
        block = Block.without(problem, system.apart, state, problem.blocks[index], cell)
        others = [*whole[:index], block.reduced, *whole[index + 1 :], system.rest]
        rows = np.concatenate(others)
        rests_on = _information(rows, system.effect_count) < (1.0 - NEARLY_ALL) * whole_information
        step = None if rests_on.any() else _step(rows, limits)
        squares.append(np.nan if step is None else _error(system, block, problem.blocks[index], cell, step))
    numbers = np.array([3 * cell.size for cell in withheld], dtype=np.intp)
    return HeldOut(np.array(squares), numbers, of_one_session=problem.from_first_hour and len(later) < 2)


def _information(reduced: Array, count: int) -> Array:
    """What rows of a reduced system say of its first ``count`` unknowns, 1/σ² with the others free: (count,)."""
    if not count:
        return np.zeros(0)
    upper = np.linalg.qr(reduced[:, :-1], mode="r")
    size = np.linalg.norm(upper, axis=0)
    size = np.where(size > 0, size, 1.0)
    _, s, vt = np.linalg.svd(upper / size, full_matrices=False)
    if not s.any():
        return np.zeros(count)
    variance = ((vt.T / np.maximum(s, 1e-9 * s.max())) ** 2).sum(axis=1)[:count]
    return np.asarray(size[:count] ** 2 / variance)


def _sessions_held_out(problem: Problem, system: System, limits: tuple[Array, Array], later: Sequence[int]) -> HeldOut:
    """Withhold the ``later`` sessions: what is told from hour 0 must foretell them, but for a gain within its σ.

    The sessions of hour 0 are what everything is told from: they stay.
    """
    squares = []
    whole = [block.reduced for block in system.blocks]
    everything = _information(np.concatenate([*whole, system.rest]), system.effect_count)
    for index in later:
        rows = np.concatenate([*whole[:index], *whole[index + 1 :], system.rest])
        if (_information(rows, system.effect_count) < (1.0 - NEARLY_ALL) * everything).any():
            squares.append(np.nan)
            continue
        step, block = _step(rows, limits), system.blocks[index]
        squares.append(float(((block.reduced[:, -1] - block.reduced[:, :-1] @ step) ** 2).sum()))
    numbers = np.array([3 * problem.blocks[index].size for index in later], dtype=np.intp)
    return HeldOut(np.array(squares), numbers)


def _step(reduced: Array, limits: tuple[Array, Array]) -> Array:
    return bounded(reduced[:, :-1], reduced[:, -1], *limits).parameters


def _error(system: System, block: Block, whole: NDArray[np.intp], cell: NDArray[np.intp], step: Array) -> float:
    """Squared whitened error of a cell's readings after a step of all unknowns."""
    linear = system.apart
    columns, _ = local_columns(system.problem, linear.local, whole, cell)
    left = linear.residual[cell].ravel()
    if len(columns):
        left = left - block.local_step(step) @ columns.reshape(len(columns), -1)
    if step.size:
        left = left - step @ linear.free[:, cell].reshape(step.size, -1)
    return float(left @ left)
