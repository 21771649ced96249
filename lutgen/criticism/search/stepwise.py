"""Stepwise search for several effects: admit, refine the form, exchange, prune, and stop at the noise.

An effect is admitted if chance cannot explain its gain: BIC, an F test corrected for all forms that were tried, and
held-out readings must all support the effect. The refined forms of the first effect are tried before a second effect:
if the formula of the right effect is too simple, its residual looks like further effects. Each pass may also exchange
an admitted effect for a better one. If several effects make no sound finding and one of them alone explains nearly all,
only this one is kept: the other effects fit the residual that its formula leaves.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import compress
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.heldout import STANDARD_ERRORS
from lutgen.criticism.fit.lack_of_fit import SIGNIFICANT, is_noise
from lutgen.criticism.search.candidates import (
    HALF,
    MOST_OF_IT,
    OPTIMISM,
    STRONG,
    Family,
    bic,
    contenders,
    families,
    family,
    forms_of,
)
from lutgen.criticism.search.explanation import Explanation, Step, ages_light, is_shown_apart, together
from lutgen.criticism.search.free_term import free_term, leaves_only_noise, probe
from lutgen.criticism.search.one_for_several import inside_limits, near_the_best, one_for_several
from lutgen.criticism.search.unknown_table import rounding_behind_table
from lutgen.criticism.search.ways_of_aging import even_fading, explain_together, light_alone, of_one_size

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.candidates import Candidate
    from lutgen.effects import Effect

#: A first effect with a smaller probability of a false alarm needs any improvement of held-out readings, not one beyond
#: their standard error.
UNDOUBTED = 0.001

#: The refined forms of a family are fitted if its BIC may be at most this much above the best BIC. Rivals are much
#: nearer.
NEAR = 60.0

#: A misfit is clear if the excess of χ² is more than ``CLEAR_EXCESS`` times χ² of the noise. One effect, or two, must
#: then explain the shares ``LEAST_EXPLAINED`` of the excess before a further effect is tried.
CLEAR_EXCESS, LEAST_EXPLAINED = 0.2, (0.15, 0.5)

#: Largest number of effects at once: no campaign distinguishes more.
MOST = 3


def explain(
    base: Fit,
    effects: Sequence[Effect],
    error: PureError,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
    *,
    known: Sequence[Candidate] = (),
) -> Explanation:
    """Search for the effects that explain the residuals of ``base``.

    ``known``: the effects that a search under another noise has admitted, in its order. They are tested first.
    """
    first = _ranked(base, effects, progress)
    chosen, current = _readmit(known, base, first, error)
    while larger := _next(chosen, current, effects, base, error, first, progress):
        chosen = larger
        current = together(base, chosen)
    chosen = chosen or _instead_of_free_term(first, base, error)
    admitted = _fewer(_freer(_pruned(chosen, base), base, error), base, error)
    chosen = light_alone(admitted, base, first, error)
    sufficient = _sufficient_alone(chosen, together(base, chosen), first, base, error)
    if sufficient:
        chosen = _with_shown_apart(sufficient[0].best, chosen, base, error)
    if inside := inside_limits(chosen, first):
        chosen, sufficient = [inside[0].best], inside
    if simpler := of_one_size(chosen, base, first, error, refined):
        chosen, sufficient = simpler, []
    if even := even_fading(chosen, base, first):
        chosen, sufficient = [even[0].best], even
    if alone := one_for_several(chosen, effects, base, error):
        chosen, sufficient = alone, []
    if rounded := rounding_behind_table(chosen, base, effects, error):
        chosen, sufficient = rounded, []
    final = together(base, chosen)
    trail = [together(base, chosen[:count]) for count in range(1, len(chosen))]
    trail += [final] if chosen else []
    steps = tuple(
        Step(
            each,
            tuple(other for other in chosen if other is not each),
            () if rounded and each.effect.propose else tuple(effects),  # the shifts by other effects are not jagged
            base,
            tuple(near_the_best(sufficient, error)[1:]) if at == 0 else (),
        )
        for at, each in enumerate(chosen)
    )
    kept = {each.effect.name for each in chosen}
    beyond = tuple(each.effect.name for each in admitted if each.effect.name not in kept)
    return Explanation(base, final, tuple(first), steps, tuple(trail), beyond, bool(rounded))


def _next(  # noqa: PLR0917 - the state of the search, and its inputs
    chosen: list[Candidate],
    current: Fit,
    effects: Sequence[Effect],
    base: Fit,
    error: PureError,
    first: Sequence[Family],
    progress: Callable[[int, int], None],
) -> list[Candidate] | None:
    """Admit one more effect; otherwise exchange one. Return None if neither helps."""
    names = {each.effect.name for each in chosen}
    if len(chosen) < MOST and not _is_hopeless(base, current, len(chosen)):
        others = [each for each in effects if each.name not in names]
        ranked = _ranked(current, others, progress, limit=current.bic - STRONG) if chosen else first
        # The first effect was tested under the larger noise; a further effect is tested under the measured noise.
        judged_by = replace(error, allowance=1.0) if chosen and error.measured else error
        if ranked and _is_beyond_chance(ranked[0], current, judged_by, sum(each.tried for each in ranked)):
            return refined([*chosen, ranked[0].best], base)
    return _exchanged(chosen, effects, base)


def _readmit(
    known: Sequence[Candidate], base: Fit, first: Sequence[Family], error: PureError
) -> tuple[list[Candidate], Fit]:
    """Admit known candidates again, in their order, until one is not beyond chance; then choose their forms again."""
    chosen: list[Candidate] = []
    current, tried = base, sum(each.tried for each in first)
    for each in known:
        fitted = current.with_terms((*current.terms, each.term))
        again = replace(each, fit=fitted, gain=current.chi2 - fitted.chi2)
        if not admissible(again, current, error, tried):
            break
        chosen, current = [*chosen, again], fitted
    chosen = refined(chosen, base, alone=True)
    return chosen, together(base, chosen)


def _is_hopeless(base: Fit, current: Fit, count: int) -> bool:
    """Whether ``count`` effects explain too little of a clear misfit for a sound finding with one more effect."""
    if not count:
        return False
    excess = base.chi2 - base.freedom
    return excess > CLEAR_EXCESS * base.freedom and base.chi2 - current.chi2 < LEAST_EXPLAINED[count - 1] * excess


def _is_beyond_chance(ranked: Family, current: Fit, error: PureError, tried: int) -> bool:
    """Whether a family's best form is beyond chance, or its simplest form, whose penalty is smaller."""
    forms = (ranked.best, ranked.simple) if ranked.best.form != ranked.simple.form else (ranked.best,)
    return any(admissible(each, current, error, tried) for each in forms)


