"""How much what readings of one session share varies from session to session, beyond the noise of single readings.

A gain that wanders while a session is read moves neighbouring readings together. Where the file does not tell the order
of reading, nobody can say which; but a display's faults grow steadily over the hours, and an instrument's wandering
comes and goes. So the light near each level is followed from session to session: what leaves the straight line between
the session before and the one after is an instrument's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.linear import whiten
from lutgen.criticism.probes import by_code
from lutgen.criticism.search import PureError, Score

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.criticism.fit import Fit

#: A departure that noise makes once in 400 times counts no more than this many variances: a display may jump once.
MOST = 9.0


def with_unsteadiness(error: PureError, found: Fit) -> PureError:
    """Return the yardstick of tests on what a fit leaves: with the allowance that unsteady sessions ask for."""
    return replace(error, allowance=max(error.allowance, unsteadiness(found)))


def unsteadiness(found: Fit) -> float:
    """Variance of what departs from a steady course, in units of the noise's own; 1 at least, and of few sessions."""
    amplitude, variance = _courses(found)
    hours = np.array([found.problem.hours[found.problem.hour_of[here[0]]] for here in found.problem.blocks])
    squares = [
        square
        for size, error in zip(amplitude.T, variance.T, strict=True)
        for square in _departures(*(each[np.isfinite(error)] for each in (hours, size, error)))
    ]
    return max(1.0, float(np.minimum(squares, MOST).mean())) if squares else 1.0


def _courses(found: Fit) -> tuple[Array, Array]:
    """Size of the light near each level in each block, and its variance: (blocks, k); infinite where it has none."""
    problem, score = found.problem, Score(found)
    signatures = [whiten(problem, found.predicted * weight[:, np.newaxis]) for _, weight in by_code(problem)]
    sizes, variances = [], []
    for part in score.parts:
        columns = np.array([part.outside(signature) for signature in signatures])
        strength = (columns**2).sum(axis=1)
        seen = np.where(strength > 1e-6, strength, np.nan)
        sizes.append(columns @ part.outside(found.linear.residual, part.off) / seen)
        variances.append(np.where(np.isnan(seen), np.inf, 1.0 / seen))
    return np.array(sizes), np.array(variances)


def _departures(hours: Array, size: Array, variance: Array) -> Array:
    """Squared departures from the line between the neighbours, in units of their variance: (n − 2,)."""
    before, here, after = hours[:-2], hours[1:-1], hours[2:]
    span = after - before
    share = np.where(span > 0, (here - before) / np.where(span > 0, span, 1.0), 0.5)
    off = size[1:-1] - (1.0 - share) * size[:-2] - share * size[2:]
    return np.asarray(off**2 / (variance[1:-1] + (1.0 - share) ** 2 * variance[:-2] + share**2 * variance[2:]))
