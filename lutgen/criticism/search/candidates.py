"""Fit every form of an effect to the readings from its best start, and rank the effects by BIC.

A *family* is all forms of one effect. A *form* is a set of free parameters. The *linear gain* of a form is the decrease
of χ² that the first linear step of its fit predicts; the *gain* is the decrease that the full fit reaches.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.code_shifts import FITTED
from lutgen.criticism.fit.linear import Term, grid_values
from lutgen.criticism.search.forms import FORMULA, all_forms, is_formula, is_proposed, is_refined, simple_forms
from lutgen.effects.shapes import COURSE
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.score import Score
    from lutgen.effects import Effect

#: Smallest difference in BIC that prefers one explanation to another ("strong" in Kass & Raftery 1995,
#: doi:10.1080/01621459.1995.10476572).
STRONG = 6.0

#: A form longer than a formula is accepted only if a formula reaches more than ``HALF`` of its gain in χ².
HALF = 0.5

#: Share of an effect's χ² that its formula must explain.
MOST_OF_IT = 0.95

#: A grid with more settings than this is tried only if its first parameter alone is promising.
MANY = 20

#: Ratio by which the gain of a full fit may exceed the linear gain, which comes from few starts.
OPTIMISM = 1.6

#: Gain per parameter that AIC asks for (Akaike 1974, doi:10.1109/TAC.1974.1100705); noise gains 1. If the amplitudes of
#: a form gain less at the usual shape, the search tries no other shapes.
AIC = 2.0

#: A refined form whose linear gain is below this share of its own penalty is not fitted.
WORTH = 0.6


@dataclass(frozen=True)
class Candidate:
    """One form of an effect, fitted together with the terms of a base fit.

    ``gain``: decrease of χ² against the base fit. ``refined``: the form is not a simple formula of the effect.
    ``settings``: number of grid settings that were compared before this one was fitted.
    """

    effect: Effect
    form: tuple[str, ...]
    fit: Fit
    gain: float
    refined: bool
    settings: int = 1

    @property
    def term(self) -> Term:
        """The effect's term in the fit."""
        return next(term for term in self.fit.terms if term.effect.name == self.effect.name)

    @property
    def is_at_limit(self) -> bool:
        """Whether an amplitude lies at a physical bound other than its neutral value."""
        values, rest, parameters = self.term.values, self.effect.neutral, self.effect.parameters
        return any(
            parameters[name].is_at_bound(values[name]) and not parameters[name].is_at(rest[name], values[name])
            for name in set(self.term.free) & set(rest)
        )


@dataclass(frozen=True)
class Family:
    """The fitted forms of one effect: the best by BIC, the best of the simple forms, and how many were tried.

    ``alike``: the other forms inside their limits whose BIC is not clearly higher than that of the best.
    """

    effect: Effect
    best: Candidate
    simple: Candidate
    tried: int
    alike: tuple[Candidate, ...] = ()

    @classmethod
    def of(cls, fitted: Sequence[Candidate]) -> Family:
        """Choose the best forms; without a simple form the first one takes its place.

        A form at a physical limit is the best only if no other form explains nearly as much inside the limits.
        """
        simple = [each for each in fitted if not each.refined] or fitted[:1]
        best = min(fitted, key=bic)
        inside = [each for each in fitted if not each.is_at_limit]
        if best.is_at_limit:
            best = min((each for each in inside if each.gain > MOST_OF_IT * best.gain), key=bic, default=best)
        alike = tuple(each for each in inside if each is not best and bic(each) < bic(best) + STRONG)
        return cls(fitted[0].effect, best, min(simple, key=bic), len(fitted), alike)

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name


class GainRatio:
    """Ratio by which the gains of one search may exceed their linear gains."""

    def __init__(self) -> None:
        """Begin with the usual ratio."""
        self.ratio, self._largest = OPTIMISM, 0.0

    def update(self, linear_gain: float, gain: float) -> None:
        """Update the ratio from the fit with the largest gain so far.

        If outliers have small weights, the linear gain is a small part of the gain.
        """
        if gain > self._largest:
            self.ratio, self._largest = max(OPTIMISM, OPTIMISM * gain / max(linear_gain, 1e-9)), gain