def admissible(candidate: Candidate, current: Fit, error: PureError, tried: int) -> bool:
    """Whether the gain of a candidate over ``current`` is beyond chance: BIC, corrected F test, held-out readings."""
    # The gain must exceed the BIC penalty under the noise of the replicates; if nobody measured the noise, under twice
    # the assumed noise.
    excess = candidate.gain * (1.0 - 1.0 / (error.allowance * max(error.variance, 1.0)))
    if bic(candidate) + excess > current.bic - STRONG:
        return False
    chance = _chance(candidate, error, tried)
    if chance > SIGNIFICANT:
        return False
    withheld = candidate.fit.withheld
    gain, deviation = withheld.gain_over(current.withheld)
    # The first effect competes with noise alone. A further effect also competes with the residual that the formulas of
    # the admitted effects leave, which has a pattern.
    if not current.terms and chance < UNDOUBTED and withheld.falls_without_best_cell(current.withheld):
        return True
    # If one cell alone determines a parameter, withheld readings cannot confirm the effect, but must not refute it.
    return gain > STANDARD_ERRORS * deviation or (withheld.may_miss and gain >= -STANDARD_ERRORS * deviation)


def _chance(candidate: Candidate, error: PureError, tried: int) -> float:
    """Return the probability that chance gives the gain of a candidate to any of the forms that were tried.

    NaN for an effect without parameters: the F test does not apply, so the effect neither fails nor passes this test.
    """
    parameters = len(candidate.form)
    return error.p_of_gain(candidate.gain, parameters) * tried * candidate.settings if parameters else np.nan


def _ranked(
    base: Fit,
    effects: Sequence[Effect],
    progress: Callable[[int, int], None] = lambda _done, _total: None,
    *,
    limit: float = np.inf,
) -> list[Family]:
    fitted = []
    for each in families(base, effects, within=NEAR, limit=limit):
        fitted.append(each)
        progress(len(fitted), len(effects))
    return sorted(fitted, key=lambda each: bic(each.best))


