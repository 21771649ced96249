"""Cross-validation: whether an effect predicts readings to which it was not fitted.

Readings are withheld by cell, one colour family of one hour (or of one session, if sessions have gains) at a time, and
not at random, because the errors of the readings of a cell are correlated. The readings of the tips are never withheld.
Each cell is predicted from all other cells by one Gauss-Newton step from the full fit. The step is exact if the model
is linear, and accurate for small effects. A cell with nearly all the information on a parameter cannot be predicted
from the rest: it is left out, and counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.families import kind_of
from lutgen.criticism.fit.system import SINGULAR, bounded, limits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.fit.projection import Projection


#: The χ² of held-out readings must fall by more than this number of standard errors.
STANDARD_ERRORS = 2.0

#: A cell with more than this share of the information on a parameter is not withheld.
NEARLY_ALL = 0.99


@dataclass(frozen=True)
class HeldOut:
    """Errors of withheld readings.

    Attributes
    ----------
    squares
        Squared whitened error of each cell, (cells,); NaN if the cell could not be withheld.
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
        """Number of cells that could not be withheld, because each has nearly all the information on a parameter."""
        return int(np.isnan(self.squares).sum())

    @property
    def may_miss(self) -> bool:
        """Whether the test may miss a real effect.

        True if some cells could not be withheld, or if all cells are of one session and cannot confirm a change that
        all colours share.
        """
        return self.of_one_session or self.left_out > 0

    def gain_over(self, other: HeldOut) -> tuple[float, float]:
        """Return the fall of held-out χ² from ``other`` to this, and the standard error of that fall.

        Only cells that were withheld in both fits count.
        """
        gain = self._gains_over(other)
        if gain.size < 2:
            return 0.0, np.inf
        total, spread = float(gain.sum()), float(np.sqrt(gain.size) * gain.std(ddof=1))
        # An effect that shows in a few cells gives a large spread. If the better model is true, the gain is the squared
        # distance of the predictions, and its standard error is twice that distance.
        return total, min(spread, 2.0 * float(np.sqrt(max(abs(total), 1.0))))

    def falls_without_best_cell(self, other: HeldOut) -> bool:
        """Whether held-out χ² falls from ``other`` to this even without the cell in which it falls most."""
        gain = self._gains_over(other)
        return gain.size > 1 and float(gain.sum() - gain.max()) > 0.0

    def _gains_over(self, other: HeldOut) -> Array:
        gain = other.squares - self.squares
        return np.asarray(gain[np.isfinite(gain)])


def cells(problem: Problem) -> list[NDArray[np.intp]]:
    """Indices of the readings to withhold together: those of one colour family, or one condition, of one block.

    Anchors are never withheld: tips at rest, and the readings that a native display is made from.
    """
    kinds = kind_of(problem)
    groups = []
    for block in problem.blocks:
        here = block[~problem.is_anchor[block]]
        groups += [here[kinds[here] == name] for name in np.unique(kinds[here])]
    return groups


def held_out(problem: Problem, terms: Sequence[Term], projection: Projection, *, by_cells: bool = False) -> HeldOut:
    """Withhold each cell in turn and predict it from the rest; under ``from_first_hour`` withhold each later session.

    A single later session has all information on the aging and could not be predicted from the rest: its cells are
    withheld instead. ``by_cells``: always withhold cells.
    """
    rest = _Rest(terms, projection)
    # The sessions of hour 0 are never withheld: every prediction starts from them.
    later = [part for part in projection.parts if problem.hour_of[part.here[0]] > 0]
    if problem.from_first_hour and len(later) > 1 and not by_cells:
        squares = [rest.error(part.rows, part.basis[:0]) for part in later]
        return HeldOut(np.array(squares), np.array([3 * part.here.size for part in later], dtype=np.intp))
    squares, withheld = [], cells(problem)
    for cell in withheld:
        part = next(each for each in projection.parts if cell[0] in each.here)
        places = (3 * np.searchsorted(part.here, cell)[:, np.newaxis] + np.arange(3)).ravel()
        squares.append(rest.error(part.rows.start + places, part.basis[places]))
    numbers = np.array([3 * cell.size for cell in withheld], dtype=np.intp)
    return HeldOut(np.array(squares), numbers, of_one_session=problem.from_first_hour and len(later) < 2)


class _Rest:
    """All rows of a fit, from which some rows at a time are withheld.

    The global unknowns have orthonormal columns here, so that their information without some rows is 1 minus the
    information of these rows (a downdate: Golub & Van Loan, Matrix Computations, 4th ed., 6.5.4).
    """

    def __init__(self, terms: Sequence[Term], projection: Projection) -> None:
        self.residual = projection.residual
        self.limits = limits(terms, len(projection.free))
        q, r = projection.factors
        size = np.linalg.norm(r, axis=0)
        size = np.where(size > 0, size, 1.0)
        u, s, vt = np.linalg.svd(r / size)
        kept = s > SINGULAR * s.max(initial=0.0)
        self.columns = q @ u[:, kept]
        self.right = self.columns.T @ self.residual
        #: Derivatives of the coordinates along the columns by the global unknowns, (k, p), and of the parameters of
        #: effects by these coordinates, (e, k).
        self.of_unknowns = (s[kept, np.newaxis] * vt[kept]) * size
        count = sum(len(term.free) for term in terms)
        self.effects = (vt[kept].T / s[kept] / size[:, np.newaxis])[:count]

    def error(self, rows: NDArray[np.intp] | slice, basis: Array) -> float:
        """Squared error of rows (m) that are predicted from all other rows; NaN if the other rows cannot predict them.

        ``basis``: the part of the local unknowns' basis in these rows, (m, l); (0, l) if a whole block is withheld.
        """
        withheld = np.column_stack([self.columns[rows], self.residual[rows]])
        without = withheld
        if len(basis):
            # If only the withheld rows determine a direction of the local unknowns, keep the value of the full fit in
            # this direction.
            left, directions = np.linalg.eigh(np.eye(basis.shape[1]) - basis.T @ basis)
            known = left > SINGULAR
            turned = basis @ directions[:, known]
            without = withheld + (turned / left[known]) @ (turned.T @ withheld)
        lost = withheld[:, :-1].T @ without
        information, directions = np.linalg.eigh(np.eye(len(lost)) - lost[:, :-1])
        information = np.maximum(information, SINGULAR**2)
        turned = self.effects @ directions
        if ((turned**2).sum(axis=1) < (1.0 - NEARLY_ALL) * (turned**2 / information).sum(axis=1)).any():
            return np.nan
        root = np.sqrt(information)
        right = directions.T @ (self.right - lost[:, -1]) / root
        step = bounded(root[:, np.newaxis] * (directions.T @ self.of_unknowns), right, *self.limits).parameters
        residual = without[:, -1] - without[:, :-1] @ (self.of_unknowns @ step)
        return float(residual @ residual)
