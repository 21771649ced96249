"""Another effect in place of those that a search admitted: one for several of its kind, or one inside its limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.criticism.compare.comparison import CLEAR
from lutgen.criticism.search.candidates import MOST_OF_IT, STRONG, bic, forms_of
from lutgen.criticism.search.explanation import ages_light, changes_colours, together
from lutgen.criticism.search.free_term import leaves_only_noise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.candidates import Candidate, Family
    from lutgen.effects import Effect

#: An effect is no rival of the best one if it leaves this many times more χ² beyond noise.
FAR_MORE = 10.0


def one_for_several(
    chosen: Sequence[Candidate], effects: Sequence[Effect], base: Fit, error: PureError
) -> list[Candidate]:
    """Return one effect that leaves only noise and can replace several of its kind: two that leave more, or three.

    Any form of the effect with no more parameters than the several effects is allowed, also one whose formula does not
    explain half. The list is empty if there is no such effect.
    """
    kinds = (changes_colours, ages_light)
    kind = next((kind for kind in kinds if all(kind(each.effect) for each in chosen)), None)
    final = together(base, chosen)
    if len(chosen) < 2 or not kind or (len(chosen) == 2 and leaves_only_noise(final, error)):
        return []
    alone = [each for effect in effects if kind(effect) for each in forms_of(base, effect, freely=True)[:1]]
    fewer = [each for each in alone if each.fit.parameters <= final.parameters and bic(each) < final.bic - STRONG]
    better = [each for each in fewer if leaves_only_noise(each.fit, error)]
    return [min(better, key=bic)] if better else []


def near_the_best(families: Sequence[Family], error: PureError) -> list[Family]:
    """Return the families that each explain nearly all of a misfit, without those that leave far more than the best.

    ``families``: best first. Far more is clearly more than noise, and ``FAR_MORE`` times what the best leaves.
    """
    if not families:
        return []
    best = families[0].best.fit
    noise = best.freedom * error.scale
    most = max(CLEAR**2 * noise, noise + FAR_MORE * (best.chi2 - noise))
    return [each for each in families if each.best.fit.chi2 <= most]


def inside_limits(chosen: Sequence[Candidate], first: Sequence[Family]) -> list[Family]:
    """Return families inside their physical limits that explain as much as a single effect at its limit.

    The first family takes the place of the effect. The others, with the effect's own family, are its rivals. The list
    is empty if the effect is inside its limits, or if no other family explains nearly as much inside its limits.
    """
    if len(chosen) != 1 or not chosen[0].is_at_limit:
        return []
    enough = MOST_OF_IT * chosen[0].gain
    inside = [each for each in first if each.best.gain > enough and not each.best.is_at_limit]
    own = [each for each in first if each.effect is chosen[0].effect and each not in inside]
    return [*inside, *own] if inside else []