def families(
    base: Fit, effects: Iterable[Effect], *, within: float = np.inf, limit: float = np.inf
) -> Iterator[Family]:
    """Fit every effect together with the terms of ``base``, one effect after the other, in the given order.

    ``within``: the refined forms of an effect are fitted only if their linear gains predict a BIC that is at most this
    much above the best effect's BIC. ``limit``: effects whose simple formulas cannot bring BIC below this limit are
    left out.
    """
    ratio, effects, may_skip = GainRatio(), list(effects), limit < np.inf
    simple, best = dict[str, list[Candidate]](), np.inf
    # Proposed settings take long to find. They are fitted last, and only if they may be as good as the other effects.
    for effect in sorted(effects, key=lambda each: bool(each.propose)):
        reach = min(limit, best + within) if may_skip and effect.propose else limit
        forms = _simple(effect, may_skip)
        simple[effect.name] = _fitted_forms(base, effect, ratio, forms, limit=reach, may_skip=may_skip)
        best = min([best, *map(bic, simple[effect.name])])
    for effect in effects:
        fitted = simple[effect.name]
        if not fitted:
            continue
        rest = [form for form in effect.forms if form not in _simple(effect, may_skip)]
        refined = _fitted_forms(base, effect, ratio, rest, limit=best + within)
        both = _without_mimics(base, _with_skipped_formulas(base, ratio, [*fitted, *refined]))
        best = min(best, *map(bic, both))
        yield Family.of(both)


def _simple(effect: Effect, may_skip: bool) -> list[tuple[str, ...]]:
    """Return an effect's simple formulas; with ``may_skip`` also the forms of proposed settings."""
    return [form for form in effect.forms if not is_refined(effect, form) or (may_skip and is_proposed(effect, form))]


def contenders(base: Fit, effects: Iterable[Effect], limit: float, ratio: GainRatio | None = None) -> list[Family]:
    """Return the families with which the BIC of ``base`` falls below a limit, best first.

    Families that cannot reach the limit are not fitted.
    """
    ratio, below = ratio or GainRatio(), []
    for effect in effects:
        fitted = _fitted_forms(base, effect, ratio, all_forms(effect), limit=limit, may_skip=True)
        if fitted and min(map(bic, fitted)) < limit:
            fitted = _without_mimics(base, _with_skipped_formulas(base, ratio, fitted))
            below.append(Family.of(fitted))
    return sorted((each for each in below if bic(each.best) < limit), key=lambda each: bic(each.best))


def family(
    base: Fit,
    effect: Effect,
    ratio: GainRatio | None = None,
    *,
    freely: bool = False,
    limit: float = np.inf,
    longest: int | None = None,
) -> Family:
    """Fit the forms of an effect together with the terms of ``base``, and choose the best by BIC.

    ``freely``: allow a long form although no formula has half of its gain, because the user knows that the effect is
    there. ``limit``, ``longest``: apart from the simplest form, fit only forms that may bring BIC below ``limit``, and
    that have at most ``longest`` parameters.
    """
    ratio = ratio or GainRatio()
    first, *others = all_forms(effect)
    forms = [first, *(form for form in others if longest is None or len(form) <= longest)]
    fitted = _fitted_forms(base, effect, ratio, forms, limit=limit)
    if not fitted:
        raise _one_session(base, effect)
    if freely:
        allowed = [*fitted, *_joined(base, fitted)]
    else:
        allowed = _without_mimics(base, _with_skipped_formulas(base, ratio, fitted))
    return replace(Family.of(allowed), tried=len(fitted))


def _without_mimics(base: Fit, fitted: Sequence[Candidate]) -> list[Candidate]:
    """Leave out each long form if no formula has half of its gain: with many parameters a form imitates any effect.

    A formula with more than ``FORMULA`` parameters counts only for forms with up to ``FORMULA`` further parameters.
    """
    formulas = [each for each in fitted if is_formula(each.effect, each.form)]

    def has_formula(long: Candidate) -> bool:
        near = [each for each in formulas if len(each.form) <= FORMULA or len(long.form) <= len(each.form) + FORMULA]
        best = max(near, key=lambda each: each.gain, default=None)
        needed = HALF * long.gain
        return best is not None and (best.gain > needed or _with_time_course(base, best, long).gain > needed)

    return [each for each in fitted if is_formula(each.effect, each.form) or has_formula(each)]


