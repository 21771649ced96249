"""A dress rehearsal: would these readings show an effect, what would it be taken for, would it be found again.

The display that fits the readings without effects is given the effect, at three times its smallest detectable size,
and noise of the readings' own covariance, seeded. Then it is searched for like any other. Somebody's own effect is
tried in this way before it is let loose on data.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, Term, predict, whiten
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.search.candidates import family
from lutgen.criticism.search.stepwise import explain
from lutgen.criticism.verdict.visibility import threshold, visibility
from lutgen.effects.declare import PROPOSED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.score import Score
    from lutgen.criticism.search.stepwise import Explanation
    from lutgen.criticism.verdict.visibility import Visibility
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

SEED = 20150319

#: Times the smallest detectable size at which an effect is put in: there, hardly any campaign misses it.
TIMES = 3.0

#: Standard errors within which a size is recovered.
WITHIN = 3.0

#: More names than this for one effect do not say which it is.
MOST_ALIKE = 2


@dataclass(frozen=True)
class Rehearsal:
    """What readings could show of an effect.

    Attributes
    ----------
    absorbed
        Share of its signature (in χ²) that the tips take up; None where it leaves no trace at all.
    smallest_detectable, unit, parameter
        The size that nine of ten such campaigns would show, None where no size does, and which parameter that is.
    likeness
        Effect → cosine between what the tips leave of both signatures, each other effect in whichever of its simple
        forms comes nearest; most alike first.
    recovered
        Whether the effect, put into these readings, is found again (alone, or as one of two) and in its size.
    sentence
        The rehearsal in plain words.

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
    """Put an effect into a display like the measured one, and look for it.

    Parameters
    ----------
    effect
        The effect, which must keep the contract.
    measurements
        Readings, whose patches, conditions and noise are taken.
    others
        The effects that it may be taken for.

    Raises
    ------
    LutgenError
        Readings that cannot be used.

    """
    problem = Problem.of(measurements, baseline=effect.baseline)
    base = fit(problem)
    score, seen = base.score, visibility(base, [effect])[0]
    rivals = [each for each in others if each.name != effect.name and effect.baseline in {each.baseline, "first-hour"}]
    term = _put_in(score, effect, seen)
    sentence, recovered = (_unseen(effect, seen), False) if term is None else _recovery(base, term, rivals, seen)
    return Rehearsal(
        seen.absorbed,
        seen.smallest_detectable,
        seen.unit,
        seen.parameter,
        likeness(score, effect, seen, rivals),
        recovered,
        sentence,
    )


def likeness(score: Score, effect: Effect, seen: Visibility, others: Sequence[Effect]) -> list[tuple[str, float]]:
    """Cosine between what the tips leave of an effect's signature and of each other effect's, most alike first.

    Empty where they leave nothing of it.
    """
    if seen.absorbed is None or (_is_amplitude(effect, seen.parameter) and seen.smallest_detectable is None):
        return []
    amplitudes = (seen.parameter,) if _is_amplitude(effect, seen.parameter) else ()
    mine = _signatures(score, _settings(score, effect, effect.forms[:1])[0], amplitudes)[0]
    found = []
    for other in others:
        cosines = [0.0]
        for term in _settings(score, other, other.forms[: other.refined]):
            columns = _signatures(score, term, [name for name in term.free if name in other.neutral])
            u, s, _ = np.linalg.svd(columns.T, full_matrices=False)
            along = u[:, s > 1e-6 * max(float(s[0]), 1e-300)].T @ mine
            cosines.append(float(np.linalg.norm(along) / max(float(np.linalg.norm(mine)), 1e-300)))
        found.append((other.name, min(max(cosines), 1.0)))
    return sorted(found, key=lambda each: (-each[1], each[0]))


def _is_amplitude(effect: Effect, name: str) -> bool:
    """Whether a parameter is a size that slides, not a setting to be tried one by one."""
    return name in effect.neutral and not effect.parameters[name].grid


def _settings(score: Score, effect: Effect, forms: Sequence[tuple[str, ...]]) -> list[Term]:
    """Return an effect at rest in several forms, each with all settings of its grids."""
    gaps = tuple((score.problem.hours[1:] + score.problem.hours[:-1]) / 2)
    found = []
    for form in forms or ((),):
        given = {
            name: effect.parameters[name]
            for name in form
            if effect.parameters[name].grid and effect.parameters[name].grid != PROPOSED
        }
        values = [(gaps if isinstance(each.grid, str) else each.grid) or (each.value,) for each in given.values()]
        found += [Term.at_rest(effect, form, **dict(zip(given, each, strict=True))) for each in product(*values)]
    return found


def _signatures(score: Score, term: Term, amplitudes: Sequence[str]) -> Array:
    """What the tips leave of the signatures of amplitudes; without any, of switching the effect on: (k, 3n)."""
    if not amplitudes:
        changed = predict(score.problem, State((*score.base.terms, term), score.base.tips, score.base.gains))
        return score.project(whiten(score.problem, changed - score.base.predicted))[np.newaxis]
    return np.array([score.seen(term, name)[1] for name in amplitudes])


