"""Trying effects on a problem: every form of a family from its best start, families ranked by BIC."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.code_shifts import FITTED
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term
from lutgen.effects.declare import PROPOSED
from lutgen.effects.shapes import COURSE
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from lutgen.criticism.fit.score import Score
    from lutgen.effects import Effect

#: ΔBIC from which one explanation is preferred to another ("strong" in Kass & Raftery 1995,
#: doi:10.1080/01621459.1995.10476572).
STRONG = 6.0

#: A formula of so many numbers says what an effect is. A longer form is still that effect where a formula explains more
#: than half of what the longer form does.
FORMULA, HALF = 3, 0.5

#: A grid of several parameters with more settings than this is walked only where its first parameter alone promises.
MANY = 20

#: By how much a full fit may beat the promise of its first step, which is linear and has few starts.
OPTIMISM = 1.6

#: A refined form whose linearised gain in χ² is below this share of its own penalty is not worth a fit.
WORTH = 0.6


@dataclass(frozen=True)
class Candidate:
    """One form of an effect, fitted beside others.

    ``gain``: by how much it lowers χ². ``refined``: it is not the effect's simple formula. ``settings``: how many were
    looked at before this one was fitted.
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


@dataclass(frozen=True)
class Family:
    """All forms of one effect that were fitted: the best by BIC, and the simple formula."""

    effect: Effect
    best: Candidate
    simple: Candidate
    tried: int

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name


class Luck:
    """By how much fits of one search beat what their first steps promise."""

    def __init__(self) -> None:
        """Begin with what is usual."""
        self.optimism, self._largest = OPTIMISM, 0.0

    def learn(self, promise: float, gain: float) -> None:
        """Learn from the largest gain of a fit so far.

        Where slips are weighed down, a first step promises little of what the fit gains.
        """
        if gain > self._largest:
            self.optimism, self._largest = max(OPTIMISM, OPTIMISM * gain / max(promise, 1e-9)), gain


def families(
    base: Fit, effects: Iterable[Effect], *, within: float = np.inf, limit: float = np.inf
) -> Iterator[Family]:
    """Fit every effect beside what ``base`` has already, one after the other, in the order given.

    ``within``: families that cannot come this near to the best one's BIC need not be refined beyond their simple
    formulas. What a form may reach is judged from its first step. ``limit``: effects whose simple formulas cannot bring
    BIC below it are left out.
    """
    luck, effects, spare = Luck(), list(effects), limit < np.inf
    simple = [_attempts(base, effect, luck, _simple(effect, spare), limit=limit, spare=spare) for effect in effects]
    best = min((min(map(bic, tried)) for tried in simple if tried), default=np.inf)
    for effect, tried in zip(effects, simple, strict=True):
        if not tried:
            continue
        rest = [at for at in range(len(effect.forms)) if at not in _simple(effect, spare)]
        refined = _attempts(base, effect, luck, rest, limit=best + within)
        both = _of_the_family(base, _with_spared(base, luck, [*tried, *refined]))
        best = min(best, *map(bic, both))
        yield Family(effect, min(both, key=bic), tried[0], len(both))


def _simple(effect: Effect, spare: bool) -> list[int]:
    """Places of an effect's simple formulas; beside another effect that is to be spared, also of proposed settings."""
    forms = enumerate(effect.forms)
    return [at for at, form in forms if at < effect.refined or (spare and _is_proposed(effect, form))]


def contenders(base: Fit, effects: Iterable[Effect], limit: float, luck: Luck | None = None) -> list[Family]:
    """Families whose BIC beside ``base`` is below a limit, best first; those that cannot reach it are not fitted."""
    luck, found = luck or Luck(), []
    for effect in effects:
        tried = _attempts(base, effect, luck, range(max(len(effect.forms), 1)), limit=limit, spare=True)
        if tried and min(map(bic, tried)) < limit:
            tried = _of_the_family(base, _with_spared(base, luck, tried))
            found.append(Family(effect, min(tried, key=bic), tried[0], len(tried)))
    return sorted((each for each in found if bic(each.best) < limit), key=lambda each: bic(each.best))


