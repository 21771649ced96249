"""From one effect to several: admit, refine the form, exchange, prune, and stop at the noise.

An effect is admitted when chance cannot explain its gain: BIC, an F test corrected for all forms that were tried, and
held-out readings must agree. Before a second family is offered, the first has its refined forms: right physics with
too simple a formula looks like further effects. Each pass may also exchange an admitted effect for a better one. Where
several effects end in no finding, and one of them alone explains nearly all, the others were for what its formula
misses.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.heldout import STANDARD_ERRORS
from lutgen.criticism.fit.lack_of_fit import is_noise
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, linearise
from lutgen.criticism.fit.system import System
from lutgen.criticism.search.candidates import (
    HALF,
    OPTIMISM,
    STRONG,
    Family,
    Luck,
    bic,
    contenders,
    families,
    family,
    forms_of,
)
from lutgen.criticism.search.free_term import free_term, probe

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.candidates import Candidate
    from lutgen.effects import Effect

#: Chance of a false alarm over all forms tried.
SIGNIFICANT = 0.01

#: Families are refined as far as they may come this near to the best one's BIC: far beyond what makes a rival.
NEAR = 60.0

#: A misfit of this size in units of the noise's own is clear; and the share of it that one effect, and two, must take
#: away if others are to be looked for.
CLEAR, LEAST_EXPLAINED = 0.2, (0.15, 0.5)

#: More effects than this at once no campaign tells apart.
MOST = 3

#: A formula may miss so much less than all of what its effect does, in χ².
MOST_OF_IT = 0.95


@dataclass(frozen=True)
class Step:
    """One admitted effect: the candidate in the final company, those beside it, and what it was chosen from.

    ``alike``: families that alone explain nearly all of a misfit, as it does, where no formula explains all.
    """

    chosen: Candidate
    beside: tuple[Candidate, ...] = field(repr=False)
    effects: tuple[Effect, ...] = field(repr=False)
    base: Fit = field(repr=False)
    alike: tuple[Family, ...] = ()

    @property
    def effect(self) -> Effect:
        """The effect."""
        return self.chosen.effect

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @cached_property
    def without(self) -> Fit:
        """The fit of the others alone, in their final forms."""
        return together(self.base, self.beside)

    @cached_property
    def rivals(self) -> tuple[Family, ...]:
        """Families that would do as well in its place: searched for when they are first asked for."""
        found = _rivals(self.chosen, self.beside, self.effects, self.base)
        known = {rival.name for rival in found}
        return (*found, *(each for each in self.alike if each.name not in known))


@dataclass(frozen=True)
class Explanation:
    """What the search ended with.

    Attributes
    ----------
    base, final
        The fits without and with the admitted effects.
    first
        All families fitted alone beside the base, best first.
    steps
        The admitted effects in the order of their admission.
    trail
        The fits from base to final, one effect more each.

    """

    base: Fit
    final: Fit
    first: tuple[Family, ...]
    steps: tuple[Step, ...]
    trail: tuple[Fit, ...]


def explain(
    base: Fit,
    effects: Sequence[Effect],
    error: PureError,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
    *,
    known: Sequence[Effect] = (),
) -> Explanation:
    """Search for the effects that explain what ``base`` leaves.

    ``known``: effects that a search under another noise has admitted, in their order. They are judged anew, first.
    """
    first = _ranked(base, effects, progress)
    chosen, current = _readmitted(known, base, first, error)
    while found := _next(chosen, current, effects, base, error, first, progress):
        chosen = found
        current = together(base, chosen)
    chosen = _clean(_pruned(chosen, base), base, error)
    final = together(base, chosen)
    alike = _alone(chosen, final, first, base, error)
    if alike:
        chosen = [alike[0].best]
        final = together(base, chosen)
    trail = [together(base, chosen[:count]) for count in range(1, len(chosen))]
    trail += [final] if chosen else []
    steps = tuple(
        Step(each, tuple(other for other in chosen if other is not each), tuple(effects), base, tuple(alike[1:]))
        for each in chosen
    )
    return Explanation(base, final, tuple(first), steps, tuple(trail))


def _next(  # noqa: PLR0917 - what has been found, and what is searched
    chosen: list[Candidate],
    current: Fit,
    effects: Sequence[Effect],
    base: Fit,
    error: PureError,
    first: Sequence[Family],
    progress: Callable[[int, int], None],
) -> list[Candidate] | None:
    """Admit one more effect, or else exchange one; None where neither helps."""
    names = {each.effect.name for each in chosen}
    if len(chosen) < MOST and not _hopeless(base, current, len(chosen)):
        others = [each for each in effects if each.name not in names]
        ranked = _ranked(current, others, progress, limit=current.bic - STRONG) if chosen else first
        # What is found beside an effect need not show that anything is there.
        asked = replace(error, allowance=1.0) if chosen and error.measured else error
        if ranked and _is_beyond_chance(ranked[0], current, asked, sum(each.tried for each in ranked)):
            return refined([*chosen, ranked[0].best], base)
    return _exchanged(chosen, effects, base)


def _readmitted(
    known: Sequence[Effect], base: Fit, first: Sequence[Family], error: PureError
) -> tuple[list[Candidate], Fit]:
    """Admit effects beside one another again, as far as they are beyond chance, and fit them together."""
    chosen: list[Candidate] = []
    current, tried = base, sum(each.tried for each in first)
    for effect in known:
        best = family(current, effect).best
        if not admissible(best, current, error, tried):
            break
        chosen = refined([*chosen, best], base)
        current = together(base, chosen)
    return chosen, current


def _hopeless(base: Fit, current: Fit, count: int) -> bool:
    """Whether so much of a clear misfit is left that no further effect would make a finding of it."""
    if not count:
        return False
    excess = base.chi2 - base.freedom
    return excess > CLEAR * base.freedom and base.chi2 - current.chi2 < LEAST_EXPLAINED[count - 1] * excess


def _is_beyond_chance(found: Family, current: Fit, error: PureError, tried: int) -> bool:
    """Whether a family's best form is beyond chance, or its simplest, which has fewer numbers to pay for."""
    forms = (found.best, found.simple) if found.best.form != found.simple.form else (found.best,)
    return any(admissible(each, current, error, tried) for each in forms)