def refined(chosen: list[Candidate], base: Fit, *, alone: bool = False, limit: float = np.inf) -> list[Candidate]:
    """Choose the form of every admitted effect again, with the others present; ``alone``: also if there is only one.

    ``limit``: forms that cannot bring BIC below this limit are not fitted, except the simplest.
    """
    if not chosen or (len(chosen) < 2 and not alone):
        return chosen
    whole = together(base, chosen)
    for index, each in enumerate(chosen):
        beside = [*chosen[:index], *chosen[index + 1 :]]
        # If all parameters together gain less than the penalty of one parameter, a longer form cannot improve BIC.
        is_settled = OPTIMISM * _gain_of_all_free(whole, each.effect) < np.log(base.readings)
        around = together(base, beside)
        again = replace(each, fit=whole, gain=around.chi2 - whole.chi2)
        if not (is_settled and _needs_all(whole, each)):
            reach, longest = min(limit, whole.bic), len(each.form) if is_settled else None
            best = family(around, each.effect, limit=reach, longest=longest).best
            # Settings are proposed from the residuals of the other effects, and may not include the setting of
            # ``each``.
            again = again if whole.bic < bic(best) else best
        chosen, whole = [*chosen[:index], again, *chosen[index + 1 :]], again.fit
    return chosen


def _needs_all(whole: Fit, each: Candidate) -> bool:
    """Whether removing any single free parameter of an effect clearly raises BIC (Wald's test on standard errors)."""
    at = next(at for at, term in enumerate(whole.terms) if term.effect.name == each.effect.name)
    values, errors, rest = whole.terms[at].values, whole.stderr[at], each.effect.rest()
    loss = [((values[name] - rest[name]) / errors[name]) ** 2 for name in each.form if errors.get(name)]
    return len(loss) == len(each.form) > 0 and min(loss) > OPTIMISM * np.log(whole.readings)


def _exchanged(chosen: list[Candidate], effects: Sequence[Effect], base: Fit) -> list[Candidate] | None:
    """Exchange an admitted effect for a family that explains clearly more with the others; return None if none does."""
    if len(chosen) < 2:
        return None
    limit = together(base, chosen).bic - STRONG
    for each in chosen:
        beside = [other for other in chosen if other is not each]
        names = {other.effect.name for other in chosen}
        better = contenders(together(base, beside), [new for new in effects if new.name not in names], limit)
        if better:
            exchanged = refined([*beside, better[0].best], base)
            # Accept the exchange only if BIC of the refitted set is below ``limit``. Fits from different starts differ
            # slightly; otherwise exchanges could alternate for ever.
            if together(base, exchanged).bic < limit:
                return exchanged
    return None


def _pruned(chosen: list[Candidate], base: Fit) -> list[Candidate]:
    """Drop each effect that the other effects can replace after their forms are chosen again without this effect."""
    if len(chosen) < 2:
        return chosen
    limit = together(base, chosen).bic + STRONG
    for each in chosen:
        rest = [other for other in chosen if other is not each]
        without = together(base, rest)
        if without.bic - OPTIMISM * _gain_of_all_free(without, *(other.effect for other in rest)) > limit:
            continue  # no form of the others can replace this effect
        rest = refined(rest, base, alone=True, limit=limit)
        if together(base, rest).bic < limit:
            return _pruned(rest, base)
    return chosen


def _gain_of_all_free(current: Fit, *effects: Effect) -> float:
    """Return the linear gain of freeing all parameters of some effects of a fit at once: an upper bound for any form.

    The gain of an effect with a grid is infinite, because a linear step cannot predict a grid's gain.
    """
    if any(parameter.grid for effect in effects for parameter in effect.parameters.values()):
        return np.inf
    names = {effect.name for effect in effects}
    terms = tuple(
        replace(term, free=tuple(term.effect.parameters)) if term.effect.name in names else term
        for term in current.terms
    )
    system = current.system_of(terms)
    return system.chi2 - system.step(terms).chi2


def _instead_of_free_term(first: Sequence[Family], base: Fit, error: PureError) -> list[Candidate]:
    """Admit the best effect in a simple form if a free term would win, and the effect is as likely as the free term.

    Readings that were held out must not refute the effect, but need not confirm it beyond chance.
    """
    best = first[0].best if first else None
    if best is None or best.refined or bic(best) > base.bic - STRONG:
        return []
    is_beyond_chance = _chance(best, error, sum(each.tried for each in first)) < SIGNIFICANT
    if not is_beyond_chance or best.fit.withheld.gain_over(base.withheld)[0] <= 0.0:
        return []
    term = probe(base, error)
    return [best] if term.names and base.bic - bic(best) > term.evidence - STRONG else []


