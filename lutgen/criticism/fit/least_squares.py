"""Weighted least squares in XYZ with the unknown tips eliminated: Gauss-Newton with bounds (variable projection).

One iteration linearises the prediction (:mod:`lutgen.criticism.fit.linear`), eliminates the unknowns that are local to
a block of readings (:mod:`lutgen.criticism.fit.system`), and solves the remaining small system of the effects. A step
that does not lower χ² is tried again with damping. χ² is the sum of squared whitened residuals; it is never rescaled by
the misfit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.first_session.errors import FirstErrors
from lutgen.criticism.fit.heldout import HeldOut, held_out
from lutgen.criticism.fit.linear import Linear, State, Term, linearise, predict, whiten
from lutgen.criticism.fit.projection import Projection
from lutgen.criticism.fit.score import Score
from lutgen.criticism.fit.system import System, without_first_errors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem

#: A fit has converged if one more iteration would gain less χ² than this: far below any threshold.
CONVERGED = 0.005

#: Stop if a step failed and its predicted gain in χ² is below this, or if a damped step gains less. Such steps fail at
#: jumps of an effect or because of interpolated tips.
NEGLIGIBLE = 0.3

#: The same two limits as shares of the misfit. They apply to models with a large misfit, whose χ² need not be exact.
CONVERGED_SHARE, NEGLIGIBLE_SHARE = 1e-4, 1e-3

MAX_ITERATIONS = 30

#: Damping in units of the parameters' own curvature: its first value, its largest value, and its factors after a step
#: that fails and after one that succeeds. In a curved valley a damping that falls quickly makes every second step fail.
DAMPING, MOST_DAMPING, HARDER, EASIER = 1e-2, 100.0, 10.0, 1 / 3

#: Number of rounds in which only the tips are solved, before the effects move.
RELAXATIONS = 3


@dataclass(frozen=True)
class Fit:
    """The result of a fit.

    Attributes
    ----------
    problem, terms, tips, gains
        The problem, and the estimates: effects, latent tips (H, 4, 3), gains.
    chi2
        Σ of squared whitened residuals and of the priors' terms.
    parameters
        Number of free parameters of effects.
    last
        The state of the last linearisation, one step of the local unknowns before the estimates.
    first_errors
        Errors of a native display's first session that later readings share; None if there are none.

    """

    problem: Problem
    terms: tuple[Term, ...]
    tips: Array
    gains: Array
    chi2: float
    parameters: int
    last: State = field(repr=False)
    first_errors: FirstErrors | None = field(repr=False)

    @property
    def state(self) -> State:
        """The estimates of all unknowns."""
        return State(self.terms, self.tips, self.gains)

    def system_of(self, terms: Sequence[Term]) -> System:
        """Linearise about other terms, with the tips and gains of this fit."""
        state = State(tuple(terms), self.tips, self.gains)
        return System(self.problem, linearise(self.problem, state), state, self.first_errors)

    def with_terms(self, terms: Sequence[Term]) -> Fit:
        """Fit other terms, from the tips and gains of this fit; the result is cached: a search repeats many fits."""
        key = tuple((id(term.effect), *term.values.items(), term.free, term.gridded) for term in terms)
        if key not in self._others:
            start = State(tuple(terms), self.tips, self.gains)
            self._others[key] = _fitted(self.problem, start, self.first_errors, relaxations=0)
        return self._others[key]

    def with_more(self, terms: Sequence[Term]) -> Fit:
        """Fit further terms beside those of this fit. Terms of the same forms give the same fit, whatever their values.

        A search comes to the same forms from many starts, which differ too little to fit the forms again.
        """
        key = tuple((id(term.effect), term.free, *(term.values[name] for name in term.gridded)) for term in terms)
        if key not in self._by_forms:
            self._by_forms[key] = self.with_terms((*self.terms, *terms)) if terms else self
        return self._by_forms[key]

    @cached_property
    def _others(self) -> dict[tuple[object, ...], Fit]:
        return {}

    @cached_property
    def _by_forms(self) -> dict[tuple[object, ...], Fit]:
        return {}

    @cached_property
    def _system(self) -> System:
        """The system at the last linearisation, made on demand: a search needs only χ² of most fits."""
        return System(self.problem, linearise(self.problem, self.last), self.last, self.first_errors)

    @cached_property
    def whitened(self) -> Array:
        """Whitened residuals (n, 3) that contain the errors that readings share."""
        residual = whiten(self.problem, self.problem.xyz - self.predicted)
        return np.asarray(residual - np.tensordot(self._system.mode_step, self._system.linear.free, axes=1))

    @cached_property
    def linear(self) -> Linear:
        """The linearised problem with the residuals of the estimates, shared errors of sessions subtracted."""
        problem, system, residual = self.problem, self._system, self.whitened.copy()
        corrected = without_first_errors(system.linear._replace(residual=residual), self.first_errors)[0].residual
        for whole in problem.blocks:
            shared = problem.marginal[int(whole[0])].expected(corrected[whole].ravel())
            residual[whole] -= shared.reshape(-1, 3)
        return system.linear._replace(residual=residual)

    @cached_property
    def residual(self) -> Array:
        """Whitened residuals (n, 3) after subtraction of the most likely errors that readings share."""
        return without_first_errors(self.linear, self.first_errors)[0].residual

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the free parameters, (p, p), in the order of the terms."""
        return self._system.covariance(self.terms)

    @cached_property
    def projection(self) -> Projection:
        """Changes of the readings without what tips, gains and shared errors absorb."""
        return Projection(self.problem, self.linear, self.state, self.whitened, self.first_errors)

    @cached_property
    def score(self) -> Score:
        """Predicted gains of first steps from this fit."""
        return Score(self.problem, self.state, self.projection)

    @cached_property
    def withheld(self) -> HeldOut:
        """Errors of withheld readings."""
        return held_out(self.problem, self.terms, self.projection)

    def held_out_gain(self, base: Fit) -> float:
        """Fall of the χ² of withheld readings from the fit ``base`` to this fit.

        If only one session, or none, can be withheld as a whole, cells are withheld instead.
        """
        if self.withheld.squares.size - self.withheld.left_out > 1:
            return self.withheld.gain_over(base.withheld)[0]
        mine, before = (held_out(each.problem, each.terms, each.projection, by_cells=True) for each in (self, base))
        return mine.gain_over(before)[0]

    @property
    def readings(self) -> int:
        """Number of fitted values: three a reading."""
        return 3 * self.problem.rows.size

    @property
    def freedom(self) -> int:
        """Degrees of freedom of χ²."""
        return int(3.0 * self.problem.counts.sum()) - unknowns(self.problem) - self.parameters

    @property
    def bic(self) -> float:
        """χ² + k ln n (Schwarz 1978); k leaves out the local unknowns, which all fits of a problem have."""
        searched = self.parameters + sum(len(term.gridded) for term in self.terms)
        switched = any(term.effect.stage == "selection" for term in self.terms)
        return self.chi2 + searched * float(np.log(self.readings)) + switched * switching_penalty(self.problem)

    @cached_property
    def predicted(self) -> Array:
        """XYZ that the meter should have reported, (n, 3), cd/m²."""
        return predict(self.problem, self.state)

    @cached_property
    def stderr(self) -> tuple[dict[str, float], ...]:
        """Standard error of each free parameter, one dict a term; infinite if the data have no information."""
        sigma, place, errors = np.sqrt(np.diag(self.covariance)), 0, []
        for term in self.terms:
            errors.append({name: float(sigma[place + k]) for k, name in enumerate(term.free)})
            place += len(term.free)
        return tuple(errors)


