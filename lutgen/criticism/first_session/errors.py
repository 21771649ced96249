"""What is wrong in the first session is wrong in all later readings that a fit foretells from it.

Readings of a colour share the errors of the first session's reading of that colour, and all of them those of its white
and primaries and of its dark offset. Such errors are unknowns, of which an instrument's noise tells the size: a fit
finds the likeliest ones, and χ² has their squares in units of σ. So what readings of a colour have in common counts for
less, and what grows from hour to hour counts in full.

The unknowns of a block (its tips, gains and shared errors) can do part of what they do; :meth:`FirstErrors.of` takes
that out with the derivatives at the measured tips, from which latent ones hardly differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # its parts load when they are first used: native displays alone need sparse columns

from lutgen.criticism.fit.linear import State, linearise
from lutgen.criticism.fit.system import local_basis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem


@dataclass(frozen=True)
class FirstErrors:
    """Errors of the first session as unknowns (e) that all blocks share.

    ``columns`` (3n, e) is what each does to the whitened readings at one standard deviation, ``blocks`` are the
    readings of each block and what its unknowns can do to them, (3m, l); ``inverse`` (e, e) is the covariance of the
    errors once the readings are known.
    """

    columns: Any
    blocks: tuple[tuple[NDArray[np.intp], Array], ...]
    inverse: Array

    @classmethod
    def of(cls, problem: Problem) -> FirstErrors | None:
        """Take a problem's; None where nothing is foretold from a first session's readings."""
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
        left = _outside(blocks, whitened).reshape(len(whitened), -1)
        return cls(columns, blocks, np.linalg.inv(np.eye(len(left)) + left @ columns))

    def taken_from(self, white: Array) -> tuple[Array, Array]:
        """Take the likeliest errors out of whitened residuals or signatures (..., n, 3); also their sizes (..., e)."""
        flat = white.reshape(-1, *white.shape[-2:])
        told = _outside(self.blocks, flat).reshape(len(flat), self.columns.shape[0]) @ self.columns
        sizes = told @ self.inverse
        left = white - (self.columns @ sizes.T).T.reshape(white.shape)
        return left, sizes.reshape(*white.shape[:-2], len(self.inverse))


def _outside(blocks: tuple[tuple[NDArray[np.intp], Array], ...], white: Array) -> Array:
    """What the unknowns of blocks cannot do of whitened columns (k, n, 3)."""
    left = white.copy()
    for here, basis in blocks:
        mine = white[:, here].reshape(len(white), 3 * here.size)
        left[:, here] -= (mine @ basis @ basis.T).reshape(len(white), here.size, 3)
    return left
