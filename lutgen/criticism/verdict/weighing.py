"""How far admitted effects are needed, by BIC against a free term that no formula describes, and against both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.criticism.first_session.slope_errors import gain_beside, with_doubts
from lutgen.criticism.fit.lack_of_fit import is_noise, is_within_scatter
from lutgen.criticism.search.candidates import HALF, STRONG
from lutgen.criticism.search.free_term import FreeTerm, free_term, probe
from lutgen.criticism.search.stepwise import MOST_OF_IT, stand_apart, together
from lutgen.criticism.verdict.shares import shares_of_delta_e

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.stepwise import Explanation, Step
    from lutgen.effects import Effect


@dataclass(frozen=True)
class Weighed:
    """Admitted effects, and what is left of them.

    Attributes
    ----------
    kept
        Effects that the readings need, the one that is seen most first.
    trifles
        Effects that the readings need too, and that are next to nothing of the error: no faults of their own.
    shares, seen
        Effect → share of the excess χ², and of the excess mean ΔE2000, that goes with it.
    nothing, left
        The free term beside the model alone, and beside all effects.
    clean
        Whether all effects together leave noise.
    explains
        Whether all effects together explain nearly all of what is there.
    sound
        Whether what is kept explains what is there, within what is physical.

    """

    kept: tuple[Step, ...]
    trifles: tuple[Step, ...]
    shares: Mapping[str, float]
    seen: Mapping[str, float]
    nothing: FreeTerm
    left: FreeTerm
    clean: bool
    explains: bool
    sound: bool

    @classmethod
    def of(cls, explanation: Explanation, error: PureError) -> Weighed:
        """Weigh what a search has admitted."""
        steps, base, final = explanation.steps, explanation.base, explanation.final
        excess = max(base.chi2 - base.freedom * error.scale, base.chi2 - final.chi2, 1e-9)
        shares, before = {}, base.chi2
        for step, found in zip(steps, explanation.trail, strict=True):
            shares[step.name], before = max(before - found.chi2, 0.0) / excess, found.chi2
        nothing, left = probe(base, error), free_term(final, error)
        both = final.bic - left.evidence
        leaves_noise = is_noise(final, error)
        # Where formulas leave more, what doubts of a native display's curves leave decides whether that is enough.
        rough = final if leaves_noise else with_doubts(final)
        needed = _needed(explanation, error, shares, nothing, both)
        if rough is not final:
            needed = [
                step for step in needed if step.effect.stage == "drive" or gain_beside(rough, step.effect) > STRONG
            ]
        seen = shares_of_delta_e(base, final, [step.name for step in needed])
        needed = sorted(needed, key=lambda step: (-seen[step.name], -shares[step.name]))
        trifles = [step for step in needed[1:] if max(seen[step.name], shares[step.name]) < 1.0 - MOST_OF_IT]
        kept = [step for step in needed if step not in trifles]
        chosen, gain = [step.chosen for step in kept], base.chi2 - rough.chi2
        noise, left_of_rough = leaves_noise, left
        if rough is not final:
            noise, left_of_rough = is_noise(rough, error), free_term(rough, error)
        # A free term describes what is smooth. Where more than noise is left, at least half of it counts besides.
        jagged = 0.0 if noise else HALF * max(excess - gain, 0.0)
        missed = max(left_of_rough.gain, jagged) if left_of_rough.names else max(excess - gain, 0.0)
        explained = gain / (gain + missed)
        # A family may leave what its formula misses. Of several each must explain nearly all of what the others leave:
        # else they are what a search makes of another effect.
        own = [step.without.chi2 - final.chi2 for step in kept]
        enough = explained > MOST_OF_IT and (noise or all(each > MOST_OF_IT * (each + missed) for each in own))
        # What is fitted beside, for what formulas leave, may be no more than formulas may leave.
        beside = 0.0
        if len(kept) < len(steps):
            alone = together(base, chosen)
            beside = (alone if rough is final else with_doubts(alone)).chi2 - rough.chi2
        clean = leaves_noise and not left.names
        # Even scatter that is more than noise may be an effect that the catalogue lacks: half of it must be explained.
        half = is_within_scatter(error, rough) or gain > HALF * excess
        sound = (
            bool(kept)
            and half
            and (clean or enough)
            and beside <= (1.0 - MOST_OF_IT) * gain
            and base.bic - nothing.evidence >= both - STRONG
            and not any(_is_at_its_limit(step) for step in kept)
            and stand_apart(chosen, base)
        )
        explains = clean or explained > MOST_OF_IT
        return cls(tuple(kept), tuple(trifles), shares, seen, nothing, left, clean, explains, sound)


def _needed(
    explanation: Explanation, error: PureError, shares: Mapping[str, float], nothing: FreeTerm, beside_all: float
) -> list[Step]:
    """Admitted effects without which the readings are clearly less likely, whatever a free term takes over.

    A formula that does not quite fit leaves something that looks like the effects that its own is confused with. Beside
    a free term such shadows are superfluous, and a fault of its own is not; where the effect is strong, its shadows are
    too, in proportion to it. ``nothing`` is the free term beside the base alone; ``beside_all`` is BIC with all effects
    and a free term.
    """
    kept = []
    for step in explanation.steps:
        kin = [term.effect.name for term in step.without.terms if _is_alike(step.effect, term.effect)]
        largest = max((shares[name] for name in kin if name in shares), default=0.0)
        probed = nothing if step.without is explanation.base else probe(step.without, error)
        free = step.without.bic - probed.evidence
        if free > beside_all + STRONG and shares[step.name] > (1.0 - MOST_OF_IT) * largest:
            kept.append(step)
    return kept


def bends_curves(effect: Effect) -> bool:
    """Whether an effect changes code values on their way, or the curves: what one misses others of these take up."""
    return effect.stage in {"drive", "transfer"}


def is_of_curves(main: Sequence[Step], shares: Mapping[str, float], base: Fit) -> bool:
    """Whether effects that explain more than formulas may miss are a bent curve and what takes up what its form misses.

    Behind a display's own curves that may be mixing: how light of several channels goes with their drive, nobody read.
    """
    if not main or not bends_curves(max(main, key=lambda step: shares[step.name]).effect):
        return False
    native = base.problem.native is not None
    return all(bends_curves(step.effect) or (native and step.effect.stage == "mixing") for step in main)


def _is_alike(one: Effect, other: Effect) -> bool:
    return one.is_kin(other) or (bends_curves(one) and bends_curves(other))


def _is_at_its_limit(step: Step) -> bool:
    """Whether a size of an effect lies at a bound of what is physical, other than where the effect does nothing."""
    values, rest, parameters = step.chosen.term.values, step.effect.neutral, step.effect.parameters
    return any(
        parameters[name].is_at_bound(values[name]) and not parameters[name].is_at(rest[name], values[name])
        for name in set(step.chosen.term.free) & set(rest)
    )
