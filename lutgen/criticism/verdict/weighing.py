"""Which admitted effects the readings need: compare BIC of the effects, of a free term alone, and of both together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.first_session.slope_errors import bic_gain, bic_with_drive_errors, with_drive_errors
from lutgen.criticism.fit.anchored import anchored, noise_only
from lutgen.criticism.fit.lack_of_fit import is_noise, is_within_scatter
from lutgen.criticism.fit.linear import whiten
from lutgen.criticism.search.candidates import HALF, MOST_OF_IT, STRONG
from lutgen.criticism.search.explanation import bends_curves, is_shown_apart, together
from lutgen.criticism.search.free_term import FreeTerm, free_term, leaves_only_noise, probe
from lutgen.criticism.search.stepwise import stand_apart

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.explanation import Explanation, Step
    from lutgen.effects import Effect


#: Standard deviations above which no noise explains that an effect does not lower the error.
SIGMAS = 3.0


@dataclass(frozen=True)
class Weighed:
    """The evidence for the admitted effects.

    Attributes
    ----------
    kept
        Effects that the readings need, the most visible first.
    minor
        Further needed effects that explain almost none of the error; they are not separate faults. An effect that
        shows in readings of its own is minor only if BIC does not clearly (2 · ``STRONG``) ask for it.
    shares, seen
        Effect → share of the excess χ², and of the excess mean ΔE2000, that it explains.
    base_free_term, final_free_term
        The free term of the model without the effects, and with all of them.
    leaves_noise
        Whether the residual of all effects together is no larger than noise.
    explains
        Whether all effects together explain nearly all of the excess χ².
    sound
        Whether the kept effects explain enough of the excess, with parameters inside their physical bounds.

    """

    kept: tuple[Step, ...]
    minor: tuple[Step, ...]
    shares: Mapping[str, float]
    seen: Mapping[str, float]
    base_free_term: FreeTerm
    final_free_term: FreeTerm
    leaves_noise: bool
    explains: bool
    sound: bool

    @property
    def clean(self) -> bool:
        """Whether the residual of all effects together is noise: it is no larger, and has no free term."""
        return self.leaves_noise and not self.final_free_term.names

    @property
    def is_sound_pair(self) -> bool:
        """Whether the finding is two effects that leave nothing but noise."""
        return self.sound and self.clean and len(self.kept) == 2

    @classmethod
    def of(cls, explanation: Explanation, error: PureError) -> Weighed:
        """Judge the effects that a search has admitted."""
        steps, base, final = explanation.steps, explanation.base, explanation.final
        excess = max(base.chi2 - base.freedom * error.scale, base.chi2 - final.chi2, 1e-9)
        shares, before = {}, base.chi2
        for step, trail_fit in zip(steps, explanation.trail, strict=True):
            shares[step.name], before = max(before - trail_fit.chi2, 0.0) / excess, trail_fit.chi2
        base_term = probe(base, error)
        final_term = free_term(final, error, base_term.names)
        leaves_noise = is_noise(final, error)
        # If the residual is not noise, or has a pattern, a fit with the errors of slopes and steps of a native
        # display's code values decides whether the effects explain enough.
        clean = leaves_noise and not final_term.names
        lenient = final if clean and not explanation.unknown_table else with_drive_errors(final)
        is_rest_noise, rest_term = leaves_noise, final_term
        bic_of_both = final.bic - final_term.evidence
        if lenient is not final:
            is_rest_noise, rest_term = is_noise(lenient, error), free_term(lenient, error, base_term.names)
        if explanation.unknown_table:
            bic_of_both = min(bic_of_both, bic_with_drive_errors(lenient, final) - rest_term.evidence)
        needed = _needed(explanation, error, shares, base_term, bic_of_both)
        if lenient is not final:
            needed = [
                step for step in needed if step.effect.stage == "drive" or bic_gain(lenient, step.effect) > STRONG
            ]
        seen = shares_of_delta_e(base, final, needed)
        needed = sorted(needed, key=lambda step: (-seen[step.name], -shares[step.name]))
        minor = [
            step
            for at, step in enumerate(needed[1:], start=1)
            if _is_minor(step, max(seen[step.name], shares[step.name]), final)
            and not (at == 1 and step.name in explanation.certain and step.without.bic > final.bic + 2.0 * STRONG)
        ]
        kept = [step for step in needed if step not in minor]
        chosen, gain = [step.chosen for step in kept], base.chi2 - lenient.chi2
        # A free term describes only smooth residuals. If more than noise is left, half of the rest counts too.
        not_smooth = 0.0 if is_rest_noise else HALF * max(excess - gain, 0.0)
        missed = max(rest_term.gain, not_smooth) if rest_term.names else max(excess - gain, 0.0)
        explained = gain / (gain + missed)
        # A single effect may leave the residual of its formula. Each of several effects must explain nearly all of the
        # residual of the others: otherwise the search may have combined them to imitate another effect. Readings that
        # no other effect changes prove an effect, however small.
        certain = explanation.certain if len(kept) > 1 else frozenset[str]()
        own = [step.without.chi2 - final.chi2 for step in kept if step.name not in certain]
        enough = explained > MOST_OF_IT and (is_rest_noise or all(each > MOST_OF_IT * (each + missed) for each in own))
        # The gain of the effects that are not kept must not exceed the residual that formulas may leave, unless the
        # kept effects leave nothing but noise.
        kept_fit, not_kept = final, 0.0
        if len(kept) < len(steps):
            kept_fit = together(base, chosen)
            not_kept = (kept_fit if lenient is final else with_drive_errors(kept_fit)).chi2 - lenient.chi2
        misses_much = not_kept > (1.0 - MOST_OF_IT) * gain and not leaves_only_noise(kept_fit, error, base_term.names)
        # Even scatter above the noise may be an effect that the catalogue lacks: half of the excess must be explained.
        half = is_within_scatter(error, lenient) or gain > HALF * excess
        # If the excess is visible and a residual is left, the kept effects must together explain half of the excess in
        # mean ΔE2000.
        is_clean = clean or explanation.unknown_table
        is_whole = is_clean or kept_fit is final or not any(seen.values())
        visible = is_whole or _returning_delta_e(base, final, [kept_fit])[0] < HALF
        sound = (
            bool(kept)
            and half
            and visible
            and (is_clean or enough)
            and not misses_much
            and base.bic - base_term.evidence >= bic_of_both - STRONG
            and not any(step.chosen.is_at_limit for step in kept)
            and stand_apart(chosen, base)
        )
        explains = clean or explained > MOST_OF_IT
        return cls(tuple(kept), tuple(minor), shares, seen, base_term, final_term, leaves_noise, explains, sound)


def _needed(
    explanation: Explanation, error: PureError, shares: Mapping[str, float], base_term: FreeTerm, bic_of_both: float
) -> list[Step]:
    """Return the admitted effects without which the readings are clearly less likely, even with a free term.

    An inexact formula leaves a residual that looks like similar effects. A free term explains this residual too, so
    that such effects are not needed; a free term cannot replace a separate fault. The residual grows with the main
    effect. Therefore an effect must also explain more than 5 % of what the largest similar effect explains, or show in
    readings that the similar effects do not change, such as those of a capped lens. ``base_term`` is the free term of
    the base; ``bic_of_both`` is BIC with all effects and a free term.
    """
    needed = []
    for step in explanation.steps:
        similar = [term for term in step.without.terms if _is_similar(step.effect, term.effect)]
        largest = max((shares[term.effect.name] for term in similar if term.effect.name in shares), default=0.0)
        # Light that changes with the condition of an effect is not the residual of another formula: it is this effect.
        alone = step.without is explanation.base
        term = base_term if alone else probe(step.without, error, leave_out=step.effect.needs)
        bic_without = step.without.bic - term.evidence
        is_large = shares[step.name] > (1.0 - MOST_OF_IT) * largest
        is_large = is_large or is_shown_apart(step.chosen, similar, step.without, explanation.final)
        margin = bic_without - bic_of_both - STRONG
        if margin > 0.0 and is_large and margin > evidence_against(step, explanation.final):
            needed.append(step)
    return needed


def evidence_against(step: Step, final: Fit) -> float:
    """Return the evidence against an effect, from predictions with white and primaries as their own readings give them.

    A fit moves white and primaries together with an effect, a baked LUT does not: an effect that only improves the fit
    does not improve the LUT. The error of a prediction is the sum of squares in σ over the colours that the first
    session has read. If the effect lowers the error, the evidence against it is 0. If not, the noise of white and
    primaries may be the reason: the evidence is the squared deviation, in standard deviations, from simulated campaigns
    in which the effect is real. It is a difference in -2 ln of the likelihood, like BIC; infinite above ``SIGMAS``.
    """
    problem = final.problem
    judged = _judged(problem)
    if not judged.any():
        return 0.0
    predicted, without = anchored(problem, final.terms), anchored(problem, step.without.terms)

    def rise(xyz: Array) -> float:
        """Sum of squares in σ of readings (n, 3) with the effect, minus that without the effect."""
        after, before = (whiten(problem, xyz - each)[judged] for each in (predicted, without))
        return float((after**2).sum() - (before**2).sum())

    observed = rise(problem.xyz)
    if observed < 0.0:
        return 0.0
    simulated = [rise(predicted + noise) for noise in noise_only(problem, predicted)]
    deviation = (observed - float(np.mean(simulated))) / max(float(np.std(simulated)), 1e-9)
    return max(deviation, 0.0) ** 2 if deviation < SIGMAS else np.inf


def _judged(problem: Problem) -> NDArray[np.bool_]:
    """Return which readings, (n,), a prediction may be judged by.

    Colours that the first session has not read are excluded: the errors of the curves there would dominate.
    """
    return np.asarray(~problem.is_anchor & (problem.counts == 1.0))


def _is_minor(step: Step, share: float, final: Fit) -> bool:
    """Whether an effect explains a small ``share`` of the error, and χ² would less than double without it."""
    return share < 1.0 - MOST_OF_IT and step.without.chi2 < 2.0 * final.chi2


def is_changed_curve(explanation: Explanation, weighed: Weighed) -> bool:
    """Whether several admitted effects are a changed curve and effects that only fit the residual of its formula.

    An effect that explains almost none of the error does not count, and an effect that readings of its own prove is no
    part of a changed curve. One or two parameters of another effect hardly ever explain all that a wrong formula
    misses: two effects of so few parameters are separate if χ² more than doubles without either of them.
    """
    steps, kept, chi2 = explanation.steps, weighed.kept, explanation.final.chi2
    # An effect with a small share of χ² may only fit the residual of a curve effect's formula.
    main = [step for step in steps if weighed.shares[step.name] > 1.0 - MOST_OF_IT]
    is_alone = len(steps) == 1 or (len(kept) == 1 and weighed.clean)
    if is_alone or not weighed.explains or not _is_of_curves(main, weighed.shares, explanation.base):
        return False
    if weighed.is_sound_pair and any(step.name in explanation.certain for step in kept):
        return False
    needed = [step for step in kept if step.without.chi2 > 2.0 * chi2 and len(step.chosen.form) <= 2]
    return not (weighed.sound and weighed.leaves_noise and len(needed) == len(steps) == 2)


def _is_of_curves(main: Sequence[Step], shares: Mapping[str, float], base: Fit) -> bool:
    """Whether the main effects are a changed curve, and effects that fit the residual of its formula.

    With a display's own curves, an effect on mixing may fit this residual, because no reading of the first session
    shows how the light of several channels depends on their drive.
    """
    if not main or not bends_curves(max(main, key=lambda step: shares[step.name]).effect):
        return False
    native = base.problem.native is not None
    return all(bends_curves(step.effect) or (native and step.effect.stage == "mixing") for step in main)


def share_of_simplest(step: Step, explanation: Explanation) -> float:
    """Return the gain of an effect's simplest form alone as a share of the gain of its chosen form alone, in χ²."""
    gains = [family.simple.gain for family in explanation.first if family.name == step.name]
    whole = step.chosen.gain
    return gains[0] / whole if gains and whole > 0 else 1.0