def _with_time_course(base: Fit, formula: Candidate, long: Candidate) -> Candidate:
    """Fit a formula with the time course of a long form: the time course does not identify an effect."""
    course = [name for name in long.form if name in COURSE and name not in formula.form]
    if not course:
        return formula
    form = (*formula.form, *course)
    values = {name: long.term.values[name] for name in course}
    start = Term.at_rest(formula.effect, form, **{**formula.term.values, **values})
    refitted = base.with_terms((*base.terms, start))
    return replace(formula, form=form, fit=refitted, gain=base.chi2 - refitted.chi2)


def _with_skipped_formulas(base: Fit, ratio: GainRatio, fitted: Sequence[Candidate]) -> list[Candidate]:
    """Fit the formulas that ``limit`` skipped: they decide whether a long form is accepted."""
    effect, known = fitted[0].effect, {each.form for each in fitted}
    if all(is_formula(effect, form) for form in known):
        return list(fitted)
    skipped = [form for form in effect.forms if is_formula(effect, form) and form not in known]
    return [*fitted, *_fitted_forms(base, effect, ratio, skipped)]


def best_start(base: Fit, effect: Effect) -> Term:
    """Return the start, among an effect's simple forms, with the largest linear gain minus its penalty."""
    score, penalty = base.score, float(np.log(base.readings))
    starts = [
        (gain - penalty * len(form), term)
        for form in simple_forms(effect)
        for gain, term in (_start(score, effect, form, grid) for grid in _grids(score, effect, form))
    ]
    if not starts:
        raise _one_session(base, effect)
    return max(starts, key=lambda start: start[0])[1]


def _one_session(base: Fit, effect: Effect) -> LutgenError:
    return LutgenError(
        f"{effect.name} happens between two sessions, but {base.problem.readings.file} holds one. Add a later session."
    )


def forms_of(base: Fit, effect: Effect, *, freely: bool = False) -> list[Candidate]:
    """Fit all forms of an effect together with the terms of ``base``; return them best by BIC first.

    ``freely``: allow a long form although no formula has half of its gain.
    """
    fitted = _fitted_forms(base, effect, GainRatio(), all_forms(effect))
    allowed = fitted if freely else _without_mimics(base, fitted)
    return sorted([*allowed, *_joined(base, allowed)], key=bic)


def _joined(base: Fit, fitted: Sequence[Candidate]) -> list[Candidate]:
    """Join the best form of an effect with its other forms, one after another, while BIC clearly falls.

    An effect declares a few forms; a display may need the parameters of two of them. The parameters of the other form
    are freed at the best fit, where a linear step predicts their gain.
    """
    joined: list[Candidate] = []
    best = min(fitted, key=bic, default=None)
    while best and not is_proposed(best.effect, best.form):
        longer = (_joined_with(base, best, form) for form in best.effect.forms)
        better = min((each for each in longer if each), key=bic, default=best)
        if bic(better) > bic(best) - STRONG:
            break
        joined.append(best := better)
    return joined


def _joined_with(base: Fit, best: Candidate, other: tuple[str, ...]) -> Candidate | None:
    """Free the parameters of another form too; None if there are none, or if BIC cannot fall by ``STRONG``."""
    effect = best.effect
    added = [name for name in other if name not in best.form and not effect.parameters[name].grid]
    if not added or base.parameters + len(best.form) + len(added) > base.problem.max_parameters:
        return None
    freed = replace(best.term, free=(*best.term.free, *added))
    terms = tuple(freed if term is best.term else term for term in best.fit.terms)
    system = best.fit.system_of(terms)
    predicted = OPTIMISM * (system.chi2 - system.step(terms).chi2)
    if predicted <= STRONG + len(added) * float(np.log(base.readings)):
        return None
    form, fit = (*best.form, *added), best.fit.with_terms(terms)
    return replace(best, form=form, fit=fit, gain=base.chi2 - fit.chi2, refined=is_refined(effect, form))


