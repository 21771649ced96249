"""The decision: which verdict the evidence of a search supports."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.compare.comparison import CLEAR
from lutgen.criticism.compare.drift import drift_problem
from lutgen.criticism.fit.lack_of_fit import is_even, is_within_scatter
from lutgen.criticism.search.candidates import HALF, MOST_OF_IT, STRONG
from lutgen.criticism.search.explanation import ages_light, bends_curves, left_of_excess, unexplained_fit
from lutgen.criticism.search.free_term import IN_ORDER, FreeTerm, change_in_order, free_term, leaves_only_noise, probe
from lutgen.criticism.search.influence import WORST_INSTRUMENT
from lutgen.criticism.verdict import black
from lutgen.criticism.verdict.imitation import Imitated, assumes_held_luminance, nearest, overlap, unproved
from lutgen.criticism.verdict.remarks import lines_of, of_other_forms, remarks_of
from lutgen.criticism.verdict.verdict import Verdict
from lutgen.criticism.verdict.weighing import (
    Weighed,
    evidence_against,
    is_changed_curve,
    share_of_simplest,
    shares_of_delta_e,
)
from lutgen.criticism.verdict.words import NO_FREE_TERM, clause, excess, like_both, more_light, one, several, structure
from lutgen.errors import listed
from lutgen.numerals import in_percent, percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.explanation import Explanation, Step
    from lutgen.criticism.search.influence import Suspicion
    from lutgen.criticism.verdict.visibility import Visibility

#: The objection to a rounding behind unknown calibration tables.
JAGGED = "Each code value is shifted by a different part of a step, as behind a calibration table that the file lacks."

AGREES = "Nothing is above the noise: the model agrees with these readings."

#: If the readings hold tips only, the model cannot fail, and nothing was tested.
NOTHING_COMPARED = (
    "Nothing was compared: these readings hold nothing but white and primaries, which any model agrees with."
)


def pronounce(explanation: Explanation, error: PureError, seen: Sequence[Visibility], suspicion: Suspicion) -> Verdict:
    """Return the verdict of a search."""
    named = {name for step in explanation.steps for name in (step.name, *(rival.name for rival in step.rivals))}
    if not explanation.steps and black.is_beyond_zero(explanation.base.problem):
        named.update(black.CAUSES)
    blind = [each.effect for each in seen if not each.visible and each.effect not in named]
    remarks = remarks_of(explanation, blind, suspicion)
    if suspicion.hours:
        at = listed(f"{hour:g} h" for hour in suspicion.hours)
        sentence = (
            f"The fault is in the measurement, not in the display: nearly all of the misfit is at {at}, and other "
            f"sessions after {suspicion.hours[0]:g} h are sound. Check hour, patch order and instrument."
        )
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if suspicion.sentence:
        sentence = f"The measurement cannot be trusted: {suspicion.sentence}."
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if explanation.steps:
        verdict = _with_steps(explanation, error, suspicion, remarks)
    else:
        verdict = black.or_leak(_without_steps(explanation, error, suspicion, remarks), explanation.base.problem)
    return _under_assumed_noise(_or_drift(verdict, explanation), explanation)


def _or_drift(verdict: Verdict, explanation: Explanation) -> Verdict:
    """Blame the measurement if luminance drifted within a session and no effect is named."""
    sentence = drift_problem(explanation.base.problem, verdict.name)
    return replace(verdict, name="measurement-problem", sentence=sentence) if sentence else verdict


def _under_assumed_noise(verdict: Verdict, explanation: Explanation) -> Verdict:
    """State the assumed noise as a condition of the verdict if nobody measured the noise."""
    noise = explanation.base.problem.noise
    if noise.source != "assumed" or verdict.name in {"consistent", "measurement-problem"}:
        return verdict
    condition = (
        f"These readings do not show the noise of the meter. If it is at most twice "
        f"{in_percent(noise.relative, 2)} and {noise.floor_cd_m2:.2g} cd/m², "
    )
    sentence = condition + verdict.sentence[0].lower() + verdict.sentence[1:]
    return replace(verdict, sentence=sentence)


def _without_steps(
    explanation: Explanation, error: PureError, suspicion: Suspicion, remarks: tuple[str, ...]
) -> Verdict:
    """Return the verdict of a search that has admitted no effect."""
    base = explanation.base
    # The free term is judged under the same noise as an effect.
    residual_term = probe(base, replace(error, squares=max(error.squares, error.allowance * error.freedom)))
    within = is_within_scatter(error, base)
    agrees = within and not residual_term.names
    if suspicion.rows:
        fault, rest = "The fault is in the measurement, not in the display", "Nothing else is above the noise"
        if not agrees:
            fault = "A fault is in the measurement"
            rest = f"The others hold an error that no known effect explains: {structure(base, residual_term)}"
        sentence = f"{fault}: other readings contradict {lines_of(explanation, suspicion)}. {rest}."
        return Verdict("measurement-problem", sentence, remarks=remarks)
    if agrees:
        compared = not base.problem.is_tip_anchor.all()
        return Verdict("consistent", _agrees(base) if compared else NOTHING_COMPARED, remarks=remarks)
    if residual_term.names == (IN_ORDER,):
        change = in_percent(change_in_order(base), 1, signed=True)
        sentence = (
            f"The fault is in the measurement: light changes by {change} from the first to the last reading of a "
            f"session, in the order of reading. No other pattern is above the noise. Let the meter and the display "
            f"warm up, and measure again."
        )
        return Verdict("measurement-problem", sentence, remarks=remarks)
    ratio = float(np.sqrt(base.chi2 / max(base.freedom, 1) / error.variance))
    is_plausible = ratio * base.problem.noise.relative < WORST_INSTRUMENT
    if not within and is_plausible and is_even(base) and not free_term(base, error).names:
        return _too_much_scatter(explanation, ratio, error, remarks)
    return _unexplained(explanation, remarks, residual_term, within=within)


def _agrees(base: Fit) -> str:
    """Say that nothing is above the noise, except a difference in light between sessions, which names no effect."""
    more = more_light(base)
    cause = "The meter's gain or the display's brightness may have changed"
    return f"Nothing is above the noise except the light of a whole session: {more}. {cause}." if more else AGREES


def _too_much_scatter(explanation: Explanation, ratio: float, error: PureError, remarks: tuple[str, ...]) -> Verdict:
    more = more_light(explanation.base)
    readings = f"Whole sessions differ in light: {more}. Beside this, the readings" if more else "The readings"
    sentence = (
        f"{readings} scatter {ratio:.2g} times as much as {'their replicates' if error.measured else 'assumed'}, and "
        f"do so evenly over colours, conditions and hours: no effect of a display does this. Repeat white ten times in "
        f"one session to measure the noise."
    )
    return Verdict("measurement-problem", sentence, remarks=remarks)


def _unexplained(
    explanation: Explanation,
    remarks: tuple[str, ...],
    residual_term: FreeTerm = NO_FREE_TERM,
    *,
    within: bool = False,
) -> Verdict:
    """Return the verdict of a misfit that no effect explains; ``within``: the misfit is no larger than noise."""
    where = structure(unexplained_fit(explanation), residual_term)
    nearest = explanation.first[0] if explanation.first else None
    base, final = explanation.base, explanation.final
    what = "a pattern no larger than noise" if within else "an error"
    alone = tried = ""
    if nearest:
        left = left_of_excess(nearest.best.fit.chi2, explanation)
        tried = f" The nearest effect, {nearest.name}, leaves {percent(left)} of it."
        is_likelier = base.bic - residual_term.evidence < final.bic
        if len(explanation.steps) == 1 and left < 1.0 - MOST_OF_IT and is_likelier:
            alone = " for certain"
            tried = f" {nearest.name} would explain it, but a smooth change that is no known effect is more probable."
        elif left < 1.0 - MOST_OF_IT:
            tried = f" {nearest.name} explains nearly all of the misfit, but not this part."
    if len(explanation.steps) > 1:
        names, left = listed(step.name for step in explanation.steps), left_of_excess(final.chi2, explanation)
        if left < 1.0 - MOST_OF_IT:
            alone = " alone"
            tried += f" Together, {names} explain it, but they may imitate an effect that the catalogue lacks."
        else:
            tried += (
                f" Together, {names} leave {percent(left)} of it, and may imitate an effect that the catalogue lacks."
            )
    sentence = (
        f"These readings hold {what} that no known effect explains{alone}: {where}.{tried} You can try an effect of "
        f"your own: lutgen refine --effects my_effect.py."
    )
    if more := more_light(base):
        command = "To find out whether settings or the meter changed: lutgen sessions explain"
        remarks = (f"Whole sessions differ in light: {more}. {command}.", *remarks)
    return Verdict("unexplained", sentence, remarks=remarks, signatures=residual_term.names)


def _with_steps(explanation: Explanation, error: PureError, suspicion: Suspicion, remarks: tuple[str, ...]) -> Verdict:
    """Return the verdict of a search that has admitted effects."""
    steps = explanation.steps
    if explanation.beyond:
        names = listed(step.name for step in steps)
        further = f"Beside {names}, {listed(explanation.beyond)} would explain more of the rest"
        missed = f"the formula of {names} misses" if len(steps) == 1 else f"the formulas of {names} miss"
        remarks = (*remarks, f"{further}: further effects, or only what {missed}.")
    weighed = Weighed.of(explanation, error)
    if not weighed.kept and weighed.clean and not weighed.base_free_term.names:
        traces = ", ".join(step.name for step in steps)
        remark = f"A negligible part of the residual could be explained by {traces}."
        return _without_steps(explanation, error, suspicion, (*remarks, remark))
    if is_changed_curve(explanation, weighed) and not (weighed.is_sound_pair and _overlap(weighed.kept, explanation)):
        return replace(_changed_curves(explanation, weighed), remarks=remarks)
    if weighed.sound and not _leaves_much(explanation, weighed, error):
        verdict = _sound(explanation, weighed, error, remarks)
    else:
        verdict = _beside_free_term(explanation, weighed)
    if verdict := verdict or _aging_in_several_ways(explanation, weighed):
        return replace(verdict, remarks=verdict.remarks or remarks)
    of_base = unexplained_fit(explanation) is explanation.base or not weighed.final_free_term.names
    return _unexplained(explanation, remarks, weighed.base_free_term if of_base else weighed.final_free_term)


def _sound(explanation: Explanation, weighed: Weighed, error: PureError, remarks: tuple[str, ...]) -> Verdict | None:
    """Name the kept effects of a sound finding; return None if they may imitate another effect."""
    steps, base = explanation.steps, explanation.base
    kept, seen, minor = weighed.kept, weighed.seen, [step.name for step in weighed.minor]
    named = {*minor, *(step.name for step in kept)}
    if beside := [step.name for step in steps if step.name not in named]:
        only = "only because the formula leaves a residual, not as a separate fault"
        remarks = (*remarks, f"Also fitted, {only}: {', '.join(beside)}.")
    if minor:
        remarks = (*remarks, f"Also fitted, but explaining almost none of the error: {', '.join(minor)}.")
    # Take the printed sizes and shares from a fit with the named effects only: ``refine`` builds this model.
    named_only = explanation.of([step.name for step in kept])
    alone = named_only.steps
    sizes = {step.name: clause(step) for step in alone}
    if len(alone) < len(steps):
        seen = {**seen, **shares_of_delta_e(base, named_only.final, alone)}
    what = (
        "what remains is no larger than noise but has a pattern"
        if weighed.leaves_noise
        else f"{'its' if len(kept) == 1 else 'one'} formula leaves a residual"
    )
    left = "" if weighed.clean else f"{what}: {structure(explanation.final, weighed.final_free_term)}."
    if len(kept) == 1:
        if further := [*beside, *minor]:
            left = left or f"its formula leaves a residual that {_explain(further)}."
        (step,) = kept
        if len(steps) == 1 and (other := of_other_forms(step, explanation.first)):
            remarks = (*remarks, other)
        size = f"{sizes[step.name]}: {excess(step, seen, weighed.shares)}"
        simplest, imitated = share_of_simplest(alone[0], explanation), _imitated(step, explanation, error)
        objection = JAGGED if explanation.unknown_table else assumes_held_luminance(step, base.problem)
        doubt = unproved(step, explanation.final, error.scale)
        explained = seen[step.name] or weighed.shares[step.name]
        rest = "may be noise, whose size is not known exactly" if explained < HALF else "is noise"
        verdict = one(
            step, size, left=left, simplest=simplest, imitated=imitated, objection=objection, doubt=doubt, rest=rest
        )
    elif (overlapping := _overlap(kept, explanation)) and weighed.is_sound_pair:
        verdict = like_both(kept)
    elif imitations := _imitations(kept, explanation, error):
        without = _without_imitations(explanation, weighed, imitations, error)
        return replace(without, remarks=remarks) if without else None
    # If the catalogue lacks the true effect, the search combines several effects, which overlap, leave a residual, or
    # explain no visible error.
    elif overlapping or (len(kept) > _most_with_residual(kept, base) and not (weighed.clean and any(seen.values()))):
        return None
    else:
        verdict = several(kept, sizes, weighed.shares, seen, left)
    return replace(verdict, shares=weighed.shares, shares_delta_e=seen, remarks=remarks)


def _explain(names: Sequence[str]) -> str:
    return f"{listed(names)} explain{'' if len(names) > 1 else 's'}"


def _overlap(steps: Sequence[Step], explanation: Explanation) -> bool:
    """Whether one of several effects may only imitate another.

    Effects that are proven by readings which no other effect changes are excluded.
    """
    if len(steps) < 2:
        return False
    return overlap([step.chosen for step in steps if step.name not in explanation.certain], explanation.base)


def _most_with_residual(kept: Sequence[Step], base: Fit) -> int:
    """Return how many effects a finding may have if they leave a residual: two, or three with aging of the light.

    Only baselines from the first hour show aging of the light; the others measure it again in each session.
    """
    ages = base.problem.from_first_hour and any(ages_light(step.effect) for step in kept)
    return 3 if ages else 2


def _imitations(kept: Sequence[Step], explanation: Explanation, error: PureError) -> list[str]:
    """Return the effects, other than the strongest, that may imitate another effect of equal strength.

    Such an effect may only fit the residual that the formula of the strongest effect leaves, unless readings that no
    other effect changes prove it. The formula of an effect that does not age the light leaves no fading light.
    """
    strongest = max(kept, key=lambda step: step.without.chi2)
    others = [step for step in kept if step is not strongest and step.name not in explanation.certain]
    if explanation.base.problem.from_first_hour and not ages_light(strongest.effect):
        others = [step for step in others if not ages_light(step.effect)]
    imitated = {step.name: _imitated(step, explanation, error) for step in others}
    return [name for name, each in imitated.items() if each and each.left < 2 * STRONG]


def _without_imitations(
    explanation: Explanation, weighed: Weighed, imitations: Sequence[str], error: PureError
) -> Verdict | None:
    """Name the kept effects without the imitations if they leave only noise; otherwise return None."""
    rest = explanation.of([step.name for step in weighed.kept if step.name not in imitations])
    if not leaves_only_noise(rest.final, error) or _overlap(rest.steps, rest):
        return None
    seen = shares_of_delta_e(rest.base, rest.final, rest.steps)
    sizes = {step.name: clause(step) for step in rest.steps}
    left = f"what remains could also be {listed(imitations)}, or something that the catalogue lacks"
    if len(rest.steps) > 1:
        verdict = several(rest.steps, sizes, weighed.shares, seen, f"{left}.")
    else:
        (step,) = rest.steps
        size = f"{sizes[step.name]}: {excess(step, seen, weighed.shares)}"
        verdict = one(step, size, objection=f"{left[0].upper()}{left[1:]}.")
    return replace(verdict, shares=weighed.shares, shares_delta_e=seen)


def _is_of_light(explanation: Explanation) -> bool:
    """Whether several effects were admitted, and all of them age the light from the first hour."""
    steps, problem = explanation.steps, explanation.base.problem
    return problem.from_first_hour and len(steps) > 1 and all(ages_light(step.effect) for step in steps)


def _leaves_much(explanation: Explanation, weighed: Weighed, error: PureError) -> bool:
    """Whether the kept effects leave clearly more χ² than all admitted effects together, if all age the light."""
    if not _is_of_light(explanation):
        return False
    final, left = explanation.final, explanation.of([step.name for step in weighed.kept]).final.chi2
    return left > max(2.0 * final.chi2, CLEAR**2 * final.freedom * error.scale)


def _aging_in_several_ways(explanation: Explanation, weighed: Weighed) -> Verdict | None:
    """Name several effects that age the light if they explain nearly all together but are no separate findings."""
    base, final, steps = explanation.base, explanation.final, explanation.steps
    if not _is_of_light(explanation) or not weighed.explains:
        return None
    seen = shares_of_delta_e(base, final, steps)
    names = tuple(step.name for step in steps)
    sentence = (
        f"The light ages in more than one way: {listed(names)} explain it together, and no effect alone. They are too "
        f"similar in these readings to say how much each contributes."
    )
    return Verdict("one-of", sentence, names, shares=weighed.shares, shares_delta_e=seen)


def _beside_free_term(explanation: Explanation, weighed: Weighed) -> Verdict | None:
    """Name, with reserve, a single effect that leaves only noise although a free term explains the readings as well."""
    if len(explanation.steps) > 1 or weighed.kept or not weighed.clean:
        return None
    (step,) = explanation.steps
    if evidence_against(step, explanation.final):
        return None
    seen = shares_of_delta_e(explanation.base, explanation.final, explanation.steps)
    size = f"{clause(step)}: {excess(step, seen, weighed.shares)}"
    objection = "A smooth change that no effect of the catalogue describes explains these readings as well."
    return replace(one(step, size, objection=objection), shares=weighed.shares, shares_delta_e=seen)


def _changed_curves(explanation: Explanation, weighed: Weighed) -> Verdict:
    """Name the effect that explains most of a changed curve; other effects fit the residual of its formula.

    Effects that readings of black show are also named, because these curves do not change black.
    """
    base, final = explanation.base, explanation.final
    own = {step.name: step.without.chi2 - final.chi2 for step in explanation.steps if bends_curves(step.effect)}
    first, *others = sorted(explanation.steps, key=lambda step: -own.get(step.name, 0.0))
    curves = [first.name, *(step.name for step in others if own.get(step.name, 0.0) > HALF * own[first.name])]
    apart = [step for step in others if step.name in explanation.shown_by_black]
    seen = shares_of_delta_e(base, final, explanation.steps)
    sentence = (
        f"The display's curves were changed by {listed(curves, 'or')}, or by another effect that the catalogue lacks. "
        f"If it is {first.name}, {clause(first)}"
    )
    if missed := [step.name for step in others if step not in apart and step.name not in curves]:
        sentence += f"; {_explain(missed)} what its formula misses"
    if apart:
        which = "; ".join(f"{step.name} ({clause(step)})" for step in apart)
        sentence += f". Separate from this, black shows {which}"
    names = (*curves, *(step.name for step in apart))
    return Verdict("one-of", f"{sentence}.", names, shares=weighed.shares, shares_delta_e=seen)


def _imitated(step: Step, explanation: Explanation, error: PureError) -> Imitated | None:
    """Return the effect that the form of an admitted effect follows best; None if the effect has a rival."""
    imitated = None if step.rivals else nearest(step, explanation.final, error.scale)
    gain = [each.best.gain for each in explanation.first if imitated and each.name == imitated.name]
    whole = explanation.base.chi2 - explanation.final.chi2
    return replace(imitated, alone=max(gain[0], 0.0) / whole) if imitated and gain else imitated
