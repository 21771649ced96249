"""Weighted least squares in XYZ, the unknown tips eliminated: Gauss-Newton with bounds (variable projection).

One iteration linearises the prediction (:mod:`lutgen.criticism.fit.linear`), eliminates what is local to a block of
readings (:mod:`lutgen.criticism.fit.system`), and solves the small system of effects that is left; a step that does not
keep its promise is tried again, damped. χ² is that of whitened residuals; it is never rescaled by the misfit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.heldout import HeldOut, held_out
from lutgen.criticism.fit.linear import Linear, State, Term, linearise, predict, whiten
from lutgen.criticism.fit.score import Score
from lutgen.criticism.fit.system import System, without_first_errors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem

#: χ² that one more iteration may still gain when a fit counts as converged: far below any threshold.
CONVERGED = 0.005

#: A promise of less is not worth a second try: effects with jumps, and tips that lean on their neighbours', break such.
NEGLIGIBLE = 0.3

#: The same as shares of the misfit that is left, where a model is so wrong that nothing hangs on its last digits.
CONVERGED_SHARE, NEGLIGIBLE_SHARE = 1e-4, 1e-3

MAX_ITERATIONS = 30

#: Damping in units of the parameters' own curvature: the first that is tried, its growth, and where trying ends.
DAMPING, HARDER, MOST_DAMPING = 1e-2, 20.0, 100.0

#: Rounds of solving the tips alone before effects move.
RELAXATIONS = 3


@dataclass(frozen=True)
class Fit:
    """What a fit found.

    Attributes
    ----------
    problem, terms, tips, gains
        The question, and the effects, latent tips (H, 4, 3) and gains that answer it best.
    chi2
        Σ of squared whitened residuals and of the priors' terms.
    parameters
        Number of free parameters of effects.
    last
        The state that was linearised last, one step of the local unknowns before the end.

    """

    problem: Problem
    terms: tuple[Term, ...]
    tips: Array
    gains: Array
    chi2: float
    parameters: int
    last: State = field(repr=False)

    @cached_property
    def _system(self) -> System:
        """The system at the last linearisation: most fits of a search are asked for their χ² alone."""
        return System(self.problem, linearise(self.problem, self.last), self.last)

    @cached_property
    def linear(self) -> Linear:
        """The problem linearised at the end, the residuals without the errors that sessions share."""
        problem, system = self.problem, self._system
        residual = whiten(problem, problem.xyz - self.predicted)
        residual = residual - np.tensordot(system.still, system.linear.free, axes=1)
        apart = without_first_errors(problem, system.linear._replace(residual=residual))[0].residual
        for whole in problem.blocks:
            shared = problem.marginal[int(whole[0])].expected(apart[whole].ravel())
            residual[whole] -= shared.reshape(-1, 3)
        return system.linear._replace(residual=residual)

    @cached_property
    def residual(self) -> Array:
        """Whitened residuals without the likeliest errors that readings share, (n, 3)."""
        return without_first_errors(self.problem, self.linear)[0].residual

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the free parameters, (p, p), in the order of the terms."""
        return self._system.covariance(self.terms)

    @cached_property
    def modes(self) -> Array:
        """Sizes of the curve modes of a native display, (q,)."""
        return self._system.still[self._system.global_count - self._system.mode_count :]

    @cached_property
    def score(self) -> Score:
        """What first steps from here promise."""
        return Score(self)

    @cached_property
    def withheld(self) -> HeldOut:
        """Errors of readings that are withheld from it."""
        return held_out(self)

    @property
    def readings(self) -> int:
        """Numbers that were fitted: three a reading."""
        return 3 * self.problem.rows.size

    @property
    def freedom(self) -> int:
        """Degrees of freedom of χ²."""
        return int(3.0 * self.problem.counts.sum()) - unknowns(self.problem) - self.parameters

    @property
    def bic(self) -> float:
        """χ² + k ln n (Schwarz 1978); the local unknowns are left out, being the same for all fits of a problem."""
        searched = self.parameters + sum(len(term.gridded) for term in self.terms)
        switched = any(term.effect.stage == "selection" for term in self.terms)
        return self.chi2 + searched * float(np.log(self.readings)) + switched * switching_penalty(self.problem)

    @cached_property
    def predicted(self) -> Array:
        """XYZ that the meter should have reported, (n, 3), cd/m²."""
        return predict(self.problem, State(self.terms, self.tips, self.gains))

    @cached_property
    def stderr(self) -> tuple[dict[str, float], ...]:
        """Standard error of each free parameter, one dict a term; NaN where the data say nothing."""
        sigma, place, found = np.sqrt(np.diag(self.covariance)), 0, []
        for term in self.terms:
            found.append({name: float(sigma[place + k]) for k, name in enumerate(term.free)})
            place += len(term.free)
        return tuple(found)


