"""Cross-validation: whether an effect predicts readings to which it was not fitted.

Readings are withheld by cell, one colour family of one hour at a time, and not at random, because the errors of the
readings of a cell are correlated. The readings of the tips stay. Each cell is predicted from all other cells by one
Gauss-Newton step from the full fit. The step is exact if the model is linear, and accurate for small effects. A cell
with nearly all the information on a parameter cannot be predicted from the rest: it is left out, and counted.
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


#: The χ² of held-out readings must fall by at least so many standard errors.
STANDARD_ERRORS = 2.0

#: Expected excess of the gain of a fit over the gain on held-out readings, per parameter.
OPTIMISM = 2.0

#: A cell with more than this share of the information on a parameter is not withheld.
NEARLY_ALL = 0.99


@dataclass(frozen=True)
class HeldOut:
    """Errors of withheld readings.

    Attributes
    ----------
    squares
        Squared whitened error of each cell, (cells,); NaN where the cell could not be withheld.
    numbers
        Number of values (three a reading) in each cell, (cells,).
    of_one_session
        Whether all cells are of the only session after hour 0. That session's gain then absorbs changes that all
        colours share, and the cells cannot confirm them.

    """

    squares: Array
    numbers: NDArray[np.intp]
    of_one_session: bool = False

    @property
    def rms_sigma(self) -> float:
        """Root mean square error in σ; 0 if no cell could be withheld."""
        kept = np.isfinite(self.squares)
        return float(np.sqrt(self.squares[kept].sum() / self.numbers[kept].sum())) if kept.any() else 0.0

    @property
    def left_out(self) -> int:
        """Number of cells that could not be withheld, because they have nearly all information on a parameter."""
        return int(np.isnan(self.squares).sum())

    @property
    def may_miss(self) -> bool:
        """Whether the test may miss a real effect, because some cells could not be withheld or confirm nothing."""
        return self.of_one_session or self.left_out > 0

    def gain_over(self, other: HeldOut) -> tuple[float, float]:
        """Return the fall of held-out χ² from ``other`` to this, and the standard error of that fall.

        Only cells that both could withhold are compared.
        """
        gain = other.squares - self.squares
        gain = gain[np.isfinite(gain)]
        if gain.size < 2:
            return 0.0, np.inf
        total, spread = float(gain.sum()), float(np.sqrt(gain.size) * gain.std(ddof=1))
        # An effect that shows in a few cells gives a large spread. If the better model is true, the gain is the squared
        # distance of the predictions, with a standard error of twice the root of that.
        return total, min(spread, 2.0 * float(np.sqrt(max(abs(total), 1.0))))


def confirmed_gain() -> float:
    """Return the smallest gain of a fit in χ² with which held-out readings confirm an effect of one parameter.

    The held-out gain g has a standard error of 2√g if the effect is true (:meth:`HeldOut.gain_over`).
    """
    return (2.0 * STANDARD_ERRORS) ** 2 + OPTIMISM


def cells(problem: Problem) -> list[NDArray[np.intp]]:
    """Indices of the readings to withhold together: those of one colour family, or one condition, of one hour.

    Anchors are never withheld: tips at rest, and the readings that a native display is made from.
    """
    kinds = kind_of(problem)
    anchored = problem.is_anchor
    groups = []
    for hour in range(problem.hours.size):
        here = (problem.hour_of == hour) & ~anchored
        groups += [np.flatnonzero(here & (kinds == name)) for name in np.unique(kinds[here])]
    return groups


def held_out_gain(fitted: Fit, base: Fit) -> float:
    """Fall of the χ² of withheld readings from the fit ``base`` to the fit ``fitted``.

    If only one session, or none, can be withheld as a whole, cells are withheld instead.
    """
    if fitted.withheld.squares.size - fitted.withheld.left_out > 1:
        return fitted.withheld.gain_over(base.withheld)[0]
    return held_out(fitted, by_cells=True).gain_over(held_out(base, by_cells=True))[0]


def held_out(fitted: Fit, *, by_cells: bool = False) -> HeldOut:
    """Withhold each cell in turn and predict it from the rest; under ``from_first_hour`` each later session in turn.

    A single later session has all information on the aging and could not be predicted from the rest: its cells are
    withheld instead. ``by_cells``: withhold cells in any case.
    """
    problem = fitted.problem
    state = State(fitted.terms, fitted.tips, fitted.gains)
    system = System(problem, fitted.linear, state)
    whole = [block.reduced for block in system.blocks]
    block_of = np.empty(problem.rows.size, dtype=np.intp)
    for index, here in enumerate(problem.blocks):
        block_of[here] = index
    limits = system.limits(fitted.terms)
    later = [index for index, here in enumerate(problem.blocks) if problem.hour_of[here[0]] > 0]
    if problem.from_first_hour and len(later) > 1 and not by_cells:
        return _sessions_held_out(problem, system, limits, later)
    withheld = cells(problem)
    squares = []
    whole_information = _information(np.concatenate([*whole, system.rest]), system.effect_count)
    for cell in withheld:
        index = int(block_of[cell[0]])
        block = Block.without(problem, system.corrected, state, problem.blocks[index], cell)
        others = [*whole[:index], block.reduced, *whole[index + 1 :], system.rest]
        rows = np.concatenate(others)
        is_needed = _information(rows, system.effect_count) < (1.0 - NEARLY_ALL) * whole_information
        step = None if is_needed.any() else _step(rows, limits)
        squares.append(np.nan if step is None else _error(system, block, problem.blocks[index], cell, step))
    numbers = np.array([3 * cell.size for cell in withheld], dtype=np.intp)
    return HeldOut(np.array(squares), numbers, of_one_session=problem.from_first_hour and len(later) < 2)


def _information(reduced: Array, count: int) -> Array:
    """Information of reduced rows on each of the first ``count`` unknowns, 1/σ², the others marginalised: (count,)."""
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
    """Withhold each of the ``later`` sessions and predict it from the others; its gain is free, with its prior.

    The sessions of hour 0 are never withheld: every prediction starts from them.
    """
    squares = []
    whole = [block.reduced for block in system.blocks]
    whole_information = _information(np.concatenate([*whole, system.rest]), system.effect_count)
    for index in later:
        rows = np.concatenate([*whole[:index], *whole[index + 1 :], system.rest])
        if (_information(rows, system.effect_count) < (1.0 - NEARLY_ALL) * whole_information).any():
            squares.append(np.nan)
            continue
        step, block = _step(rows, limits), system.blocks[index]
        squares.append(float(((block.reduced[:, -1] - block.reduced[:, :-1] @ step) ** 2).sum()))
    numbers = np.array([3 * problem.blocks[index].size for index in later], dtype=np.intp)
    return HeldOut(np.array(squares), numbers)


def _step(reduced: Array, limits: tuple[Array, Array]) -> Array:
    return bounded(reduced[:, :-1], reduced[:, -1], *limits).parameters


def _error(system: System, block: Block, whole: NDArray[np.intp], cell: NDArray[np.intp], step: Array) -> float:
    """Squared whitened error of the readings of a cell after a step of all unknowns."""
    linear = system.corrected
    columns, _ = local_columns(system.problem, linear.local, whole, cell)
    residual = linear.residual[cell].ravel()
    if len(columns):
        residual = residual - block.local_step(step) @ columns.reshape(len(columns), -1)
    if step.size:
        residual = residual - step @ linear.free[:, cell].reshape(step.size, -1)
    return float(residual @ residual)
