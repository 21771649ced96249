"""Visibility: for every effect, the share that the tips absorb, and the smallest size that these readings can show."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.least_squares import fit, switching_penalty
from lutgen.criticism.fit.linear import Term, grid_values
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.search.candidates import STRONG
from lutgen.criticism.search.explanation import UNCHANGED
from lutgen.criticism.search.forms import all_forms
from lutgen.criticism.search.stepwise import UNDOUBTED
from lutgen.effects.declare import PROPOSED

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.score import Score
    from lutgen.effects import Effect

#: Distance above the threshold, in standard deviations, at which nine of ten campaigns find an effect. A fixed
#: threshold would need 1.28. The threshold varies from campaign to campaign (estimated noise, withheld readings), so
#: 1.6 is used. ``python -m tests.detection_rate`` tests the number.
NINE_OF_TEN = 1.6

#: Number of forms that a search tries on readings with one faint effect, or none.
TRIED = 30


@dataclass(frozen=True)
class Visibility:
    """Whether these readings could show an effect.

    Attributes
    ----------
    effect, parameter, unit
        Name of the effect, name of its amplitude, and unit of the amplitude.
    visible
        Whether the smallest detectable size is physically possible.
    smallest_detectable
        Size that nine of ten campaigns like this one would show; None if no size shows.
    absorbed
        Share of its signature (in χ²) that tips and gains absorb; None if it has no signature.

    """

    effect: str
    parameter: str
    unit: str
    visible: bool
    smallest_detectable: float | None
    absorbed: float | None


def threshold(base: Fit, parameters: int = 1) -> float:
    """Return the strength (whitened norm) of an effect that nine of ten campaigns find.

    The effect must pass the rule of admission: BIC under the allowed noise, and the corrected F test. Held-out readings
    seldom refuse an effect of this strength. ``parameters``: number of parameters of the shortest form that can follow
    the effect. Each parameter costs ln n in BIC, and gains 1 by chance.
    """
    error = PureError.of(base.problem)
    gain_for_bic = error.allowance * max(error.variance, 1.0) * (STRONG + parameters * np.log(base.readings))
    gain_for_f_test = error.gain_beyond(UNDOUBTED / TRIED)
    by_chance = parameters - 1
    needed = max(gain_for_bic - by_chance, gain_for_f_test)
    return float(np.sqrt(needed)) + NINE_OF_TEN


def visibility(base: Fit, effects: Iterable[Effect]) -> list[Visibility]:
    """Return the visibility of every effect in the readings of ``base``."""
    needed = cache(partial(threshold, base))
    return [_of(base.score, effect, needed) for effect in effects]


def with_steady_zero(base: Fit, effect: Effect) -> Visibility:
    """Return the visibility of an effect if the zero of the meter were the same in all sessions."""
    steady = fit(replace(base.problem, offset_cd_m2=0.0), base.terms)
    return visibility(steady, [effect])[0]


def _of(score: Score, effect: Effect, needed: Callable[[int], float]) -> Visibility:
    simple = [*all_forms(effect)[0], *(form[0] for form in effect.forms if len(form) == 1)]
    names = [name for name in dict.fromkeys(simple) if name in effect.neutral and not effect.parameters[name].grid]
    if not names:
        return _without_amplitude(score, effect, needed)
    visibilities = []
    for name in names:
        raw, left = (float(np.linalg.norm(each)) for each in score.seen(_at_rest(score, effect), name))
        low, high = effect.parameters[name].bounds
        if raw == 0.0 and (typical := abs(effect.parameters[name].value)):
            # An effect with a threshold has no gradient at rest: its typical size is used.
            raw, left = (each / typical for each in score.switched(_at_typical(score, effect)))
        limit = max(abs(low), abs(high))
        strength = needed(min(len(form) for form in effect.forms if name in form))
        # An effect whose condition never changes alters no reading, however large the effect is.
        size = strength / left if raw * limit >= UNCHANGED and left > 1e-9 * raw else np.inf
        absorbed = 1.0 - (left / raw) ** 2 if raw > 0 else None
        visibilities.append(
            Visibility(
                effect.name,
                name,
                effect.parameters[name].unit,
                bool(size <= limit),
                float(size) if np.isfinite(size) else None,
                absorbed,
            )
        )
    return min(visibilities, key=lambda each: np.inf if each.smallest_detectable is None else each.smallest_detectable)


def _at_rest(score: Score, effect: Effect) -> Term:
    """Return an effect at rest, with each grid parameter in the middle of its grid."""
    middle = {}
    for name, parameter in effect.parameters.items():
        if parameter.grid and parameter.grid != PROPOSED:
            values = grid_values(parameter, score.problem.hours)
            middle[name] = values[len(values) // 2] if values else parameter.value
    return Term.at_rest(effect, effect.forms[0], **middle)


def _at_typical(score: Score, effect: Effect) -> Term:
    values = {name: effect.parameters[name].value for name in effect.forms[0] if not effect.parameters[name].grid}
    return Term(effect, {**_at_rest(score, effect).values, **values})


def _without_amplitude(score: Score, effect: Effect, needed: Callable[[int], float]) -> Visibility:
    """Return the visibility of an effect without amplitude; with a grid, the mildest setting that the readings show."""
    form = all_forms(effect)[0]
    grids = [name for name in form if effect.parameters[name].grid not in {(), PROPOSED}]
    if not grids:
        raw, left = score.switched(Term.at_rest(effect, ()))
        absorbed = 1.0 - (left / raw) ** 2 if raw > 0 else None
        is_visible = left >= float(np.sqrt(STRONG + switching_penalty(score.problem)))
        return Visibility(effect.name, "", "", is_visible, None, absorbed)
    name, strength = grids[0], needed(1)
    visible, absorbed = [], None
    for value in grid_values(effect.parameters[name], score.problem.hours):
        raw, left = score.switched(Term.at_rest(effect, form, **{name: value}))
        absorbed = 1.0 - (left / raw) ** 2 if raw > 0 else absorbed
        if left >= strength:
            visible.append(value)
    mildest = max(visible) if visible else None
    return Visibility(effect.name, name, effect.parameters[name].unit, bool(visible), mildest, absorbed)


def away_from_rest(effect: Effect, amplitude: str, size: float) -> float:
    """Return the value of an amplitude at the distance ``size`` from its neutral value, or as far as its bounds allow.

    The value lies on the side of the typical value, unless only the other side of the bounds is wide enough.
    """
    parameter, rest = effect.parameters[amplitude], effect.neutral[amplitude]
    low, high = parameter.bounds
    up = high - rest >= min(size, rest - low) if parameter.value >= rest else rest - low < min(size, high - rest)
    return min(rest + size, high) if up else max(rest - size, low)


def typical_size(effect: Effect, parameter: str) -> float:
    """Return the distance of a parameter's typical value from its neutral value, in the parameter's unit."""
    return abs(effect.parameters[parameter].value - effect.neutral.get(parameter, 0.0))


def relative_size(visibility: Visibility, effects: Mapping[str, Effect]) -> float | None:
    """Return the ratio of the smallest detectable size to the typical size; None if one of them is undefined."""
    effect = effects[visibility.effect]
    if (
        visibility.smallest_detectable is None
        or visibility.parameter not in effect.neutral
        or effect.parameters[visibility.parameter].grid
    ):
        return None
    typical = typical_size(effect, visibility.parameter)
    return visibility.smallest_detectable / typical if typical else None
