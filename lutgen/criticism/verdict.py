"""The verdict: what the evidence allows to say, in one sentence, and what it does not."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.drift import doubt, drifts
from lutgen.criticism.families import condition_of, family_of
from lutgen.criticism.first_day import white_moved
from lutgen.criticism.imitation import Imitated, nearest, overlap
from lutgen.criticism.leftover import is_even, is_within_scatter
from lutgen.criticism.probes import Probed, free_term, probe
from lutgen.criticism.search import HALF, STRONG
from lutgen.criticism.session_light import more_light
from lutgen.criticism.shares import shares_of_delta_e
from lutgen.criticism.stepwise import MOST_OF_IT
from lutgen.criticism.tails import SLIP
from lutgen.criticism.weighing import Weighed, bends_curves, is_of_curves
from lutgen.numerals import percent

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.criticism.fit import Fit
    from lutgen.criticism.influence import Suspicion
    from lutgen.criticism.pure_error import PureError
    from lutgen.criticism.stepwise import Explanation, Step
    from lutgen.criticism.visibility import Visibility

#: Verdict → what it means.
VERDICTS = {
    "consistent": "nothing above the noise",
    "named": "one effect, and what remains is noise",
    "form": "the family is right, its simple formula is not",
    "one-of": "one of a set that these data cannot split, or one effect of the catalogue or another like it",
    "several": "more than one effect, each with its share",
    "unexplained": "something is there that no known effect explains",
    "measurement-problem": "the measurement moved, not the display",
}

#: Lines of readings that a remark names.
NAMED_LINES = 12

NO_PROBES = Probed()

AGREES = "Nothing is above the noise: the model agrees with these readings."

#: Said of a share of χ² where the mean ΔE2000 is not above that of noise.
NOT_SEEN = ", too little to show in the mean ΔE2000"

#: With tips alone the model cannot fail, and has not been tried.
NOTHING_COMPARED = (
    "Nothing was compared: these readings hold nothing but white and primaries, which any model agrees with."
)


@dataclass(frozen=True)
class Verdict:
    """A verdict.

    Attributes
    ----------
    name
        One of ``VERDICTS``.
    sentence
        The finding in plain words.
    effects
        What the finding names; for ``unexplained`` nothing.
    rivals
        Sets of effects that these data cannot tell apart.
    shares
        Effect → share of the excess of χ² that goes with it.
    shares_delta_e
        Effect → share of the excess mean ΔE2000 that goes with it.
    remarks
        What else a reader must know.

    """

    name: str
    sentence: str
    effects: tuple[str, ...] = ()
    rivals: tuple[tuple[str, ...], ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    shares_delta_e: Mapping[str, float] = field(default_factory=dict)


def pronounce(explanation: Explanation, error: PureError, seen: Sequence[Visibility], suspicion: Suspicion) -> Verdict:
    """Weigh a search."""
    blind = [each.effect for each in seen if not each.visible]
    remarks = _remarks(explanation, blind, suspicion)
    if suspicion.hours:
        at = " and ".join(f"{hour:g} h" for hour in suspicion.hours)
        sentence = (
            f"The measurement, not the display, moved: nearly all of the misfit sits at {at}, and other sessions after "
            f"{suspicion.hours[0]:g} h are sound. Check hour, patch order and instrument."
        )
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if suspicion.sentence:
        sentence = f"The measurement cannot be trusted: {suspicion.sentence}."
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if explanation.steps:
        found = _named(explanation, error, remarks)
    else:
        found = _nothing_named(explanation, error, suspicion, remarks)
    return _if_so(_or_unsteady(found, explanation), explanation)


def _or_unsteady(verdict: Verdict, explanation: Explanation) -> Verdict:
    """Doubt the measurement where luminance drifted within a session, and no effect is named."""
    sentence = doubt(explanation.base.problem, verdict.name)
    return replace(verdict, name="measurement-problem", sentence=sentence) if sentence else verdict


def _if_so(verdict: Verdict, explanation: Explanation) -> Verdict:
    """Make a verdict depend on the noise where nobody measured it."""
    noise = explanation.base.problem.noise
    if noise.source != "assumed" or verdict.name in {"consistent", "measurement-problem"}:
        return verdict
    condition = (
        f"If this meter's noise is at most twice {noise.relative:.2%} and {noise.floor_cd_m2:.2g} cd/m², which nothing "
        f"here tells: "
    )
    return replace(verdict, sentence=condition + verdict.sentence)


def _remarks(explanation: Explanation, blind: Sequence[str], suspicion: Suspicion) -> tuple[str, ...]:
    noise, remarks = explanation.base.problem.noise, []
    if noise.source == "assumed":
        remarks.append(
            f"Too few replicates: the noise is assumed, {noise.relative:.2%} and {noise.floor_cd_m2:.2g} cd/m². Repeat "
            f"readings three times, or give --instrument."
        )
    problem = explanation.base.problem
    if problem.foretells and problem.readings.metadata.get("luminance") == "held" and not problem.held:
        remarks.append(
            f"The file says that luminance is held, but white has changed by {white_moved(problem.readings):+.0%}: no "
            f"sensor held it, or the sensor had no reserve left. Luminance is taken as free."
        )
    remarks += [each.sentence() for each in drifts(problem)]
    if suspicion.rows:
        remarks.append(f"Left out, as other readings of the patch contradict them: {_lines(explanation, suspicion)}.")
    if slips := _weighed_down(explanation):
        remarks.append(f"Weighed down, since they stand alone: {slips}.")
    if blind:
        remarks.append(f"These data could not have seen: {', '.join(blind)}.")
    return tuple(remarks)


def _weighed_down(explanation: Explanation) -> str:
    """Name the readings that heavy tails make count for little, the first few of them by their lines."""
    problem = explanation.base.problem
    if problem.weights is None:
        return ""
    rows = [int(row) for row in problem.rows if problem.weights[row] < SLIP]
    more = f" and {len(rows) - NAMED_LINES} more" if len(rows) > NAMED_LINES else ""
    return f"{problem.readings.places(rows[:NAMED_LINES])}{more}" if rows else ""


def _lines(explanation: Explanation, suspicion: Suspicion) -> str:
    return explanation.base.problem.readings.places(suspicion.rows)


def _nothing_named(
    explanation: Explanation, error: PureError, suspicion: Suspicion, remarks: tuple[str, ...]
) -> Verdict:
    if suspicion.rows:
        sentence = (
            f"The measurement, not the display, moved: {_lines(explanation, suspicion)} cannot be right. "
            f"Nothing else is above the noise."
        )
        return Verdict("measurement-problem", sentence, remarks=remarks)
    base = explanation.base
    # As much as an effect must pay to be found.
    probed = probe(base, replace(error, squares=max(error.squares, error.allowance * error.freedom)))
    within = is_within_scatter(error, base)
    if within and not probed.names:
        compared = not base.problem.is_tip_anchor.all()
        return Verdict("consistent", _agrees(base) if compared else NOTHING_COMPARED, remarks=remarks)
    if not within and is_even(base) and not free_term(base, error).names:
        return _too_much_scatter(explanation, error, remarks)
    return _unexplained(explanation, remarks, probed)


def _agrees(base: Fit) -> str:
    """Say that nothing is found, and what whole sessions differ by, which no effect is named for."""
    more = more_light(base)
    cause = "A meter's gain does so, and the display's brightness"
    return f"Nothing is above the noise but the light of a whole session: {more}. {cause}." if more else AGREES


def _too_much_scatter(explanation: Explanation, error: PureError, remarks: tuple[str, ...]) -> Verdict:
    base = explanation.base
    usual = error.variance
    ratio = float(np.sqrt(base.chi2 / max(base.freedom, 1) / usual))
    sentence = (
        f"The readings scatter more than the noise model knows, {ratio:.2g} times as much as "
        f"{'their replicates' if error.measured else 'assumed'}, and evenly over colours, conditions and hours: no "
        f"effect of a display does so. Repeat white ten times in one session to measure the noise."
    )
    return Verdict("measurement-problem", sentence, remarks=remarks)


def _unexplained(explanation: Explanation, remarks: tuple[str, ...], probed: Probed = NO_PROBES) -> Verdict:
    nearest = explanation.first[0] if explanation.first else None
    tried = (
        f" The nearest effect, {nearest.name}, leaves {_left(nearest.best.fit.chi2, explanation):.0%} of it."
        if nearest
        else ""
    )
    sentence = (
        f"Something is there that no known effect explains: {structure(explanation, probed)}.{tried} "
        f"An effect of your own can be tried: lutgen refine --effects my_effect.py."
    )
    if more := more_light(explanation.base):
        asked = "Whether settings or the meter changed: lutgen sessions explain"
        remarks = (*remarks, f"Whole sessions differ in light: {more}. {asked}.")
    return Verdict("unexplained", sentence, remarks=remarks)


def _left(chi2: float, explanation: Explanation) -> float:
    base = explanation.base
    return max(chi2 - base.freedom, 0.0) / max(base.chi2 - base.freedom, 1e-9)


def structure(explanation: Explanation, probed: Probed = NO_PROBES) -> str:
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


def _named(explanation: Explanation, error: PureError, remarks: tuple[str, ...]) -> Verdict:
    """Say what the admitted effects prove."""
    steps, base = explanation.steps, explanation.base
    weighed = Weighed.of(explanation, error)
    if not weighed.kept and weighed.clean and is_within_scatter(error, base) and not weighed.nothing.names:
        traces = ", ".join(step.name for step in steps)
        remark = f"What is left would let {traces} explain a trace of it, next to nothing beside what the model has."
        return Verdict("consistent", _agrees(base), remarks=(*remarks, remark))
    probed = weighed.left if weighed.left.names else weighed.nothing
    # What explains no more than formulas may miss may be for what a formula of a curve misses.
    main = [step for step in steps if weighed.shares[step.name] > 1.0 - MOST_OF_IT]
    curves = len(steps) > 1 and weighed.explains and is_of_curves(main, weighed.shares, explanation.base)
    pair = weighed.sound and weighed.clean and len(weighed.kept) == 2
    if curves and not (pair and overlap([step.chosen for step in weighed.kept], base)):
        return replace(_bent(explanation, weighed), remarks=remarks)
    if not weighed.sound:
        return _unexplained(explanation, remarks, probed)
    kept, seen, trifles = weighed.kept, weighed.seen, [step.name for step in weighed.trifles]
    named = {*trifles, *(step.name for step in kept)}
    if beside := [step.name for step in steps if step.name not in named]:
        remarks = (*remarks, f"Fitted beside, for what the formula leaves, no fault of its own: {', '.join(beside)}.")
    if trifles:
        remarks = (*remarks, f"Fitted beside, next to nothing of the error: {', '.join(trifles)}.")
    left = "" if weighed.clean else f"its formula leaves something: {structure(explanation, weighed.left)}."
    if len(kept) == 1:
        left = left or ("its formula leaves something that another takes up." if beside or trifles else "")
        (step,) = kept
        size = f"{step.effect.in_words(step.chosen.term.values)}: {_excess(step, seen, weighed.shares)}"
        worded = _one(step, size, left, _owed(step, explanation), _imitated(step, explanation, error))
    elif (alike := overlap([step.chosen for step in kept], base)) and weighed.clean and len(kept) == 2:
        worded = _like_both(kept)
    elif (
        alike
        or _is_shadowed(kept, explanation, error)
        # Three that leave something are what a search makes of an effect that it lacks.
        or (len(kept) > 2 and not weighed.clean)
    ):
        return _unexplained(explanation, remarks, probed)
    else:
        worded = _several(kept, weighed.shares, seen, left)
    return replace(worded, shares=weighed.shares, shares_delta_e=seen, remarks=remarks)


def _is_shadowed(kept: tuple[Step, ...], explanation: Explanation, error: PureError) -> bool:
    """Whether one of several effects may be what the strongest one misses: its form passes for another as strong."""
    strongest = max(kept, key=lambda step: step.without.chi2)
    alike = (_imitated(step, explanation, error) for step in kept if step is not strongest)
    return any(each and each.left < 2 * STRONG for each in alike)


def _bent(explanation: Explanation, weighed: Weighed) -> Verdict:
    """Name the effect that explains most of a curve that changed, where others take up what its formula misses."""
    base, final = explanation.base, explanation.final
    own = {step.name: step.without.chi2 - final.chi2 for step in explanation.steps if bends_curves(step.effect)}
    first, *others = sorted(explanation.steps, key=lambda step: -own.get(step.name, 0.0))
    names = (first.name, *(step.name for step in others if own.get(step.name, 0.0) > HALF * own[first.name]))
    seen = shares_of_delta_e(base, final, [step.name for step in explanation.steps])
    sentence = (
        f"Curves have changed as by {' or '.join(names)}, or by an effect like it that the catalogue lacks: "
        f"{first.effect.in_words(first.chosen.term.values)}. What its formula misses, "
        f"{' and '.join(step.name for step in others)} take{'' if len(others) > 1 else 's'} up."
    )
    return Verdict("one-of", sentence, names, shares=weighed.shares, shares_delta_e=seen)


def _like_both(steps: tuple[Step, ...]) -> Verdict:
    """Name two effects of which one does in part what the other's form could do as well: both follow one effect."""
    one, other = (step.name for step in steps)
    sentence = (
        f"One effect is missing that is like {one} and like {other}: both together fit, and one does in part what the "
        f"other's form could do as well."
    )
    return Verdict("one-of", sentence, (one, other))


def _imitated(step: Step, explanation: Explanation, error: PureError) -> Imitated | None:
    """Return the effect that a finding's form follows best, where no rival says already what it may be."""
    return None if step.rivals else nearest(step, explanation.final, error.scale)


def _several(steps: tuple[Step, ...], shares: Mapping[str, float], seen: Mapping[str, float], left: str) -> Verdict:
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


def _excess(step: Step, seen: Mapping[str, float], shares: Mapping[str, float]) -> str:
    """How much of the excess error goes with an effect: of the mean ΔE2000, of χ² where that shows no excess."""
    if any(seen.values()):
        return f"{percent(seen[step.name])} of the excess error"
    return f"{percent(shares[step.name])} of the excess χ²{NOT_SEEN}"


def _one(step: Step, size: str, left: str, owed: float, alike: Imitated | None) -> Verdict:
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


def _owed(step: Step, explanation: Explanation) -> float:
    """Share of what an effect's form explains, in χ², that its simplest form explains alone."""
    gains = [family.simple.gain for family in explanation.first if family.name == step.name]
    whole = explanation.base.chi2 - explanation.final.chi2
    return gains[0] / whole if gains and whole > 0 else 1.0


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
