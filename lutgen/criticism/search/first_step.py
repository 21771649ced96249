"""Compare the model after one linear step toward a fit: a preview of switching effects on or off before a full fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.criticism.compare.comparison import compare_problem
from lutgen.criticism.fit.linear import State
from lutgen.criticism.search.candidates import best_start

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.compare.comparison import Comparison
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.effects import Effect

#: Number of campaigns of pure noise whose mean is the noise floor. A preview needs no more accurate floor.
FEW = 4


def first_step(current: Fit, effects: Sequence[Effect]) -> Comparison:
    """Compare the model with these effects after one linear step from a fit that has other effects.

    Parameters
    ----------
    current
        The fit to start from; its effects that are not in ``effects`` are removed.
    effects
        The effects of the new model. Effects of ``current`` start at their fitted values. Other effects start at rest,
        in their simple form with the largest linear gain.

    Raises
    ------
    LutgenError
        An effect happens between two sessions, and the readings hold one session.

    """
    fitted = {term.effect.name: term for term in current.terms}
    terms = tuple(fitted.get(effect.name) or best_start(current, effect) for effect in effects)
    system, state = current.system_of(terms), State(terms, current.tips, current.gains)
    moved = system.moved(state, system.step(terms).parameters)
    return compare_problem(current.problem, moved.terms, draws=FEW)
