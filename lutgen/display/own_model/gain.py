"""Curves as sRGB's light times a smooth gain: what every channel's curve, for X, Y or Z, is made of.

Every display's curve is near sRGB's, so that the gain bends little: levels that were not read keep its shape. The gain
is a cubic B-spline over the code value; stiffness makes second differences of its coefficients small (P-splines:
Eilers & Marx, Statist. Sci. 11, 89-121 (1996), doi:10.1214/ss/1038425655).
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts load when they are first used: most displays are shown without them

from lutgen.colorimetry import Array, code_to_linear

#: Splines of a gain: one for every 12 codes of 8 bits, where the largest shared sessions read 97 greys.
SPLINES = 24

#: Stiffness 1 holds a bend of 0.01 in the gain as dear as one unit of CIELAB in one reading.
BEND = 100.0

#: Code values between which a curve is asked to rise.
STEPS = 65

_KNOTS = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, SPLINES - 2), np.ones(3)])


def lit(code: Array) -> Array:
    """SRGB's light times every spline at code values (m,) in 0..1: (m, SPLINES)."""
    within = np.clip(code, 0.0, 1.0)
    return np.asarray(
        scipy.interpolate.BSpline.design_matrix(within, _KNOTS, 3).toarray() * code_to_linear(within)[:, np.newaxis]
    )


def bends() -> Array:
    """Rows that a stiffness of 1 makes small, (SPLINES − 2, SPLINES)."""
    return np.asarray(BEND * np.diff(np.eye(SPLINES), 2, axis=0))


def rises() -> Array:
    """Rises of a curve from step to step, (STEPS − 1, SPLINES): none is to be negative."""
    return np.asarray(np.diff(lit(np.linspace(0.0, 1.0, STEPS)), axis=0))
