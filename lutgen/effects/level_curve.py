"""A gamma that may differ from level to level: the free form of every drift of the transfer curve.

l → l^(1 + Γ(d)), with Γ a cubic spline of the code value d given at five knots. A constant Γ is the plain power law, so
the free form contains the simple one; code 0 and 1 stay where they are and light stays positive whatever the knots.

Uniform cubic B-splines: de Boor, A Practical Guide to Splines (1978); two outer coefficients continue the inner ones
linearly, so that constants and straight lines are met exactly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array

#: Exponents stay above this, so that light stays finite at the ends of every parameter's range.
LEAST_EXPONENT = 0.05

#: Polynomial coefficients (rows: powers of the place in a segment) of four neighbouring B-splines.
_BASIS = np.array([[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]) / 6.0


def level_curve(code: Array, knots: Sequence[float] | Array) -> Array:
    """Γ at code values of any shape; ``knots`` are the coefficients at equal steps from code 0 to 1."""
    given = np.asarray(knots, dtype=np.float64)
    padded = np.concatenate([[2 * given[0] - given[1]], given, [2 * given[-1] - given[-2]]])
    segments = given.size - 1
    windows = np.stack([padded[k : k + segments] for k in range(4)])
    pieces = (_BASIS[:, :, np.newaxis] * windows).sum(axis=1)
    place = np.clip(code, 0.0, 1.0) * segments
    index = np.minimum(place.astype(np.intp), segments - 1)
    place -= index
    curve = pieces[3][index]
    for piece in pieces[2::-1]:
        curve *= place
        curve += piece[index]
    return np.asarray(curve)


def bent(light: Array, change: Array) -> Array:
    """Raise light (or code values), 0 or more, to the power 1 + ``change``, which broadcasts with it."""
    return np.asarray(np.maximum(light, 0.0) ** np.maximum(1.0 + change, LEAST_EXPONENT))