def family(
    base: Fit,
    effect: Effect,
    luck: Luck | None = None,
    *,
    freely: bool = False,
    limit: float = np.inf,
    longest: int | None = None,
) -> Family:
    """Fit the forms of an effect beside what ``base`` has already, and choose the best by BIC.

    ``freely``: also a long form of which no formula explains half, since somebody knows that the effect is there.
    ``limit``, ``longest``: but for the simplest form, only those that may bring BIC below it, of so many parameters.
    """
    luck = luck or Luck()
    forms = [at for at, form in enumerate(effect.forms) if not at or longest is None or len(form) <= longest]
    tried = _attempts(base, effect, luck, forms or [0], limit=limit)
    if not tried:
        raise _one_session(base, effect)
    allowed = tried if freely else _of_the_family(base, _with_spared(base, luck, tried))
    return Family(effect, min(allowed, key=bic), tried[0], len(tried))


def _is_formula(effect: Effect, form: tuple[str, ...]) -> bool:
    """Whether a form is short enough to say what the effect is; its first form always does."""
    return len(form) <= max(FORMULA, len(effect.forms[0]) if effect.forms else 0)


def _of_the_family(base: Fit, tried: Sequence[Candidate]) -> list[Candidate]:
    """Leave out long forms that do more by their freedom than any formula does: they mimic any effect."""
    formulas = [each for each in tried if _is_formula(each.effect, each.form)]
    best = max(formulas, key=lambda each: each.gain, default=None)

    def is_owed(long: Candidate) -> bool:
        needed = HALF * long.gain
        return best is not None and (best.gain > needed or _in_its_course(base, best, long).gain > needed)

    return [each for each in tried if _is_formula(each.effect, each.form) or is_owed(each)]


def _in_its_course(base: Fit, formula: Candidate, long: Candidate) -> Candidate:
    """Give a formula the course in time that a long form has, which says nothing of what an effect does."""
    course = [name for name in long.form if name in COURSE and name not in formula.form]
    if not course:
        return formula
    form = (*formula.form, *course)
    values = {name: long.term.values[name] for name in course}
    start = Term.at_rest(formula.effect, form, **{**formula.term.values, **values})
    found = fit(base.problem, (*base.terms, start), _state(base))
    return replace(formula, form=form, fit=found, gain=base.chi2 - found.chi2)


def _with_spared(base: Fit, luck: Luck, tried: Sequence[Candidate]) -> list[Candidate]:
    """Fit also the formulas that a limit has spared, where a long form is to be compared with them."""
    effect, fitted = tried[0].effect, {each.form for each in tried}
    if all(_is_formula(effect, form) for form in fitted):
        return list(tried)
    spared = [at for at, form in enumerate(effect.forms) if _is_formula(effect, form) and form not in fitted]
    return [*tried, *_attempts(base, effect, luck, spared)]


def promising(base: Fit, effect: Effect) -> Term:
    """Return the start of an effect's simple forms from which the first step promises most, penalties counted."""
    score, penalty = base.score, float(np.log(base.readings))
    forms = effect.forms[: effect.refined] or ((),)
    starts = [
        (gain - penalty * len(form), term)
        for form in forms
        for gain, term in (_start(score, effect, form, grid) for grid in _grids(score, effect, form))
    ]
    if not starts:
        raise _one_session(base, effect)
    return max(starts, key=lambda start: start[0])[1]


def _one_session(base: Fit, effect: Effect) -> LutgenError:
    return LutgenError(
        f"{effect.name} happens between two sessions, and {base.problem.readings.file} holds one. Add a later one."
    )


def forms_of(base: Fit, effect: Effect) -> list[Candidate]:
    """Fit all forms of an effect beside what ``base`` has already: best by BIC first."""
    return sorted(_of_the_family(base, _attempts(base, effect, Luck(), range(max(len(effect.forms), 1)))), key=bic)


