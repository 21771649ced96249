"""The result of a search: the admitted effects, the fits with and without each, and the rivals of each."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, Term, predict
from lutgen.criticism.search.candidates import HALF, STRONG, GainRatio, best_linear_gain, bic, contenders

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.search.candidates import Candidate, Family
    from lutgen.effects import Effect

#: A reading counts as unchanged if an effect changes it by less than this share of its noise (1 σ).
UNCHANGED = 0.1

#: Largest relative difference between changes of X, Y and Z that leaves a chromaticity as it is.
SAME_COLOUR = 1e-6

#: Share of the change in light below which a change of colours does not count: the light fades evenly.
EVENLY = 0.05


@dataclass(frozen=True)
class Step:
    """One admitted effect: its final candidate, the other admitted candidates, and the effects it was chosen from.

    ``sufficient``: other families that alone explain nearly all of the misfit, if no formula explains all of it.
    """

    chosen: Candidate
    beside: tuple[Candidate, ...] = field(repr=False)
    effects: tuple[Effect, ...] = field(repr=False)
    base: Fit = field(repr=False)
    sufficient: tuple[Family, ...] = ()

    @property
    def effect(self) -> Effect:
        """The effect."""
        return self.chosen.effect

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @cached_property
    def without(self) -> Fit:
        """The fit of the other admitted effects, in their final forms, without this effect."""
        return together(self.base, self.beside)

    @cached_property
    def rivals(self) -> tuple[Family, ...]:
        """Families that explain the readings as well as this effect, in its place; searched for at the first access."""
        rivals = _rivals(self.chosen, self.beside, self.effects, self.base)
        known = {rival.name for rival in rivals}
        return (*rivals, *(each for each in self.sufficient if each.name not in known))


@dataclass(frozen=True)
class Explanation:
    """The result of a search.

    Attributes
    ----------
    base, final
        The fits without and with the admitted effects.
    first
        All families, each fitted alone together with the base, best first.
    steps
        The admitted effects in the order of their admission.
    trail
        The fits with the first effect, the first two effects, and so on to ``final``.
    beyond
        Effects that were admitted, but may only fit the residual that the formulas of ``steps`` leave.
    unknown_table
        Whether ``steps`` hold a rounding behind a table that nobody knows
        (:mod:`lutgen.criticism.search.unknown_table`).

    """

    base: Fit
    final: Fit
    first: tuple[Family, ...]
    steps: tuple[Step, ...]
    trail: tuple[Fit, ...]
    beyond: tuple[str, ...] = ()
    unknown_table: bool = False

    @cached_property
    def certain(self) -> frozenset[str]:
        """Names of the admitted effects that show in readings which no other admitted effect changes."""
        return self._shown_apart(in_the_dark=False)

    @cached_property
    def shown_by_black(self) -> frozenset[str]:
        """Names of the admitted effects that show in readings of black which no other admitted effect changes."""
        return self._shown_apart(in_the_dark=True)

    def _shown_apart(self, *, in_the_dark: bool) -> frozenset[str]:
        return frozenset(
            step.name
            for step in self.steps
            if is_shown_apart(
                step.chosen,
                [other.term for other in step.beside],
                step.without,
                self.final,
                in_the_dark=in_the_dark,
            )
        )

    def of(self, names: Sequence[str]) -> Explanation:
        """Return the explanation by the named admitted effects alone, with the forms that were chosen."""
        steps = [step for step in self.steps if step.name in names]
        if len(steps) in {0, len(self.steps)}:
            return self
        chosen = [step.chosen for step in steps]
        trail = tuple(together(self.base, chosen[:count]) for count in range(1, len(chosen) + 1))
        fitted = [replace(each, fit=trail[-1], gain=self.base.chi2 - trail[-1].chi2) for each in chosen]
        alone = [
            replace(step, chosen=each, beside=tuple(other for other in fitted if other is not each))
            for step, each in zip(steps, fitted, strict=True)
        ]
        return replace(self, final=trail[-1], steps=tuple(alone), trail=trail)


def left_of_excess(chi2: float, explanation: Explanation) -> float:
    """Return the share of the base's excess of χ² over its degrees of freedom that a fit with ``chi2`` leaves."""
    base = explanation.base
    return max(chi2 - base.freedom, 0.0) / max(base.chi2 - base.freedom, 1e-9)


def unexplained_fit(explanation: Explanation) -> Fit:
    """Return the fit whose residual no effect explains: the base if the admitted effects leave most of its excess."""
    return explanation.base if left_of_excess(explanation.final.chi2, explanation) > HALF else explanation.final


def together(base: Fit, chosen: Sequence[Candidate]) -> Fit:
    """Fit candidates together with the terms of ``base``."""
    return base.with_more([each.term for each in chosen])


def _is_since_first_hour(effect: Effect) -> bool:
    """Whether only a baseline from the first hour shows an effect: the light ages, or the meter's gain drifts."""
    return effect.baseline == "first-hour"


def ages_light(effect: Effect) -> bool:
    """Whether an effect is a way in which the light itself ages, which only a baseline from the first hour shows."""
    return _is_since_first_hour(effect) and effect.stage != "instrument"


