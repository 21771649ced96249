"""The verdict: what the evidence allows to say, in one sentence, and what it does not."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.families import condition_of, family_of
from lutgen.criticism.first_day import white_moved
from lutgen.criticism.imitation import Imitated, nearest, overlap
from lutgen.criticism.leftover import is_even, is_noise, is_within_scatter
from lutgen.criticism.probes import Probed, free_term, probe
from lutgen.criticism.search import HALF, STRONG
from lutgen.criticism.shares import shares_of_delta_e
from lutgen.criticism.stepwise import MOST_OF_IT, stand_apart, together
from lutgen.criticism.tails import SLIP
from lutgen.numerals import percent

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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

#: Shares of the excess error below this are printed as 0 %: an effect of both is no finding beside others.
TRIFLE = 0.005

NO_PROBES = Probed()

AGREES = "Nothing is above the noise: the model agrees with these readings."

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
            f"The measurement, not the display, moved: nearly all of the misfit sits at {at}, and later readings are "
            f"sound again. Check hour, patch order and instrument of that session."
        )
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if suspicion.sentence:
        sentence = f"The measurement cannot be trusted: {suspicion.sentence}."
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if not explanation.steps:
        return _if_so(_nothing_named(explanation, error, suspicion, remarks), explanation)
    return _if_so(_named(explanation, error, remarks), explanation)


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
            f"No replicates: the noise is assumed, {noise.relative:.2%} and {noise.floor_cd_m2:.2g} cd/m². Repeat "
            f"readings three times, or give --instrument."
        )
    problem = explanation.base.problem
    if problem.foretells and problem.readings.metadata.get("luminance") == "held" and not problem.held:
        remarks.append(
            f"The file says that luminance is held, but white has changed by {white_moved(problem.readings):+.0%}: no "
            f"sensor held it, or the sensor had no reserve left. Luminance is taken as free."
        )
    if suspicion.rows:
        remarks.append(f"Left out: {_lines(explanation, suspicion)}, which contradict their own replicates or kin.")
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
    probed = probe(explanation.base, error)
    base = explanation.base
    within = is_within_scatter(error, base)
    if within and not probed.names:
        compared = not base.problem.is_anchor.all()
        return Verdict("consistent", AGREES if compared else NOTHING_COMPARED, remarks=remarks)
    if not within and is_even(base) and not free_term(base, error).names:
        return _too_much_scatter(explanation, error, remarks)
    return _unexplained(explanation, remarks, probed)


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
    size = (found.linear.residual**2).sum(axis=1) / 3.0
    family, condition = family_of(problem), condition_of(problem)
    named = np.where(condition == "", family, condition)
    share = {str(name): float(np.maximum(size[named == name] - 1.0, 0.0).mean()) for name in np.unique(named)}
    worst = max(share, key=lambda name: share[name])
    hours = [float(size[problem.hour_of == hour].mean()) for hour in range(problem.hours.size)]
    late = np.corrcoef(problem.hours, hours)[0, 1] if len(hours) > 2 and np.ptp(hours) > 0 else 0.0
    course = "growing with the hours" if late > 0.6 else "at all hours alike" if late > -0.3 else "more in early hours"
    return worst, course


def _needed(
    explanation: Explanation, error: PureError, shares: Mapping[str, float], nothing: Probed, beside_all: float
) -> tuple[Step, ...]:
    """Admitted effects without which the readings are clearly less likely, whatever a free term takes over.

    A formula that does not quite fit leaves something that looks like the effects that its own is confused with. Beside
    a free term such shadows are superfluous, and a fault of its own is not; where the effect is strong, its shadows are
    too, in proportion to it. ``nothing`` is the free term beside the base alone; ``beside_all`` is BIC with all effects
    and a free term.
    """
    kept = []
    for step in explanation.steps:
        kin = [term.effect.name for term in step.without.terms if step.effect.is_kin(term.effect)]
        largest = max((shares[name] for name in kin if name in shares), default=0.0)
        probed = nothing if step.without is explanation.base else probe(step.without, error)
        free = step.without.bic - probed.evidence
        if free > beside_all + STRONG and shares[step.name] > (1.0 - MOST_OF_IT) * largest:
            kept.append(step)
    return tuple(kept)


def _is_at_its_limit(step: Step) -> bool:
    """Whether a size of an effect lies at a bound of what is physical, other than where the effect does nothing."""
    term = step.chosen.term
    for name in set(term.free) & set(step.effect.neutral):
        low, high = step.effect.parameters[name].bounds
        reach = 1e-9 * (high - low)
        value = term.values[name]
        if min(value - low, high - value) <= reach < abs(value - step.effect.neutral[name]):
            return True
    return False


def _named(explanation: Explanation, error: PureError, remarks: tuple[str, ...]) -> Verdict:
    """Compare, by BIC, the named effects, a free term that no formula describes, and both together."""
    steps, base, final = explanation.steps, explanation.base, explanation.final
    excess = max(base.chi2 - base.freedom * error.scale, base.chi2 - final.chi2, 1e-9)
    shares, before = {}, base.chi2
    for step, found in zip(steps, explanation.trail, strict=True):
        shares[step.name], before = max(before - found.chi2, 0.0) / excess, found.chi2
    nothing, probed = probe(base, error), free_term(final, error)
    both = final.bic - probed.evidence
    kept = _needed(explanation, error, shares, nothing, both)
    clean = is_noise(final, error) and not probed.names
    if not kept and clean and is_within_scatter(error, base) and not nothing.names:
        traces = ", ".join(step.name for step in steps)
        remark = f"What is left would let {traces} explain a trace of it, next to nothing beside what the model has."
        return Verdict("consistent", AGREES, remarks=(*remarks, remark))
    gain = base.chi2 - final.chi2
    explained = gain / (gain + probed.gain) if probed.names else gain / excess
    # One family may leave what its formula misses; several that leave a misfit are what greedy search makes of another.
    enough = explained > MOST_OF_IT and (len(kept) == 1 or is_noise(final, error))
    physical = not any(_is_at_its_limit(step) for step in kept)
    chosen = [step.chosen for step in kept]
    # What is fitted beside, for what formulas leave, may be no more than formulas may leave.
    beside = [step.name for step in steps if step not in kept]
    whole = not beside or together(base, chosen).chi2 - final.chi2 <= (1.0 - MOST_OF_IT) * gain
    sound = (clean or enough) and whole and physical and stand_apart(chosen, base)
    if not kept or base.bic - nothing.evidence < both - STRONG or not sound:
        return _unexplained(explanation, remarks, probed if probed.names else nothing)
    if beside:
        remarks = (*remarks, f"Fitted beside, for what the formula leaves, no fault of its own: {', '.join(beside)}.")
    left = "" if clean else f"its formula leaves something: {structure(explanation, probed)}."
    seen = shares_of_delta_e(base, final, [step.name for step in kept])
    kept = tuple(sorted(kept, key=lambda step: -seen[step.name]))
    if trifles := [step for step in kept[1:] if max(seen[step.name], shares[step.name]) < TRIFLE]:
        kept = tuple(step for step in kept if step not in trifles)
        beside += [step.name for step in trifles]
        names = ", ".join(step.name for step in trifles)
        remarks = (*remarks, f"Fitted beside, next to nothing of the error: {names}.")
    alike = {step.name: _imitated(step, explanation, error) for step in kept}
    strongest = max(kept, key=lambda step: step.without.chi2)
    passes = any(each and each.left < 2 * STRONG for name, each in alike.items() if name != strongest.name)
    if passes or (len(kept) > 1 and overlap([step.chosen for step in kept], base)):
        # Of several, one whose form passes for another effect as strong as itself may be what the strongest one misses.
        return _unexplained(explanation, remarks, probed if probed.names else nothing)
    if len(kept) > 1:
        worded = _several(kept, shares, seen, left)
    else:
        left = left or ("its formula leaves something that another takes up." if beside else "")
        (step,) = kept
        worded = _one(step, seen[step.name], left, alike[step.name])
    return replace(worded, shares=shares, shares_delta_e=seen, remarks=remarks)


def _imitated(step: Step, explanation: Explanation, error: PureError) -> Imitated | None:
    """Return the effect that a finding's form follows best, where no rival says already what it may be."""
    return None if step.rivals else nearest(step, explanation.final, error.scale)