def _is_similar(one: Effect, other: Effect) -> bool:
    return one.is_kin(other) or (bends_curves(one) and bends_curves(other))


def shares_of_delta_e(base: Fit, final: Fit, steps: Sequence[Step]) -> dict[str, float]:
    """Return, for each admitted effect, the share of the excess mean ΔE2000 that returns in a fit without it.

    The other effects are refitted without it; error that they then explain does not count for this effect. ``base`` is
    the fit without any of the effects, ``final`` the fit with all of them. The excess is the mean ΔE2000 of ``base``
    minus that of noise alone. If seeded noise gives as much as the excess, all shares are 0. Shares of effects that act
    on the same colours need not add to 1.

    ΔE2000 measures visible differences. The unit of χ² is the noise of the meter, which is most sensitive to dark
    patches: an effect may explain nine tenths of χ² and still be the less visible effect.
    """
    shares = _returning_delta_e(base, final, [step.without for step in steps])
    return {step.name: share for step, share in zip(steps, shares, strict=True)}


def _returning_delta_e(base: Fit, final: Fit, fits: Sequence[Fit]) -> list[float]:
    """Return the share of the excess mean ΔE2000 of ``base`` over ``final`` that returns in each of some fits."""
    problem = base.problem
    judged, white = _judged(problem), problem.measured_tips[0, 0]
    if not judged.any():
        return [0.0 for _ in fits]

    def mean(predicted: Array, measured: Array) -> float:
        delta_e = delta_e_2000(xyz_to_lab(predicted, white), xyz_to_lab(measured, white))
        return float(delta_e[judged].mean())

    def error(terms: Sequence[Term]) -> float:
        return mean(anchored(problem, terms), problem.xyz)

    plain = anchored(problem, base.terms)
    floor = [mean(plain, plain + residual) for residual in noise_only(problem, plain)]
    excess, least = mean(plain, problem.xyz) - float(np.mean(floor)), error(final.terms)
    if excess <= max(floor) - float(np.mean(floor)):
        return [0.0 for _ in fits]
    return [min(max(error(each.terms) - least, 0.0) / excess, 1.0) for each in fits]