def _fitted_forms(
    base: Fit,
    effect: Effect,
    ratio: GainRatio,
    forms: Iterable[tuple[str, ...]],
    *,
    limit: float = np.inf,
    may_skip: bool = False,
) -> list[Candidate]:
    """Fit the forms whose linear gain is large enough, and always the simplest form, unless ``may_skip``."""
    score, fitted = base.score, list[Candidate]()
    formulas = [form for form in all_forms(effect) if is_formula(effect, form)]
    for form in forms:
        if base.parameters + len(form) > base.problem.max_parameters:
            continue  # the readings cannot determine this number of parameters
        penalty = len(form) * float(np.log(base.readings))
        if is_proposed(effect, form) and base.bic - ratio.ratio * score.code_shifts.most + penalty > limit:
            continue  # no setting gains more than free shifts, one for each code value
        needed = HALF * (base.bic - limit)  # a long form is accepted only if a formula gains more
        reached = (ratio.ratio * best_linear_gain(score, effect, formula) >= needed for formula in formulas)
        if needed > 0.0 and form not in formulas and not any(reached):
            continue
        grids = _grids(score, effect, form)
        if not grids:
            continue  # the grid lies between sessions, and there is only one session
        is_long = len(grids) > MANY and not is_proposed(effect, form)
        if is_long and best_linear_gain(score, effect, form[:1]) < WORTH * penalty / len(form):
            continue
        starts = [_start(score, effect, form, grid) for grid in grids]
        linear_gain = max(gain for gain, _ in starts)
        hopeless = base.bic - ratio.ratio * linear_gain + penalty > limit
        if (form != all_forms(effect)[0] or may_skip) and (hopeless or linear_gain < WORTH * penalty):
            continue
        starts.sort(key=lambda start: -start[0])
        fits = [base.with_terms((*base.terms, term)) for _, term in starts[:2]]
        best = min(fits, key=lambda each: each.chi2)
        gain = base.chi2 - best.chi2
        ratio.update(linear_gain, gain)
        settings = score.proposed(effect)[1] if is_proposed(effect, form) else 1
        fitted.append(Candidate(effect, form, best, gain, is_refined(effect, form), settings))
    return fitted


def best_linear_gain(score: Score, effect: Effect, form: tuple[str, ...]) -> float:
    """Return the largest linear gain of a form over all settings of its grid."""
    return max((_start(score, effect, form, grid)[0] for grid in _grids(score, effect, form)), default=0.0)


def bic(candidate: Candidate) -> float:
    """BIC of a candidate's fit."""
    return candidate.fit.bic


def _grids(score: Score, effect: Effect, form: tuple[str, ...]) -> list[dict[str, float]]:
    """Return all settings of a form's grid parameters; if there are too many, those that the effect proposes."""
    if is_proposed(effect, form):
        return [setting for setting in score.proposed(effect)[0] if set(setting) == set(form)][:FITTED]
    settings: list[dict[str, float]] = [{}]
    for name in form:
        if effect.parameters[name].grid:
            values = grid_values(effect.parameters[name], score.problem.hours)
            settings = [{**setting, name: value} for setting in settings for value in values]
    return settings


def _start(score: Score, effect: Effect, form: tuple[str, ...], grid: dict[str, float]) -> tuple[float, Term]:
    """Return the largest linear gain of a form, and the start that gives this gain; cached in the score."""
    key = effect.name, form, *grid.items()
    if key not in score.starts:
        score.starts[key] = _find_start(score, effect, form, grid)
    return score.starts[key]


def _find_start(score: Score, effect: Effect, form: tuple[str, ...], grid: dict[str, float]) -> tuple[float, Term]:
    fitted = [name for name in form if not effect.parameters[name].grid]
    amplitudes = [name for name in fitted if name in effect.neutral]
    shapes = [name for name in fitted if name not in effect.neutral]
    values = [grid, *({**grid, name: value} for name in shapes for value in _thirds(effect, name))]
    starts = (Term.at_rest(effect, form, **each) for each in values)
    best = score.gain(first := next(starts), amplitudes), first
    if best[0] > AIC * len(amplitudes):
        best = max([best, *((score.gain(start, amplitudes), start) for start in starts)], key=lambda start: start[0])
    if best[0] > 0 or not amplitudes:
        return best
    # The effect acts only beyond a threshold: its gradient is zero at rest, so the search starts at the typical size.
    typical = Term.at_rest(effect, form, **({name: effect.parameters[name].value for name in form} | grid))
    return score.gain_of_typical(typical), typical


def _thirds(effect: Effect, name: str) -> list[float]:
    """Return two more start values of a shape parameter: a third and two thirds of the way between its bounds."""
    low, high = effect.parameters[name].bounds
    if low > 0 and high / low > 10:
        return [float(low ** (1 - share) * high**share) for share in (1 / 3, 2 / 3)]
    return [low + (high - low) / 3, low + 2 * (high - low) / 3]