def _several(steps: tuple[Step, ...], shares: Mapping[str, float], seen: Mapping[str, float], left: str) -> Verdict:
    """Name several effects; ``left`` says what their formulas leave."""
    names = tuple(step.name for step in steps)
    rivals = tuple((step.name, *(rival.name for rival in step.rivals)) for step in steps if step.rivals)
    listed = ", ".join(
        f"{step.name} ({step.effect.in_words(step.chosen.term.values)}; {percent(seen[step.name])} of the excess "
        f"mean ΔE2000, {percent(shares[step.name])} of the excess χ²)"
        for step in steps
    )
    sentence = f"More than one effect is missing: {listed}{'; ' + left.replace('its', 'one', 1) if left else '.'}"
    return Verdict("several", sentence, names, rivals)


def _one(step: Step, seen: float, left: str, alike: Imitated | None) -> Verdict:
    """Name one effect; ``left`` says what its formula leaves, ``alike`` which other effect its form follows best."""
    names = (step.name,)
    size = f"{step.effect.in_words(step.chosen.term.values)}: {percent(seen)} of the excess error"
    if step.rivals:
        either = (step.name, *(rival.name for rival in step.rivals))
        sentence = (
            f"One effect is missing, and these data cannot tell which: {' or '.join(either)}. If it is {step.name}, "
            f"{size}."
        )
        return Verdict("one-of", sentence, either, (either,))
    freed = ", ".join(step.chosen.form)
    if alike and (alike.left < 2 * STRONG or (step.chosen.refined and alike.share < HALF)):
        form = f"The form that fits ({freed} free)" if step.chosen.refined else "Its formula"
        sentence = (
            f"{step.name} is missing, or an effect like it that the catalogue lacks: {size}. {form} could also "
            f"pass for most of {alike.name}."
        )
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
