"""One linear step toward a fit: what switching effects on or off would do, said before everything is fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.criticism.compare.comparison import compare_problem
from lutgen.criticism.fit.linear import State, linearise
from lutgen.criticism.fit.system import System
from lutgen.criticism.search.candidates import promising

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.compare.comparison import Comparison
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.effects import Effect

#: Campaigns of pure noise that the floor is the mean of: a step that is not the fit needs no better one.
FEW = 4


def first_step(found: Fit, effects: Sequence[Effect]) -> Comparison:
    """Compare the model with these effects after one linear step from a fit that has other ones.

    Parameters
    ----------
    found
        The fit to step from; its effects that are not named are taken out.
    effects
        The effects that the model shall have: those of ``found`` begin at their fitted values, others at rest, in
        their simple form of the largest promise.

    Raises
    ------
    LutgenError
        An effect happens between two sessions, and there is one.

    """
    problem, fitted = found.problem, {term.effect.name: term for term in found.terms}
    terms = tuple(fitted.get(effect.name) or promising(found, effect) for effect in effects)
    state = State(terms, found.tips, found.gains)
    system = System(problem, linearise(problem, state), state)
    moved = system.moved(state, system.step(terms).parameters)
    return compare_problem(problem, moved.terms, draws=FEW)
