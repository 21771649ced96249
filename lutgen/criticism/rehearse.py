"""Rehearse the diagnosis of an effect: whether these readings show it, which effects resemble it, whether it is found.

The effect is added to the display that fits the readings without effects, at three times its smallest detectable size,
together with seeded noise of the readings' covariance. Then the usual search runs. Users can test an effect of their
own in this way before they apply it to real data.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, Term, grid_values, predict, whiten
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.search.candidates import family
from lutgen.criticism.search.forms import all_forms, simple_forms
from lutgen.criticism.search.stepwise import explain
from lutgen.criticism.verdict.visibility import away_from_rest, threshold, visibility
from lutgen.effects.declare import PROPOSED
from lutgen.errors import listed
from lutgen.numerals import in_percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.search.explanation import Explanation
    from lutgen.criticism.verdict.visibility import Visibility
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

SEED = 20150319

#: Size of the added effect in units of the smallest detectable size: nearly every campaign finds this size.
TIMES = 3.0

#: A size is recovered if it differs from the added size by at most this number of standard errors.
WITHIN = 3.0

#: An effect is recovered if the search names at most this number of effects in its place, itself included.
MOST_ALIKE = 2


@dataclass(frozen=True)
class Rehearsal:
    """What these readings could show of an effect.

    Attributes
    ----------
    absorbed
        Share of the effect's signature (in χ²) that the tips absorb; None if it has no signature.
    smallest_detectable, unit, parameter
        The size that nine of ten such campaigns would show (None if no size shows), its unit and its parameter.
    likeness
        Effect → cosine between both signatures after projection off the tips, with each other effect in its most
        similar simple form; most similar first.
    recovered
        Whether the search finds the added effect again (alone, or as one of two) with its size.
    sentence
        The result in plain words.

    """

    absorbed: float | None
    smallest_detectable: float | None
    unit: str
    parameter: str
    likeness: list[tuple[str, float]]
    recovered: bool
    sentence: str

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {**asdict(self), "likeness": [list(pair) for pair in self.likeness]}


def rehearse(effect: Effect, measurements: Measurements, others: Sequence[Effect]) -> Rehearsal:
    """Add an effect to a display like the measured one, and search for the effect.

    Parameters
    ----------
    effect
        The effect, which must keep the contract.
    measurements
        Readings that give patches, conditions and noise.
    others
        The other effects that the search may choose from.

    Raises
    ------
    LutgenError
        Readings that cannot be used.

    """
    problem = Problem.of(measurements, baseline=effect.baseline)
    base = fit(problem)
    seen = visibility(base, [effect])[0]
    rivals = [each for each in others if each.name != effect.name and effect.baseline in {each.baseline, "first-hour"}]
    term = _put_in(base, effect, seen)
    sentence, recovered = (_unseen(effect, seen), False) if term is None else _recovery(base, term, rivals, seen)
    return Rehearsal(
        seen.absorbed,
        seen.smallest_detectable,
        seen.unit,
        seen.parameter,
        likeness(base, effect, seen, rivals),
        recovered,
        sentence,
    )


def likeness(base: Fit, effect: Effect, seen: Visibility, others: Sequence[Effect]) -> list[tuple[str, float]]:
    """Return the cosine between an effect's signature and each other effect's, projected off the tips.

    The most similar effect is first. The list is empty if the tips absorb the effect.
    """
    if seen.absorbed is None or (_is_amplitude(effect, seen.parameter) and seen.smallest_detectable is None):
        return []
    amplitudes = (seen.parameter,) if _is_amplitude(effect, seen.parameter) else ()
    mine = _signatures(base, _settings(base.problem, effect, [_form_of(effect, seen)])[0], amplitudes)[0]
    cosine_of = []
    for other in others:
        cosines = [0.0]
        for term in _settings(base.problem, other, simple_forms(other)):
            columns = _signatures(base, term, [name for name in term.free if name in other.neutral])
            u, s, _ = np.linalg.svd(columns.T, full_matrices=False)
            along = u[:, s > 1e-6 * max(float(s[0]), 1e-300)].T @ mine
            cosines.append(float(np.linalg.norm(along) / max(float(np.linalg.norm(mine)), 1e-300)))
        cosine_of.append((other.name, min(max(cosines), 1.0)))
    return sorted(cosine_of, key=lambda each: (-each[1], each[0]))


def _is_amplitude(effect: Effect, name: str) -> bool:
    """Whether a parameter is a continuous size, not a setting of a grid."""
    return name in effect.neutral and not effect.parameters[name].grid


def _form_of(effect: Effect, seen: Visibility) -> tuple[str, ...]:
    """Return the first form of an effect that frees the parameter of its visibility."""
    forms = all_forms(effect)
    return next((form for form in forms if seen.parameter in form), forms[0])


def _settings(problem: Problem, effect: Effect, forms: Sequence[tuple[str, ...]]) -> list[Term]:
    """Return an effect at rest in several forms, each with all settings of its grids."""
    terms = []
    for form in forms:
        given = {
            name: effect.parameters[name]
            for name in form
            if effect.parameters[name].grid and effect.parameters[name].grid != PROPOSED
        }
        values = [grid_values(each, problem.hours) or [each.value] for each in given.values()]
        terms += [Term.at_rest(effect, form, **dict(zip(given, each, strict=True))) for each in product(*values)]
    return terms


def _signatures(base: Fit, term: Term, amplitudes: Sequence[str]) -> Array:
    """Return the signatures of amplitudes, or of switching the effect on, projected off the tips, (k, 3n)."""
    if not amplitudes:
        changed = predict(base.problem, State((*base.terms, term), base.tips, base.gains))
        return base.score.project(whiten(base.problem, changed - base.predicted))[np.newaxis]
    return np.array([base.score.seen(term, name)[1] for name in amplitudes])


def _put_in(base: Fit, effect: Effect, seen: Visibility) -> Term | None:
    """Return the effect at the size of the rehearsal; None if the readings show no possible size."""
    if not seen.visible:
        return None
    settings = _settings(base.problem, effect, [_form_of(effect, seen)])
    if not _is_amplitude(effect, seen.parameter):
        strength = [base.score.switched(term)[1] for term in settings]
        enough = [each for each in strength if each >= TIMES * threshold(base)]
        return settings[strength.index(min(enough) if enough else max(strength))]
    value = away_from_rest(effect, seen.parameter, TIMES * (seen.smallest_detectable or 0.0))
    middle = settings[len(settings) // 2]
    return replace(middle, values={**middle.values, seen.parameter: value})


def _unseen(effect: Effect, seen: Visibility) -> str:
    """Say why these readings cannot show an effect."""
    if seen.absorbed is None:
        needs = f" It needs the columns {', '.join(effect.needs)}." if effect.needs else ""
        return f"It changes none of these readings, so nothing can be rehearsed.{needs}"
    if not _is_amplitude(effect, seen.parameter):
        return "It shows too little in these readings, at every setting."
    if seen.smallest_detectable is None:
        advice = (
            ' Measure more than white and primaries, or declare it with baseline="first-hour".'
            if effect.baseline == "colour-points"
            else ""
        )
        absorbed = f"White and primaries take up {in_percent(seen.absorbed, 1)} of it"
        return f"{absorbed}: no size of it shows in these readings.{advice}"
    least = _with_unit(seen.smallest_detectable, seen.unit)
    most = max(map(abs, effect.parameters[seen.parameter].bounds))
    return f"It would show from {seen.parameter} = {least} on, and its bounds end at {most:g}."


def _recovery(base: Fit, term: Term, rivals: Sequence[Effect], seen: Visibility) -> tuple[str, bool]:
    """Simulate the effect, search for it, and return the sentence and whether the effect was recovered."""
    simulated = fit(with_readings_of(base, term, np.random.default_rng(SEED)))
    explanation = explain(simulated, [*rivals, term.effect], PureError.of(simulated.problem))
    start = f"Put into these readings{_size_put_in(term, seen)}, "
    names = _names_for(explanation, term.effect.name)
    if not names:
        wrong = listed(step.name for step in explanation.steps)
        return start + (f"it is taken for {wrong}." if wrong else "it is not found."), False
    size, is_right = _recovered_size(simulated, term, seen)
    others = [step.name for step in explanation.steps if step.name not in names]
    if others:
        wrong = f"the search finds it, but also finds {listed(others)}, which the simulation does not contain"
        return f"{start}{wrong}{size}.", False
    rest = [name for name in names if name != term.effect.name]
    if rest:
        size += f"; these readings cannot tell it from {listed(rest, 'or')}"
    result = "it is found again" if is_right else "it is found, but with the wrong size"
    return f"{start}{result}{size}.", is_right and len(names) <= MOST_ALIKE


def with_readings_of(base: Fit, term: Term, rng: np.random.Generator) -> Problem:
    """Return the problem of new readings of the fitted display with an effect: with new noise and session gains."""
    problem = base.problem
    light = predict(problem, State((replace(term, free=()),), base.tips, np.zeros_like(base.gains)))
    _, session = np.unique(
        [f"{hour}\0{name}" for hour, name in zip(problem.hour_of, _sessions(problem), strict=True)],
        return_inverse=True,
    )
    gains = problem.noise.session * rng.standard_normal(int(session.max()) + 1)
    light = light * (1.0 + gains[session.reshape(-1)])[:, np.newaxis]
    root = np.linalg.cholesky(problem.covariance(light))
    return problem.with_light(light + np.einsum("nij,nj->ni", root, rng.standard_normal(light.shape)))


def _sessions(problem: Problem) -> Array:
    return np.array(problem.readings.session or [""] * problem.readings.hours.size)[problem.rows]


def _size_put_in(term: Term, seen: Visibility) -> str:
    """Say at which size an effect is added."""
    if not seen.parameter:
        return ""
    value = term.values[seen.parameter]
    size = f" at {_with_unit(value, seen.unit)}"
    if seen.smallest_detectable is None or not _is_amplitude(term.effect, seen.parameter):
        return size
    times = abs(value - term.effect.neutral[seen.parameter]) / seen.smallest_detectable
    if times > 0.999 * TIMES:
        return f"{size}, three times the smallest detectable size"
    return f"{size}, the largest size allowed and {times:.1f} times the smallest detectable one"


def _recovered_size(simulated: Fit, term: Term, seen: Visibility) -> tuple[str, bool]:
    """Fit the effect in the form that was added, and say its size; also return whether this size is right."""
    if not seen.parameter:
        return "", True
    simple = replace(term.effect, forms=(_form_of(term.effect, seen),), refined=1)
    recovered = family(simulated, simple).best
    value, true_value = recovered.term.values[seen.parameter], term.values[seen.parameter]
    error = recovered.fit.stderr[-1].get(seen.parameter)
    if error is None:
        return f": {_with_unit(value, seen.unit)}", bool(value == true_value)
    if not np.isfinite(error):
        return "; these readings do not determine its size", False
    decimals = max(-int(np.floor(np.log10(error))), 0)
    unit = "" if seen.unit in {"", "1"} else f" {seen.unit}"
    return f": {value:.{decimals}f} ± {error:.{decimals}f}{unit}", bool(abs(value - true_value) <= WITHIN * error)


def _names_for(explanation: Explanation, name: str) -> tuple[str, ...]:
    """Return an effect and its rivals if the search has found the effect or one of its rivals; otherwise ()."""
    for step in explanation.steps:
        names = (step.name, *(rival.name for rival in step.rivals))
        if name in names:
            return names
    return ()


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3g}" + ("" if unit in {"", "1"} else f" {unit}")
