"""The part of changes of the readings that the local unknowns of a fit cannot absorb: tips, gains, shared errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.data import readings_at
from lutgen.criticism.fit.local_unknowns import local_basis, prior_rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.first_session.errors import FirstErrors
    from lutgen.criticism.fit.linear import Linear, State
    from lutgen.criticism.fit.problem import Problem


@dataclass(frozen=True)
class Part:
    """The rows of one block: three for each of its readings ``here``, then one for each prior of its local unknowns.

    ``at``: the same readings, as a slice if they are consecutive. ``basis`` (rows, l): orthonormal basis of the changes
    by local unknowns. ``off``: right sides of the priors. ``rows``: the place of the block's rows among those of all
    blocks.
    """

    here: NDArray[np.intp]
    at: NDArray[np.intp] | slice
    basis: Array
    off: Array
    rows: slice


class Projection:
    """Projects whitened changes of all readings to rows without what the local unknowns absorb.

    Attributes
    ----------
    parts
        One part for each block of the problem.
    free, residual
        Rows of the global unknowns, (p, rows), and of the residual, (rows,).

    """

    def __init__(
        self, problem: Problem, linear: Linear, state: State, whitened: Array, first_errors: FirstErrors | None
    ) -> None:
        """Project the derivatives ``linear`` of a fit at its ``state``, and its ``whitened`` residual, (n, 3)."""
        self._first_errors, start = first_errors, 0
        self.parts = []
        for here in problem.blocks:
            first = int(here[0])
            basis = local_basis(problem, linear.local, state, here)
            hour, shared = int(problem.hour_of[first]), len(problem.shared[first])
            off = prior_rows(problem, state, hour, problem.gains_of[first], shared)[1]
            self.parts.append(Part(here, readings_at(here), basis, off, slice(start, start + len(basis))))
            start += len(basis)
        self._count = start
        # The residual contains the shared errors of sessions; the priors state that large errors are unlikely.
        self.free, self.residual = self.of(linear.free), self.of(whitened, priors=True)

    @cached_property
    def factors(self) -> tuple[Array, Array]:
        """Orthonormal columns that span the rows of the global unknowns, (rows, p), and these rows in them, (p, p)."""
        q, r = np.linalg.qr(self.free.T)
        return q, r

    def of(self, columns: Array, *, priors: bool = False) -> Array:
        """Project columns (..., n, 3) to rows (..., rows); ``priors``: with the right sides of the priors."""
        sizes = np.zeros((*columns.shape[:-2], 0))
        if self._first_errors:
            columns, sizes = self._first_errors.subtracted_from(columns)
        rows = np.empty((*columns.shape[:-2], self._count + sizes.shape[-1]))
        for part in self.parts:
            place, readings = rows[..., part.rows], 3 * part.here.size
            place[..., :readings] = columns[..., part.at, :].reshape(*columns.shape[:-2], readings)
            place[..., readings:] = part.off if priors else 0.0
            place -= (place @ part.basis) @ part.basis.T
        rows[..., self._count :] = -sizes
        return rows