def _put_in(score: Score, effect: Effect, seen: Visibility) -> Term | None:
    """Return the effect at the size at which it is rehearsed; None where no size that is possible would show."""
    if not seen.visible:
        return None
    settings = _settings(score, effect, effect.forms[:1])
    if not _is_amplitude(effect, seen.parameter):
        strength = [score.switched(term)[1] for term in settings]
        enough = [each for each in strength if each >= TIMES * threshold(score.base)]
        return settings[strength.index(min(enough) if enough else max(strength))]
    parameter, rest = effect.parameters[seen.parameter], effect.neutral[seen.parameter]
    low, high = parameter.bounds
    size = TIMES * (seen.smallest_detectable or 0.0)
    # Towards the typical value, unless only the other side has room.
    up = high - rest >= min(size, rest - low) if parameter.value >= rest else rest - low < min(size, high - rest)
    value = min(rest + size, high) if up else max(rest - size, low)
    middle = settings[len(settings) // 2]
    return replace(middle, values={**middle.values, seen.parameter: value})


def _unseen(effect: Effect, seen: Visibility) -> str:
    if seen.absorbed is None:
        needs = f" It needs the columns {', '.join(effect.needs)}." if effect.needs else ""
        return f"It changes none of these readings, so nothing can be rehearsed.{needs}"
    if not _is_amplitude(effect, seen.parameter):
        return "It shows too little in these readings, however it is set."
    if seen.smallest_detectable is None:
        advice = (
            ' Measure more than white and primaries, or declare it with baseline="first-hour".'
            if effect.baseline == "colour-points"
            else ""
        )
        return f"White and primaries take up {seen.absorbed:.1%} of it: no size of it shows in these readings.{advice}"
    least = _with_unit(seen.smallest_detectable, seen.unit)
    most = max(map(abs, effect.parameters[seen.parameter].bounds))
    return f"It would show from {seen.parameter} = {least} on, and its bounds end at {most:g}."


def _recovery(base: Fit, term: Term, rivals: Sequence[Effect], seen: Visibility) -> tuple[str, bool]:
    """Rehearse: the sentence, and whether the effect was found again."""
    acted = fit(_acted(base, term))
    explanation = explain(acted, [*rivals, term.effect], PureError.of(acted.problem))
    put = f"Put into these readings{_put_as(term, seen)}, "
    alike = _names_for(explanation, term.effect.name)
    if not alike:
        named = " and ".join(step.name for step in explanation.steps)
        return put + (f"it is taken for {named}." if named else "it is not found."), False
    size, right = _size(acted, term, seen)
    others = [step.name for step in explanation.steps if step.name not in alike]
    if others:
        return f"{put}it is found, but with {' and '.join(others)}, which is not there{size}.", False
    rest = [name for name in alike if name != term.effect.name]
    if rest:
        size += f"; these readings cannot tell it from {' or '.join(rest)}"
    again = "it is found again" if right else "it is found, but not in its size"
    return f"{put}{again}{size}.", right and len(alike) <= MOST_ALIKE


def _acted(base: Fit, term: Term) -> Problem:
    """Pose the problem of a display like the fitted one with the effect, read anew."""
    problem, rng = base.problem, np.random.default_rng(SEED)
    light = predict(problem, State((replace(term, free=()),), base.tips, np.zeros_like(base.gains)))
    _, session = np.unique(
        [f"{hour}\0{name}" for hour, name in zip(problem.hour_of, _sessions(problem), strict=True)],
        return_inverse=True,
    )
    gains = problem.noise.session * rng.standard_normal(int(session.max()) + 1)
    light = light * (1.0 + gains[session.reshape(-1)])[:, np.newaxis]
    root = np.linalg.cholesky(problem.covariance(light))
    xyz = problem.readings.xyz_cd_m2.copy()
    xyz[problem.rows] = light + np.einsum("nij,nj->ni", root, rng.standard_normal(light.shape))
    return replace(problem, readings=problem.readings.with_light(xyz))


def _sessions(problem: Problem) -> Array:
    return np.array(problem.readings.session or [""] * problem.readings.hours.size)[problem.rows]


def _put_as(term: Term, seen: Visibility) -> str:
    """Say at which size an effect is put in."""
    if not seen.parameter:
        return ""
    value = term.values[seen.parameter]
    said = f" at {_with_unit(value, seen.unit)}"
    if seen.smallest_detectable is None or not _is_amplitude(term.effect, seen.parameter):
        return said
    times = abs(value - term.effect.neutral[seen.parameter]) / seen.smallest_detectable
    if times > 0.999 * TIMES:
        return f"{said}, three times the smallest detectable size"
    return f"{said}, the largest size allowed and {times:.1f} times the smallest detectable one"


def _size(acted: Fit, term: Term, seen: Visibility) -> tuple[str, bool]:
    """Say in which size an effect comes back in the form it was put in, and whether that is right."""
    if not seen.parameter:
        return "", True
    simple = replace(term.effect, forms=term.effect.forms[:1], refined=1)
    found = family(acted, simple).best
    value, put = found.term.values[seen.parameter], term.values[seen.parameter]
    error = found.fit.stderr[-1].get(seen.parameter)
    if error is None:
        return f": {_with_unit(value, seen.unit)}", bool(value == put)
    if not np.isfinite(error):
        return "; these readings do not say in which size", False
    decimals = max(-int(np.floor(np.log10(error))), 0)
    unit = "" if seen.unit in {"", "1"} else f" {seen.unit}"
    return f": {value:.{decimals}f} ± {error:.{decimals}f}{unit}", bool(abs(value - put) <= WITHIN * error)


def _names_for(explanation: Explanation, name: str) -> tuple[str, ...]:
    """All names under which the search has found an effect; none when it has not."""
    for step in explanation.steps:
        names = (step.name, *(rival.name for rival in step.rivals))
        if name in names:
            return names
    return ()


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3g}" + ("" if unit in {"", "1"} else f" {unit}")
