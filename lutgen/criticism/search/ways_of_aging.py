"""Several mechanisms that age the light at once, from the first hour.

Real displays usually have several aging mechanisms, and their readings are hard to tell apart. The formula of an effect
with several amplitudes, such as three rates of three channels, also fits the residual that the formulas of other
mechanisms leave. So BIC prefers it, although two effects of one amplitude each explain the readings as well.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from lutgen.criticism.compare.comparison import CLEAR
from lutgen.criticism.search.candidates import HALF, MOST_OF_IT, STRONG, contenders
from lutgen.criticism.search.explanation import EVENLY, ages_light, only_dims, together, typical
from lutgen.criticism.search.forms import simple_forms
from lutgen.criticism.search.free_term import leaves_only_noise

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.candidates import Candidate, Family
    from lutgen.effects import Effect

    #: Choose the forms of several candidates again, each with the others present.
    Refine = Callable[[list[Candidate], Fit], list[Candidate]]


def explain_together(final: Fit, first: Sequence[Family], error: PureError) -> bool:
    """Whether ``final``, with several aging mechanisms, explains the readings, although no effect alone does."""
    most = min(HALF * first[0].best.fit.chi2, CLEAR**2 * final.freedom * error.scale)
    return final.problem.from_first_hour and final.chi2 < most


def light_alone(chosen: list[Candidate], base: Fit, first: Sequence[Family], error: PureError) -> list[Candidate]:
    """Leave out effects of the instrument if several effects that age the light explain the readings without them."""
    light = [each for each in chosen if ages_light(each.effect)]
    are_of_instrument = all(each.effect.stage == "instrument" for each in chosen if each not in light)
    if not are_of_instrument or not 1 < len(light) < len(chosen):
        return chosen
    return light if explain_together(together(base, light), first, error) else chosen


def even_fading(chosen: Sequence[Candidate], base: Fit, first: Sequence[Family]) -> list[Family]:
    """Return effects that dim all colours alike at typical sizes, in place of one that does so only as fitted.

    The best effect is first. The list is empty if ``chosen`` is no such single effect, or if no effect that always dims
    evenly explains half as much. An effect that changes colours, such as the wear of phosphors, fits an even fading if
    its parts fade alike. With more shapes of its course it may even fit better.
    """
    if not base.problem.from_first_hour or len(chosen) != 1:
        return []
    (each,) = chosen
    whole = each.fit
    if not only_dims(base, whole, each.term, EVENLY) or only_dims(base, whole, typical(each.effect)):
        return []
    enough = HALF * each.gain
    return [family for family in first if family.best.gain > enough and only_dims(base, whole, typical(family.effect))]


def of_one_size(
    chosen: Sequence[Candidate], base: Fit, first: Sequence[Family], error: PureError, refine: Refine
) -> list[Candidate]:
    """Return two effects with one amplitude each that fit as well as ``chosen``, which has several amplitudes.

    One effect alone takes the place of several if it fits as well, and they explain at most 5 % more than it.

    The list is empty if there are no such effects, if no effect of ``chosen`` has several amplitudes, or if one effect
    leaves only noise. Each of the two effects must be clearly needed. Both together must leave less than twice the χ²
    that ``chosen`` leaves; if ``chosen`` is a single effect, their BIC must be clearly lower.
    """
    is_aging = base.problem.from_first_hour and all(ages_light(each.effect) for each in chosen)
    if not is_aging or not any(_sizes(each.effect) > 1 for each in chosen):
        return []
    final = together(base, chosen)
    if len(chosen) == 1 and leaves_only_noise(final, error):
        return []
    most = min(2.0 * final.chi2, CLEAR**2 * final.freedom * error.scale)
    simple = [each for each in first if ages_light(each.effect) and _sizes(each.effect) == 1]
    alone = [each for each in simple if len(chosen) > 1 and each.best.fit.chi2 < most]
    if alone and alone[0].best.fit.chi2 - final.chi2 < (1.0 - MOST_OF_IT) * alone[0].best.gain:
        return [alone[0].best]
    pairs: list[tuple[Fit, list[Candidate]]] = []
    limit = most + final.bic - final.chi2  # with no more parameters than ``chosen``
    for one, other in combinations(sorted(simple, key=lambda each: each.best.fit.bic), 2):
        beside = contenders(one.best.fit, [other.effect], limit)
        if not beside:
            continue
        pair = refine([one.best, beside[0].best], base)
        both = together(base, pair)
        is_clear = all(together(base, [each]).bic > both.bic + STRONG for each in pair)
        if is_clear and both.chi2 < most and (len(chosen) > 1 or both.bic < final.bic - STRONG):
            pairs.append((both, pair))
    # Formulas of related effects differ little: of the pairs that are nearly tied, return the one with the simplest
    # effects.
    near = min((both.bic for both, _ in pairs), default=0.0) + 2.0 * STRONG
    tied = [pair for both, pair in pairs if both.bic < near]
    return min(tied, key=lambda pair: sum(len(each.effect.forms[0]) for each in pair), default=[])


def _sizes(effect: Effect) -> int:
    """Return the number of amplitudes that are free in the simple forms of an effect."""
    return len({name for form in simple_forms(effect) for name in form if name in effect.neutral})
