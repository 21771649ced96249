"""Errors of the first session, which propagate to all later readings that a fit predicts from it.

Later readings of a colour share the error of the first session's reading of that colour. All later readings share the
errors of the first session's white, primaries and dark offset. These errors are unknowns with a prior, whose σ is the
noise of the instrument: a fit estimates them, and χ² includes their squares in units of σ. So a residual that all
readings of a colour share has a lower weight, and a change from hour to hour keeps its full weight.

The local unknowns of a block (tips, gains and shared errors) can absorb part of these errors. :meth:`FirstErrors.of`
removes this part with the derivatives at the measured tips, because the latent tips hardly differ from the measured
tips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # its parts load when they are first used: native displays alone need sparse columns

from lutgen.criticism.fit.linear import State, linearise
from lutgen.criticism.fit.local_unknowns import local_basis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem


@dataclass(frozen=True)
class FirstErrors:
    """Errors of the first session, e unknowns that all blocks share.

    ``columns`` (3n, e): change of the whitened readings by 1 σ of each error. ``blocks``: the readings of each block,
    and a basis of the changes by its local unknowns, (3m, l). ``inverse`` (e, e): posterior covariance of the errors in
    units of their prior σ.
    """

    columns: Any
    blocks: tuple[tuple[NDArray[np.intp], Array], ...]
    inverse: Array

    @classmethod
    def of(cls, problem: Problem) -> FirstErrors | None:
        """Make the errors of a problem; None if no prediction depends on errors of the first session."""
        if problem.native is None:
            return None
        whitened = np.einsum("nij,enj->eni", problem.whitener, problem.first_session_model.errors)
        if not len(whitened):
            return None
        state = State((), problem.measured_tips, np.zeros(problem.gain_count))
        local = linearise(problem, state).local
        bases = [local_basis(problem, local, state, here)[: 3 * here.size] for here in problem.blocks]
        blocks = tuple(zip(problem.blocks, bases, strict=True))
        columns = scipy.sparse.csr_array(whitened.reshape(len(whitened), -1).T)
        unabsorbed = _outside(blocks, whitened).reshape(len(whitened), -1)
        return cls(columns, blocks, np.linalg.inv(np.eye(len(unabsorbed)) + unabsorbed @ columns))

    def subtracted_from(self, white: Array) -> tuple[Array, Array]:
        """Subtract the most likely errors, of sizes (..., e), from whitened residuals or signatures (..., n, 3)."""
        flat = white.reshape(-1, *white.shape[-2:])
        projections = _outside(self.blocks, flat).reshape(len(flat), self.columns.shape[0]) @ self.columns
        sizes = projections @ self.inverse
        residual = white - (self.columns @ sizes.T).T.reshape(white.shape)
        return residual, sizes.reshape(*white.shape[:-2], len(self.inverse))


def _outside(blocks: tuple[tuple[NDArray[np.intp], Array], ...], white: Array) -> Array:
    """Part of whitened columns (k, n, 3) that the local unknowns of blocks cannot absorb."""
    unabsorbed = white.copy()
    for here, basis in blocks:
        block = white[:, here].reshape(len(white), 3 * here.size)
        unabsorbed[:, here] -= (block @ basis @ basis.T).reshape(len(white), here.size, 3)
    return unabsorbed