def _freer(chosen: list[Candidate], base: Fit, error: PureError) -> list[Candidate]:
    """Replace the form of an only effect that leaves a free term.

    The new form is the best one that has a smaller χ² and leaves no free term. If there is none, it is the best that
    explains nearly all.
    """
    if len(chosen) != 1 or not probe(chosen[0].fit, error).names:
        return chosen
    freer = [each for each in forms_of(base, chosen[0].effect) if each.fit.chi2 < chosen[0].fit.chi2]
    complete = (each for each in freer if not probe(each.fit, error).names)
    enough = MOST_OF_IT * (base.chi2 - base.freedom * error.scale)
    better = (each for each in freer if each.gain > enough and bic(each) < bic(chosen[0]) - STRONG)
    return [next(complete, None) or next(better, chosen[0])]


def _fewer(chosen: list[Candidate], base: Fit, error: PureError) -> list[Candidate]:
    """Drop one of three effects that overlap, if the two others stand apart and leave no more than noise."""
    if len(chosen) < MOST or stand_apart(chosen, base):
        return chosen
    pairs = [refined([other for other in chosen if other is not each], base, alone=True) for each in chosen]
    sound = [each for each in pairs if is_noise(together(base, each), error) and stand_apart(each, base)]
    return min(sound, key=lambda each: together(base, each).bic, default=chosen)


def stand_apart(chosen: Sequence[Candidate], base: Fit) -> bool:
    """Whether several effects share less than half of what they explain together.

    If two effects each explain nearly all, and share most of it, they may both imitate a third effect. Effects that are
    proven by readings which the other effects do not change are certain, and are not counted.
    """
    if len(chosen) < 2:
        return True
    final = together(base, chosen)
    without = [together(base, [other for other in chosen if other is not each]) for each in chosen]
    shown = [
        is_shown_apart(each, [beside.term for beside in chosen if beside is not each], other, final)
        for each, other in zip(chosen, without, strict=True)
    ]
    if len(chosen) - sum(shown) < 2:
        return True
    certain = together(base, list(compress(chosen, shown)))
    own = sum(other.chi2 - final.chi2 for other, is_shown in zip(without, shown, strict=True) if not is_shown)
    return own > HALF * (certain.chi2 - final.chi2)


def _with_shown_apart(main: Candidate, chosen: Sequence[Candidate], base: Fit, error: PureError) -> list[Candidate]:
    """Return the effect that explains nearly all, and others that show in readings which this effect does not change.

    Keep all of these further effects if the fit leaves only noise. Otherwise keep only those that readings of black
    show: in other readings they may fit the residual that the main effect's formula leaves.
    """
    pairs = [(each, together(base, [main, each])) for each in chosen if each.effect.name != main.effect.name]
    shown = [each for each, both in pairs if is_shown_apart(each, [main.term], main.fit, both)]
    if shown:
        kept = refined([main, *shown], base)
        final = together(base, kept)
        if leaves_only_noise(final, error):
            return kept
    dark = [each for each, both in pairs if is_shown_apart(each, [main.term], main.fit, both, in_the_dark=True)]
    return refined([main, *dark], base)


def _sufficient_alone(
    chosen: Sequence[Candidate], final: Fit, first: Sequence[Family], base: Fit, error: PureError
) -> list[Family]:
    """Return the families that each explain nearly all of a misfit alone, best first.

    The list is empty if several effects make a sound finding. In all other cases the further effects fit only the
    residual of the main effect's formula, which is approximate.
    """
    if len(chosen) < 2:
        return []
    left, apart = free_term(final, error), stand_apart(chosen, base)
    if is_noise(final, error) and not left.names and apart:
        return []
    if apart and all(ages_light(each.effect) for each in chosen) and explain_together(final, first, error):
        return []
    whole = base.chi2 - final.chi2 + left.gain
    sufficient = [each for each in first if each.best.gain > MOST_OF_IT * whole]
    if sufficient and apart:
        # If the other effects explain nearly all of the residual of the main effect, they are a finding, however small.
        others = sufficient[0].best.fit.chi2 - final.chi2
        missed = max(left.gain, final.chi2 - final.freedom * error.scale)
        if others > MOST_OF_IT * (others + missed):
            return []
    return sufficient
