"""The decision: what the evidence of a search allows to say, and what it does not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.compare.drift import doubt
from lutgen.criticism.fit.lack_of_fit import is_even, is_within_scatter
from lutgen.criticism.search.candidates import HALF, STRONG
from lutgen.criticism.search.free_term import FreeTerm, free_term, probe
from lutgen.criticism.search.stepwise import MOST_OF_IT
from lutgen.criticism.verdict.imitation import Imitated, nearest, overlap
from lutgen.criticism.verdict.remarks import lines_of, remarks_of
from lutgen.criticism.verdict.session_light import more_light
from lutgen.criticism.verdict.shares import shares_of_delta_e
from lutgen.criticism.verdict.verdict import Verdict
from lutgen.criticism.verdict.weighing import Weighed, bends_curves, is_of_curves
from lutgen.criticism.verdict.words import NO_PROBES, excess, like_both, one, several, structure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.influence import Suspicion
    from lutgen.criticism.search.stepwise import Explanation, Step
    from lutgen.criticism.verdict.visibility import Visibility

AGREES = "Nothing is above the noise: the model agrees with these readings."

#: With tips alone the model cannot fail, and has not been tried.
NOTHING_COMPARED = (
    "Nothing was compared: these readings hold nothing but white and primaries, which any model agrees with."
)


def pronounce(explanation: Explanation, error: PureError, seen: Sequence[Visibility], suspicion: Suspicion) -> Verdict:
    """Weigh a search."""
    blind = [each.effect for each in seen if not each.visible]
    remarks = remarks_of(explanation, blind, suspicion)
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


def _nothing_named(
    explanation: Explanation, error: PureError, suspicion: Suspicion, remarks: tuple[str, ...]
) -> Verdict:
    if suspicion.rows:
        sentence = (
            f"The measurement, not the display, moved: {lines_of(explanation, suspicion)} cannot be right. "
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


def _unexplained(explanation: Explanation, remarks: tuple[str, ...], probed: FreeTerm = NO_PROBES) -> Verdict:
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
        size = f"{step.effect.in_words(step.chosen.term.values)}: {excess(step, seen, weighed.shares)}"
        worded = one(step, size, left, _owed(step, explanation), _imitated(step, explanation, error))
    elif (alike := overlap([step.chosen for step in kept], base)) and weighed.clean and len(kept) == 2:
        worded = like_both(kept)
    elif (
        alike
        or _is_shadowed(kept, explanation, error)
        # Three that leave something are what a search makes of an effect that it lacks.
        or (len(kept) > 2 and not weighed.clean)
    ):
        return _unexplained(explanation, remarks, probed)
    else:
        worded = several(kept, weighed.shares, seen, left)
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


def _imitated(step: Step, explanation: Explanation, error: PureError) -> Imitated | None:
    """Return the effect that a finding's form follows best, where no rival says already what it may be."""
    return None if step.rivals else nearest(step, explanation.final, error.scale)


def _owed(step: Step, explanation: Explanation) -> float:
    """Share of what an effect's form explains, in χ², that its simplest form explains alone."""
    gains = [family.simple.gain for family in explanation.first if family.name == step.name]
    whole = explanation.base.chi2 - explanation.final.chi2
    return gains[0] / whole if gains and whole > 0 else 1.0