def admissible(candidate: Candidate, current: Fit, error: PureError, tried: int) -> bool:
    """Whether a candidate beside ``current`` is beyond chance: BIC, corrected F test, held-out readings."""
    # The gain must be worth its parameters under the noise that replicates show; where nobody measured it, under twice
    # that noise.
    beyond = candidate.gain * (1.0 - 1.0 / (error.allowance * max(error.variance, 1.0)))
    if bic(candidate) + beyond > current.bic - STRONG:
        return False
    tried *= candidate.settings
    if candidate.form and error.p_of_gain(candidate.gain, len(candidate.form)) * tried > SIGNIFICANT:
        return False
    withheld = candidate.fit.withheld
    gain, deviation = withheld.gain_over(current.withheld)
    # Where a parameter rests on one cell, withheld readings cannot confirm the effect: they must not contradict it.
    return gain > STANDARD_ERRORS * deviation or (withheld.may_miss and gain >= -STANDARD_ERRORS * deviation)


def _ranked(
    base: Fit,
    effects: Sequence[Effect],
    progress: Callable[[int, int], None] = lambda _done, _total: None,
    *,
    limit: float = np.inf,
) -> list[Family]:
    found = []
    for each in families(base, effects, within=NEAR, limit=limit):
        found.append(each)
        progress(len(found), len(effects))
    return sorted(found, key=lambda each: bic(each.best))


def _others(base: Fit, terms: Sequence[Term]) -> Fit:
    """Fit terms beside the base's own."""
    return fit(base.problem, (*base.terms, *terms), State((), base.tips, base.gains))


def together(base: Fit, chosen: Sequence[Candidate]) -> Fit:
    """Fit candidates beside the base's own terms."""
    return _others(base, [each.term for each in chosen]) if chosen else base


def refined(chosen: list[Candidate], base: Fit, *, alone: bool = False, limit: float = np.inf) -> list[Candidate]:
    """Choose the form of every admitted effect again, now that all are there; ``alone``: also that of a single one.

    ``limit``: of forms that cannot bring BIC below it, only the simplest are fitted.
    """
    if not chosen or (len(chosen) < 2 and not alone):
        return chosen
    whole = together(base, chosen)
    for index, each in enumerate(chosen):
        beside = [*chosen[:index], *chosen[index + 1 :]]
        around = together(base, beside)
        # Where all parameters together promise less than one costs, no longer form is worth its own.
        settled = OPTIMISM * _freed(whole, each.effect) < np.log(base.readings)
        again = family(around, each.effect, limit=limit, longest=len(each.form) if settled else None).best
        if whole.bic < bic(again):
            # Proposed settings are found from what the others leave, which may hide those that are there already.
            again = replace(each, fit=whole, gain=around.chi2 - whole.chi2)
        chosen, whole = [*chosen[:index], again, *chosen[index + 1 :]], again.fit
    return chosen


