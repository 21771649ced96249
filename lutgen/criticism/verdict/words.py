"""The sentence of a verdict that names effects, and the place of a residual in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.families import condition_of, family_of
from lutgen.criticism.search.candidates import HALF, STRONG
from lutgen.criticism.search.free_term import FreeTerm
from lutgen.criticism.verdict.verdict import Verdict
from lutgen.numerals import percent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.criticism.search.stepwise import Explanation, Step
    from lutgen.criticism.verdict.imitation import Imitated

NO_PROBES = FreeTerm()

#: Said of a share of χ² where the mean ΔE2000 is not above that of noise.
NOT_SEEN = ", too little to show in the mean ΔE2000"


def structure(explanation: Explanation, probed: FreeTerm = NO_PROBES) -> str:
    """Where the leftover of the final fit sits, in words: family or condition, hours."""
    worst, course = strongest(explanation)
    follows = f"; it follows {' and '.join(probed.names[:2])}" if probed.names else ""
    return f"it is strongest in the readings called '{worst}', {course}{follows}"


def strongest(explanation: Explanation) -> tuple[str, str]:
    """Name the family or condition in which most of the final fit's leftover sits, and its course over the hours."""
    found = explanation.final
    problem = found.problem
    size = (found.residual**2).sum(axis=1) / 3.0
    family, condition = family_of(problem), condition_of(problem)
    named = np.where(condition == "", family, condition)
    share = {str(name): float(np.maximum(size[named == name] - 1.0, 0.0).mean()) for name in np.unique(named)}
    worst = max(share, key=lambda name: share[name])
    hours = [float(size[problem.hour_of == hour].mean()) for hour in range(problem.hours.size)]
    late = np.corrcoef(problem.hours, hours)[0, 1] if np.ptp(hours) > 0 else 0.0
    course = "growing with the hours" if late > 0.6 else "at all hours alike" if late > -0.3 else "more in early hours"
    return worst, course


def like_both(steps: tuple[Step, ...]) -> Verdict:
    """Name two effects of which one does in part what the other's form could do as well: both follow one effect."""
    one, other = (step.name for step in steps)
    sentence = (
        f"One effect is missing that is like {one} and like {other}: both together fit, and one does in part what the "
        f"other's form could do as well."
    )
    return Verdict("one-of", sentence, (one, other))


def several(steps: tuple[Step, ...], shares: Mapping[str, float], seen: Mapping[str, float], left: str) -> Verdict:
    """Name several effects; ``left`` says what their formulas leave."""
    names = tuple(step.name for step in steps)
    rivals = tuple((step.name, *(rival.name for rival in step.rivals)) for step in steps if step.rivals)
    both = any(seen.values())
    listed = ", ".join(
        f"{step.name} ({step.effect.in_words(step.chosen.term.values)}; "
        f"{f'{percent(seen[step.name])} of the excess mean ΔE2000, ' if both else ''}"
        f"{percent(shares[step.name])} of the excess χ²)"
        for step in steps
    )
    sentence = (
        f"More than one effect is missing{'' if both else NOT_SEEN}: {listed}"
        f"{'; ' + left.replace('its', 'one', 1) if left else '.'}"
    )
    return Verdict("several", sentence, names, rivals)


def excess(step: Step, seen: Mapping[str, float], shares: Mapping[str, float]) -> str:
    """How much of the excess error goes with an effect: of the mean ΔE2000, of χ² where that shows no excess."""
    if any(seen.values()):
        return f"{percent(seen[step.name])} of the excess error"
    return f"{percent(shares[step.name])} of the excess χ²{NOT_SEEN}"


def one(step: Step, size: str, left: str, owed: float, alike: Imitated | None) -> Verdict:
    """Name one effect.

    ``size`` says in words how large it is, ``left`` what its formula leaves, ``owed`` how much of what its form
    explains the effect's simplest form does, ``alike`` which other effect its form follows best.
    """
    names = (step.name,)
    if step.rivals:
        either = (step.name, *(rival.name for rival in step.rivals))
        sentence = (
            f"One effect is missing, and these data cannot tell which: {' or '.join(either)}. If it is {step.name}, "
            f"{size}."
        )
        return Verdict("one-of", sentence, either, (either,))
    freed = ", ".join(step.chosen.form)
    if doubt := _doubt(step, freed, owed, alike):
        sentence = f"{step.name} is missing, or an effect like it that the catalogue lacks: {size}. {doubt}"
        return Verdict("one-of", sentence, names)
    if step.chosen.refined:
        sentence = (
            f"{step.name} is missing, but not in its simple form: {freed} had to be free. {size[0].upper()}{size[1:]}."
        )
        return Verdict("form", sentence, names)
    if left:
        sentence = f"{step.name} is missing ({size}), but {left}"
        return Verdict("form", sentence, names)
    return Verdict("named", f"{step.name} is missing: {size}. With it, what remains is noise.", names)


def _doubt(step: Step, freed: str, owed: float, alike: Imitated | None) -> str:
    """Why a form that fits does not prove its effect; nothing where it does."""
    form = f"The form that fits ({freed} free)" if step.chosen.refined else "Its formula"
    if alike and (alike.left < 2 * STRONG or (step.chosen.refined and alike.share < HALF)):
        return f"{form} could also pass for most of {alike.name}."
    if at_bounds := _at_bounds(step):
        return f"{form} has {' and '.join(at_bounds)} at the limit of what may be."
    if step.chosen.refined and owed < HALF:
        return (
            f"{form} owes most to its freedom: the effect's simplest form explains {percent(max(owed, 0.0))} of that."
        )
    return ""


def _at_bounds(step: Step) -> list[str]:
    """Free shapes of an effect, as of its course in time, that lie at a bound."""
    term = step.chosen.term
    shapes = [name for name in term.free if name not in term.effect.neutral]
    return [name for name in shapes if term.effect.parameters[name].is_at_bound(term.values[name])]