def bends_curves(effect: Effect) -> bool:
    """Whether an effect changes code values or transfer curves.

    Any of these effects can absorb the residual that the formula of another one leaves.
    """
    return effect.stage in {"drive", "transfer"}


def changes_colours(effect: Effect) -> bool:
    """Whether an effect changes code values, curves, or how the channels mix."""
    return bends_curves(effect) or effect.stage == "mixing"


def is_shown_apart(
    each: Candidate, others: Sequence[Term], without: Fit, final: Fit, *, in_the_dark: bool = False
) -> bool:
    """Whether an effect is proven by readings that no other admitted effect changes, such as those of a capped lens.

    In these readings the gain of the effect in χ² must exceed the penalty of BIC. ``without``, ``final``: the fits
    without and with the effect, all other admitted effects present. Two effects since the first hour, or two on curves
    and mixing, can fit each other's residual: they never count as shown apart.

    ``in_the_dark``: only readings of black at rest count, in which no formula of another effect leaves a residual; an
    effect that needs a condition never counts.
    """
    alike = _is_since_first_hour if _is_since_first_hour(each.effect) else changes_colours
    if (alike(each.effect) and any(alike(other.effect) for other in others)) or (in_the_dark and each.effect.needs):
        return False
    problem = final.problem
    dark = problem.readings.at_rest() & (problem.readings.drive == 0.0).all(axis=1)
    unchanged = dark[problem.rows] | (not in_the_dark)
    for other in others:
        unchanged &= (np.abs(without.score.switched_on(other)) < UNCHANGED).all(axis=1)
    gain = float((without.residual[unchanged] ** 2).sum() - (final.residual[unchanged] ** 2).sum())
    penalty = STRONG + len(each.form) * float(np.log(final.readings))
    if gain > penalty and problem.native and others and not problem.from_first_hour:
        # The model of a native display is fitted with the effects: the residual of another effect's formula reaches all
        # readings through it. So the readings that the other effects change are left out, except those of the tips.
        names = {other.effect.name for other in others}
        plain = tuple(term for term in without.terms if term.effect.name not in names)
        part = problem.without(problem.rows[~unchanged & ~problem.is_tip_anchor])
        gain = fit(part, plain).chi2 - fit(part, (*plain, each.term)).chi2
    return gain > penalty


def only_dims(without: Fit, whole: Fit, term: Term, share: float = 0.0) -> bool:
    """Whether an effect changes the light of white and primaries, but not their chromaticities.

    ``share``: a change of colours that is no larger than this share of the change in light does not count.
    """
    problem = without.problem
    drive = problem.drive
    full = drive.any(axis=1) & np.isin(drive, (0.0, 1.0)).all(axis=1)
    plain, dimmed = (
        predict(problem, State(terms, whole.tips, whole.gains))[full]
        for terms in (without.terms, (*without.terms, term))
    )
    light = dimmed[:, 1:2] / plain[:, 1:2]
    change = float(np.abs(light - 1.0).max())
    return change > SAME_COLOUR and np.allclose(dimmed, plain * light, max(SAME_COLOUR, share * change))


def typical(effect: Effect) -> Term:
    """Return the term of an effect at its typical size."""
    return Term.at_rest(effect, (), **effect.typical())


def _rivals(each: Candidate, beside: Sequence[Candidate], effects: Sequence[Effect], base: Fit) -> tuple[Family, ...]:
    """Return the families that explain the readings as well as an admitted effect, in its place."""
    names = {each.effect.name, *(other.effect.name for other in beside)}
    without, whole = together(base, beside), together(base, [*beside, each])
    ratio = GainRatio()
    ratio.update(best_linear_gain(without.score, each.effect, each.form), without.chi2 - whole.chi2)
    mine = min(whole.bic, bic(each))  # fits from two starts: χ² differs by the tolerance of a fit
    limit = mine + 2 * STRONG
    others = [effect for effect in effects if effect.name not in names]
    near = contenders(without, others, limit, ratio)
    # An effect may be invisible only because its condition was not logged, for example room light that was always on.
    for effect in others:
        if effect.name in each.effect.confused_with and (problem := base.problem.unlogged(effect.needs)):
            near += contenders(fit(problem, without.terms, without.state), [effect], limit)

    if base.problem.from_first_hour and only_dims(without, whole, each.term):
        # The admitted effect leaves all chromaticities constant. An effect that changes colours then fits only because
        # its parts dim equally: it is a rival only if its parts differ, and its BIC is clearly lower.
        near = [
            rival
            for rival in near
            if only_dims(without, whole, typical(rival.effect))
            or (bic(rival.best) < mine - STRONG and not only_dims(without, whole, rival.best.term, EVENLY))
        ]
    # Formulas of related effects differ little, and no display follows a formula exactly. Therefore a related effect is
    # excluded only by twice the usual difference in BIC, and with it every effect that explains the readings better.
    tied = [bic(rival.best) for rival in near if bic(rival.best) < mine + STRONG]
    kin = [bic(rival.best) for rival in near if each.effect.is_kin(rival.effect) and bic(rival.best) < limit]
    worst = max(tied or kin, default=-np.inf)
    return tuple(rival for rival in near if bic(rival.best) <= worst)