def _exchanged(chosen: list[Candidate], effects: Sequence[Effect], base: Fit) -> list[Candidate] | None:
    """Replace an admitted effect where, beside the others, another family explains clearly more; None: nowhere."""
    if len(chosen) < 2:
        return None
    limit = together(base, chosen).bic - STRONG
    for each in chosen:
        beside = [other for other in chosen if other is not each]
        names = {other.effect.name for other in chosen}
        better = contenders(together(base, beside), [new for new in effects if new.name not in names], limit)
        if better:
            return refined([*beside, better[0].best], base)
    return None


def _pruned(chosen: list[Candidate], base: Fit) -> list[Candidate]:
    """Drop what the later arrivals have made superfluous, once their forms are chosen without it."""
    if len(chosen) < 2:
        return chosen
    limit = together(base, chosen).bic + STRONG
    for each in chosen:
        rest = [other for other in chosen if other is not each]
        alone = together(base, rest)
        if alone.bic - OPTIMISM * _freed(alone, *(other.effect for other in rest)) > limit:
            continue  # no form of the others does without it
        rest = refined(rest, base, alone=True, limit=limit)
        if together(base, rest).bic < limit:
            return _pruned(rest, base)
    return chosen


def _freed(found: Fit, *effects: Effect) -> float:
    """What a first step promises from a fit with all parameters of some of its effects free, as in no form they are.

    Infinite of an effect that is tried on a grid, on which a step says nothing.
    """
    if any(parameter.grid for effect in effects for parameter in effect.parameters.values()):
        return np.inf
    names = {effect.name for effect in effects}
    terms = tuple(
        replace(term, free=tuple(term.effect.parameters)) if term.effect.name in names else term for term in found.terms
    )
    state = State(terms, found.tips, found.gains)
    system = System(found.problem, linearise(found.problem, state), state)
    return system.chi2 - system.step(terms).chi2


def _clean(chosen: list[Candidate], base: Fit, error: PureError) -> list[Candidate]:
    """Where one effect leaves a structure, take the first of its freer forms that does not, if there is one."""
    if len(chosen) != 1 or not probe(chosen[0].fit, error).names:
        return chosen
    for freer in forms_of(base, chosen[0].effect):
        if freer.fit.chi2 < chosen[0].fit.chi2 and not probe(freer.fit, error).names:
            return [freer]
    return chosen


def stand_apart(chosen: Sequence[Candidate], base: Fit) -> bool:
    """Whether several effects share less than half of what they explain together.

    Two effects that each explain nearly all, and need one another for the rest, are how a third one is mimicked.
    """
    if len(chosen) < 2:
        return True
    left = together(base, chosen).chi2
    own = sum(together(base, [other for other in chosen if other is not each]).chi2 - left for each in chosen)
    return own > HALF * (base.chi2 - left)


def _alone(
    chosen: Sequence[Candidate], final: Fit, first: Sequence[Family], base: Fit, error: PureError
) -> list[Family]:
    """Families that each alone explain nearly all of a misfit, best first, where several effects are no finding of it.

    A formula that does not quite fit leaves something, however small beside its effect, and others are fitted to that.
    """
    if len(chosen) < 2:
        return []
    left, apart = free_term(final, error), stand_apart(chosen, base)
    if is_noise(final, error) and not left.names and apart:
        return []
    whole = base.chi2 - final.chi2 + left.gain
    alike = [each for each in first if each.best.gain > MOST_OF_IT * whole]
    if alike and apart:
        # Effects beside the one that explain nearly all of what it leaves are a finding, however little that is.
        others = alike[0].best.fit.chi2 - final.chi2
        missed = max(left.gain, final.chi2 - final.freedom * error.scale)
        if others > MOST_OF_IT * (others + missed):
            return []
    return alike


def _rivals(each: Candidate, beside: Sequence[Candidate], effects: Sequence[Effect], base: Fit) -> tuple[Family, ...]:
    """Families that would do as well in the place of an admitted effect."""
    names = {each.effect.name, *(other.effect.name for other in beside)}
    alone = together(base, beside)
    luck = Luck()
    mine = family(alone, each.effect, luck).best
    limit = bic(mine) + 2 * STRONG
    others = [effect for effect in effects if effect.name not in names]
    near = contenders(alone, others, limit, luck)
    # An effect may be blind here only because nobody logged what it goes by: room light that was always there.
    for effect in others:
        if effect.name in each.effect.confused_with and (problem := base.problem.unlogged(effect.needs)):
            near += contenders(fit(problem, alone.terms, State((), alone.tips, alone.gains)), [effect], limit)

    tied = tuple(rival for rival in near if bic(rival.best) < bic(mine) + STRONG)
    # The formulas of kin differ by little, and displays follow none of them to the letter: more is asked before one of
    # them stands alone.
    return tied or tuple(rival for rival in near if each.effect.is_kin(rival.effect) and bic(rival.best) < limit)
