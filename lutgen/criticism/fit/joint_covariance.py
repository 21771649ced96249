"""How the errors of all that a fit has found hang together: parameters of effects, and white and primaries before them.

A parameter that trades off with another, or with white, is known less than a picture that both make. What a fit has
eliminated follows from its global unknowns: t = R⁻¹ (z − U δ), with the blocks of :mod:`lutgen.criticism.fit.system`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.linear import State, tip_scale
from lutgen.criticism.fit.system import System
from lutgen.display.fitted import FitCovariance
from lutgen.readings.instruments import session_gain

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.system import Block

#: Directions of white and primaries that readings hold by less than this share of the best known one are not moved.
HELD = 1e-12


def joint_covariance(found: Fit) -> FitCovariance:
    """Covariance of the free parameters, and of the latent tips of each hour at which tips were read, cd/m²."""
    problem = found.problem
    system = System(problem, found.linear, State(found.terms, found.tips, found.gains))
    spread, blind = system.spread(found.terms)
    scale = tip_scale(problem).ravel()
    names = [(term.effect.name, name) for term in found.terms for name in term.free]
    told = [place for place in range(len(names)) if not blind[place]]
    factor = spread[told]
    if problem.from_first_hour:
        tips = spread[len(names) : len(names) + 12] * scale[:, np.newaxis]
        factor = np.concatenate([factor, tips])
    else:
        for block in system.blocks:
            if block.tips_of is not None and problem.is_knot[block.tips_of]:
                gain = _session_gain(found, block.tips_of)
                factor = _with_tips(factor, block, spread, scale, gain)
    return FitCovariance(tuple(names[place] for place in told), factor @ factor.T)


def _with_tips(factor: Array, block: Block, spread: Array, scale: Array, gain: Array) -> Array:
    """Append the tips of a block: what they owe to global unknowns, to noise of their own, and to a session's gain."""
    local = block.upper.shape[0]
    solved = np.linalg.pinv(block.upper[:, :local], rcond=HELD)[:12] * scale[:, np.newaxis]
    follow = -solved @ block.upper[:, local:-1] @ spread
    before = np.pad(factor, ((0, 0), (0, solved.shape[1] + 1)))
    known = np.zeros((12, factor.shape[1]))
    known[:, : spread.shape[1]] = follow
    return np.concatenate([before, np.column_stack([known, solved, gain])])


def _session_gain(found: Fit, hour: int) -> Array:
    """1 σ that a session's stated gain makes in the tips of an hour, (12,) in cd/m²; 0 where a fit has told it.

    What lutgen assumes of gains that nobody stated is no knowledge of this instrument.
    """
    problem = found.problem
    stated = session_gain(problem.readings.metadata, problem.readings.file) or 0.0
    taken = (problem.gains[problem.hour_of == hour] < 0).all()
    return np.asarray(stated * found.tips[hour].ravel() * taken)