def _attempts(
    base: Fit,
    effect: Effect,
    luck: Luck,
    indices: Iterable[int],
    *,
    limit: float = np.inf,
    spare: bool = False,
) -> list[Candidate]:
    """Fit some forms when their first step promises enough; the simplest in any case, unless to ``spare``."""
    score, tried = base.score, list[Candidate]()
    forms = effect.forms or ((),)
    for index in indices:
        form = forms[index]
        if base.parameters + len(form) > base.problem.max_parameters:
            continue  # a fit of more parameters than the readings bear says nothing
        penalty = len(form) * float(np.log(base.readings))
        if _is_proposed(effect, form) and base.bic - luck.optimism * score.code_shifts.most + penalty > limit:
            continue  # no setting can promise more than a shift of its own for each code value
        owed = HALF * (base.bic - limit)  # what a formula has to explain where this form comes below the limit
        if owed > 0.0 and not _is_formula(effect, form) and luck.optimism * _of_formulas(score, effect) < owed:
            continue
        grids = _grids(score, effect, form)
        if not grids:
            continue  # a grid between sessions, and one session only
        walked = len(grids) > MANY and not _is_proposed(effect, form)
        if walked and _promise(score, effect, form[:1]) < WORTH * penalty / len(form):
            continue
        starts = [_start(score, effect, form, grid) for grid in grids]
        promise = max(gain for gain, _ in starts)
        hopeless = base.bic - luck.optimism * promise + penalty > limit
        if (index or spare) and (hopeless or promise < WORTH * penalty):
            continue
        starts.sort(key=lambda start: -start[0])
        fits = [fit(base.problem, (*base.terms, term), _state(base)) for _, term in starts[:2]]
        best = min(fits, key=lambda found: found.chi2)
        luck.learn(promise, base.chi2 - best.chi2)
        settings = score.proposed(effect)[1] if _is_proposed(effect, form) else 1
        tried.append(Candidate(effect, form, best, base.chi2 - best.chi2, index >= effect.refined, settings))
    return tried


def _promise(score: Score, effect: Effect, form: tuple[str, ...]) -> float:
    """What the first step of a form promises at best."""
    return max((_start(score, effect, form, grid)[0] for grid in _grids(score, effect, form)), default=0.0)


def _of_formulas(score: Score, effect: Effect) -> float:
    """What the first step of an effect's formulas promises at best."""
    return max(_promise(score, effect, form) for form in effect.forms or ((),) if _is_formula(effect, form))


def bic(candidate: Candidate) -> float:
    """BIC of a candidate's fit."""
    return candidate.fit.bic


def _state(base: Fit) -> State:
    return State(base.terms, base.tips, base.gains)


def _is_proposed(effect: Effect, form: tuple[str, ...]) -> bool:
    return any(effect.parameters[name].grid == PROPOSED for name in form)


def _grids(score: Score, effect: Effect, form: tuple[str, ...]) -> list[dict[str, float]]:
    """All settings of the grid parameters that a form frees; where too many, those that the effect proposes."""
    if _is_proposed(effect, form):
        return [setting for setting in score.proposed(effect)[0] if set(setting) == set(form)][:FITTED]
    settings: list[dict[str, float]] = [{}]
    for name in form:
        grid = effect.parameters[name].grid
        if grid:
            hours = score.problem.hours
            values = (hours[1:] + hours[:-1]) / 2 if isinstance(grid, str) else grid
            settings = [{**setting, name: float(value)} for setting in settings for value in values]
    return settings


def _start(score: Score, effect: Effect, form: tuple[str, ...], grid: dict[str, float]) -> tuple[float, Term]:
    """Return the start of a form from which the first step promises most, and that promise."""
    key = effect.name, form, *grid.items()
    if key not in score.starts:
        score.starts[key] = _searched(score, effect, form, grid)
    return score.starts[key]


def _searched(score: Score, effect: Effect, form: tuple[str, ...], grid: dict[str, float]) -> tuple[float, Term]:
    amplitudes = [name for name in form if name in effect.neutral and not effect.parameters[name].grid]
    shapes = [name for name in form if name not in effect.neutral and not effect.parameters[name].grid]
    values = [grid]
    for name in shapes:
        values += [{**grid, name: value} for value in _thirds(effect, name)]
    found = max(
        (
            (score.gain(Term.at_rest(effect, form, **each), amplitudes), Term.at_rest(effect, form, **each))
            for each in values
        ),
        key=lambda start: start[0],
    )
    if found[0] > 0 or not amplitudes:
        return found
    # Beyond a threshold only: nothing moves at rest, so the search starts from the typical size.
    typical = Term.at_rest(effect, form, **({name: effect.parameters[name].value for name in form} | grid))
    return score.gain_of_typical(typical), typical


def _thirds(effect: Effect, name: str) -> list[float]:
    """Two more values of a shape parameter to start from: a third and two thirds on the way through its bounds."""
    low, high = effect.parameters[name].bounds
    if low > 0 and high / low > 10:
        return [float(low ** (1 - share) * high**share) for share in (1 / 3, 2 / 3)]
    return [low + (high - low) / 3, low + 2 * (high - low) / 3]