def unknowns(problem: Problem) -> int:
    """Number of tip and curve unknowns that the data determine, not a prior."""
    tips = 12 if problem.from_first_hour else 12 * int(problem.is_knot.sum())
    return tips + (len(problem.curve_modes) if problem.native else 0)


def switching_penalty(problem: Problem) -> float:
    """Penalty in χ² for another selection of the paper's matrices, which has no parameter that BIC would count.

    Each selection fits the non-additivity (three numbers an hour) to different colours. On an additive display the
    difference in χ² of two selections has a variance of at most 12 an hour: two correlated χ²(3) variables. The penalty
    is 3.7 standard deviations of this difference.
    """
    return 3.7 * float(np.sqrt(12.0 * problem.is_knot.sum()))


def start_state(problem: Problem, terms: Sequence[Term]) -> State:
    """Return the state with the measured tips and zero gains."""
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
        A state with better starting values of tips and gains than the measured tips and zero.

    """
    first_errors = FirstErrors.of(problem)
    if start is None:
        return _fitted(problem, start_state(problem, terms), first_errors)
    return _fitted(problem, State(tuple(terms), start.tips, start.gains), first_errors, relaxations=0)


def _fitted(problem: Problem, state: State, first_errors: FirstErrors | None, relaxations: int = RELAXATIONS) -> Fit:
    system = System(problem, linearise(problem, state), state, first_errors)
    for _ in range(relaxations):
        # The prior of tips at hours between sessions depends on the neighbouring tips, which the first round moves.
        state = system.moved(state, system.mode_step)
        system = System(problem, linearise(problem, state), state, first_errors)
    last, system = _minimised(problem, state, system)
    end = system.moved(last, system.mode_step)
    return Fit(problem, end.terms, end.tips, end.gains, system.chi2, system.effect_count, last, first_errors)


def _minimised(problem: Problem, state: State, system: System) -> tuple[State, System]:
    """Iterate until no step predicts a relevant gain; a step that does not lower χ² is damped."""
    damping = 0.0
    for iteration in range(MAX_ITERATIONS):
        move = system.step(state.terms, damping)
        predicted_gain = system.chi2 - move.chi2
        misfit = system.chi2 - 3 * problem.rows.size
        converged, negligible = max(CONVERGED, CONVERGED_SHARE * misfit), max(NEGLIGIBLE, NEGLIGIBLE_SHARE * misfit)
        # χ² is exact only to first order in the tips. Always take one step, to check χ² at the fitted tips.
        if predicted_gain < converged and iteration:
            break
        moved = system.moved(state, move.parameters)
        trial = System(problem, linearise(problem, moved), moved, system.first_errors)
        gain = system.chi2 - trial.chi2
        if gain > 0.0:
            state, system = moved, trial
            if gain < (negligible if damping else converged):
                break
            damping = EASIER * damping if damping > EASIER * DAMPING else 0.0
        elif predicted_gain < negligible or damping > MOST_DAMPING:
            break
        else:
            damping = max(HARDER * damping, DAMPING)
    return state, system
