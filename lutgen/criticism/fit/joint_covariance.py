"""Joint covariance of the estimates of a fit: parameters of effects, and the latent white and primaries.

Correlated errors of two estimates may cancel each other in a predicted colour, so its standard error needs the whole
covariance. The eliminated unknowns t follow from the global ones δ: t = R⁻¹ (z − U δ), with the blocks of
:mod:`lutgen.criticism.fit.system`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.linear import tip_scale
from lutgen.criticism.fit.system import System
from lutgen.display.fitted import FitCovariance
from lutgen.readings.instruments import session_gain

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.system import Block

#: Relative cutoff of singular values: directions of white and primaries with less information have no covariance.
RCOND = 1e-12


def joint_covariance(fitted: Fit) -> FitCovariance:
    """Covariance of the free parameters and of the latent tips, cd/m², of each hour at which tips were read."""
    problem = fitted.problem
    system = System(problem, fitted.linear, fitted.state, fitted.first_errors)
    spread, undetermined = system.spread(fitted.terms)
    scale = tip_scale(problem).ravel()
    names = [(term.effect.name, name) for term in fitted.terms for name in term.free]
    known = [place for place in range(len(names)) if not undetermined[place]]
    factor = spread[known]
    if problem.from_first_hour:
        tips = spread[len(names) : len(names) + 12] * scale[:, np.newaxis]
        factor = np.concatenate([factor, tips])
    else:
        for block in system.blocks:
            if block.tips_of is not None and problem.is_knot[block.tips_of]:
                gain = _session_gain(fitted, block.tips_of)
                factor = _with_tips(factor, block, spread, scale, gain)
    return FitCovariance(tuple(names[place] for place in known), factor @ factor.T)


def _with_tips(factor: Array, block: Block, spread: Array, scale: Array, gain: Array) -> Array:
    """Append rows for the tips of a block: errors by the global unknowns, by their own noise, by the session's gain."""
    local = block.upper.shape[0]
    inverse = np.linalg.pinv(block.upper[:, :local], rcond=RCOND)[:12] * scale[:, np.newaxis]
    by_globals = -inverse @ block.upper[:, local:-1] @ spread
    before = np.pad(factor, ((0, 0), (0, inverse.shape[1] + 1)))
    shared_part = np.zeros((12, factor.shape[1]))
    shared_part[:, : spread.shape[1]] = by_globals
    return np.concatenate([before, np.column_stack([shared_part, inverse, gain])])


def _session_gain(fitted: Fit, hour: int) -> Array:
    """1 σ error of the tips of an hour by the stated gain of the session, (12,), cd/m²; 0 if the gain is fitted.

    Only a stated gain counts: lutgen's default is not a measurement of this instrument.
    """
    problem = fitted.problem
    stated = session_gain(problem.readings.metadata, problem.readings.file) or 0.0
    in_tips = (problem.gains[problem.hour_of == hour] < 0).all()
    return np.asarray(stated * fitted.tips[hour].ravel() * in_tips)