def unknowns(problem: Problem) -> int:
    """Local unknowns that the data, rather than a prior, determine."""
    tips = 12 if problem.from_first_hour else 12 * int(problem.is_knot.sum())
    return tips + (len(problem.curve_modes) if problem.native else 0)


def switching_penalty(problem: Problem) -> float:
    """χ² by which another selection must win to be more than luck.

    It has no parameter to count. But the non-additivity, three numbers an hour, then is drawn from other colours:
    where there is none, χ² under both selections differs by two correlated χ²(3) an hour, of variance 12 at most.
    """
    return 3.7 * float(np.sqrt(12.0 * problem.is_knot.sum()))


def start_state(problem: Problem, terms: Sequence[Term]) -> State:
    """Begin at the measured tips, with no gains."""
    tips = problem.measured_tips
    if problem.from_first_hour:
        tips = np.broadcast_to(tips[0], tips.shape)
    return State(tuple(terms), tips, np.zeros(problem.gain_count))


def fit(problem: Problem, terms: Sequence[Term] = (), start: State | None = None) -> Fit:
    """Fit terms, tips and gains together.

    Parameters
    ----------
    problem
        The readings.
    terms
        Effects with starting values.
    start
        A state whose tips and gains are a better beginning than the measured ones.

    """
    if start is None:
        return _fitted(problem, start_state(problem, terms))
    # A search asks for many fits again, from the same start.
    asked = tuple((id(term.effect), *term.values.items(), term.free, term.gridded) for term in terms)
    key = asked, start.tips.tobytes(), start.gains.tobytes()
    if key not in problem.fits:
        problem.fits[key] = _fitted(problem, State(tuple(terms), start.tips, start.gains), relaxations=0)
    return problem.fits[key]


def _fitted(problem: Problem, state: State, relaxations: int = RELAXATIONS) -> Fit:
    system = System(problem, linearise(problem, state), state)
    for _ in range(relaxations):
        # Tips between sessions lean on those of their neighbours, which the first round has moved.
        state = system.moved(state, system.still)
        system = System(problem, linearise(problem, state), state)
    last, system = _descended(problem, state, system)
    end = system.moved(last, system.still)
    return Fit(problem, end.terms, end.tips, end.gains, system.chi2, system.effect_count, last)


def _descended(problem: Problem, state: State, system: System) -> tuple[State, System]:
    """Go down to where no step promises more; a step that does not keep its promise is tried again, damped."""
    damping = 0.0
    for _ in range(MAX_ITERATIONS):
        move = system.step(state.terms, damping)
        promise = system.chi2 - move.chi2
        misfit = system.chi2 - 3 * problem.rows.size
        enough, little = max(CONVERGED, CONVERGED_SHARE * misfit), max(NEGLIGIBLE, NEGLIGIBLE_SHARE * misfit)
        if promise < enough:
            break
        moved = system.moved(state, move.parameters)
        trial = System(problem, linearise(problem, moved), moved)
        gain = system.chi2 - trial.chi2
        if gain > 0.0:
            state, system = moved, trial
            if gain < (little if damping else enough):
                break
            damping = damping / HARDER if damping > DAMPING else 0.0
        elif promise < little or damping > MOST_DAMPING:
            break
        else:
            damping = max(HARDER * damping, DAMPING)
    return state, system
