"""Refine the model: add missing effects one by one and refit everything, so that the error falls toward the floor."""

from __future__ import annotations

from copy import copy
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.compare.comparison import SCHEMA, Comparison, compare_problem, lines_left_out
from lutgen.criticism.diagnose import Diagnosis, candidates, diagnose, known_under, parameters_of
from lutgen.criticism.display_model import model_of
from lutgen.criticism.fit.lack_of_fit import is_noise
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.search.candidates import family
from lutgen.criticism.search.influence import estimated_again, sound_fit, wrong_rows
from lutgen.display.carried import what_luts_carry
from lutgen.effects import catalogue
from lutgen.errors import LutgenError, pick_one
from lutgen.names import NATIVE_BASELINES
from lutgen.numerals import times

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from lutgen.criticism.fit.linear import Term
    from lutgen.display.model import DisplayModel
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

#: Notes in the file of a model that was kept although its effects do not lower the error, or although it has none.
BY_HAND = "by hand: the error does not fall with these effects"
AS_IT_WAS = "by hand: no effect was added"


@dataclass(frozen=True)
class Added:
    """One effect added, and the comparison with it."""

    effect: str
    form: tuple[str, ...]
    comparison: Comparison


@dataclass(frozen=True)
class Refinement:
    """The result of adding effects to a model.

    Attributes
    ----------
    before
        The comparison without new effects.
    steps
        The added effects in their order.
    final
        The final fit.
    model
        The display with the effects, as ``lutgen build --model`` bakes it.
    diagnosis
        With ``auto``, the diagnosis that chose the effects.
    held_out_gain
        Decrease of χ² of withheld readings by the effects.

    """

    before: Comparison
    steps: tuple[Added, ...]
    final: Fit
    model: DisplayModel
    diagnosis: Diagnosis | None = None
    held_out_gain: float = 0.0

    @property
    def falls(self) -> bool:
        """Whether the error fell in the figures that are printed."""
        return self.after.ratio < self.before.ratio and times(self.after.ratio) != times(self.before.ratio)

    @property
    def improves(self) -> bool:
        """Whether the error fell, and the error of withheld readings did not rise; False if nothing was added."""
        return bool(self.steps) and self.falls and self.held_out_gain >= 0.0

    @property
    def after(self) -> Comparison:
        """The comparison with all effects."""
        return self.steps[-1].comparison if self.steps else self.before

    @property
    def to_save(self) -> DisplayModel:
        """The model for a file; it holds a note if the user keeps the model although the error does not fall."""
        kept = BY_HAND if self.steps else AS_IT_WAS
        return self.model if self.improves else replace(self.model, fit={**self.model.fit, "kept": kept})

    def no_gain(self) -> str:
        """Say why the model does not improve."""
        if not self.steps:
            return "Nothing was added"
        return "Withheld readings are predicted no better" if self.falls else "The error does not fall"

    def of_saved(self, saved: DisplayModel | None) -> Refinement:
        """Copy modes and conditions, which a fit does not change, from the saved model that was refined."""
        if saved is None:
            return self
        model = replace(self.model, reference=saved.reference, luminance=saved.luminance, conditions=saved.conditions)
        return replace(self, model=model)

    def carried(self) -> list[str]:
        """Say what LUTs of this model will carry, and what they cannot carry."""
        return what_luts_carry(self.model)

    def sentence(self) -> str:
        """Say in plain words how much the error fell."""
        before, after = self.before, self.after
        if not self.steps:
            return "Nothing was added: the model stays as it was."
        names = ", ".join(step.effect for step in self.steps)
        course = (
            f"from {times(before.ratio)} to {times(after.ratio)} the noise (mean ΔE2000 from "
            f"{before.error.delta_e_mean:.2f} to {after.error.delta_e_mean:.2f}; noise alone: "
            f"{after.floor.delta_e_mean:.2f})."
        )
        if self.improves:
            colour = " Mean ΔE2000 does not fall." if after.error.delta_e_mean > before.error.delta_e_mean else ""
            return f"With {names} the error falls {course}{colour}"
        if self.falls:
            return f"With {names} the error falls {course} But readings withheld from the fit are predicted no better."
        return f"With {names} the error does not fall: it goes {course}"

    def as_json(self, model: str | None = None) -> dict[str, Any]:
        """Return what ``--json`` prints; ``model`` is the path of the written file."""
        return {
            "schema": SCHEMA,
            "sentence": self.sentence(),
            "improves": self.improves,
            "held_out_gain": self.held_out_gain,
            "before": asdict(self.before.error),
            "steps": [
                {"added": step.effect, "form": list(step.form), "error": asdict(step.comparison.error)}
                for step in self.steps
            ],
            "after": asdict(self.after.error),
            "floor": asdict(self.after.floor),
            "parameters": parameters_of(self.final),
            "left_out": lines_left_out(self.after.problem),
            "verdict": self.diagnosis.verdict.name if self.diagnosis else None,
            "carried": self.carried(),
            "model": model,
        }


def refine(
    readings: Measurements,
    add: Sequence[str] = (),
    *,
    auto: bool = False,
    baseline: str = "colour-points",
    selection: str = "nearest",
    instrument: str | None = None,
    effects: Mapping[str, Effect] | None = None,
    terms: Sequence[Term] = (),
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Refinement:
    """Add effects to the model and refit everything together.

    Parameters
    ----------
    readings, baseline, selection, instrument, effects, terms, progress
        As in :func:`lutgen.criticism.diagnose.diagnose`.
    add
        Names of effects to add, in this order.
    auto
        After ``add``, add every effect that a diagnosis names.

    Raises
    ------
    LutgenError
        An unknown effect, an effect that the model has already, or more parameters than the readings can determine.

    """
    known = catalogue() if effects is None else effects
    course = Course.of(
        readings, baseline=baseline, selection=selection, instrument=instrument, effects=known, terms=terms
    )
    course = course.sound(add)
    if not auto:
        return course.refinement(add)
    current = course.fit(add)
    diagnosis = diagnose(
        readings, baseline=baseline, selection=selection, instrument=instrument, effects=known, terms=current.terms,
        progress=progress,
    )  # fmt: skip
    # The errors before and after must be those of the same readings, under the same noise.
    course = Course(fit(diagnosis.problem, terms), course.effects)
    if not diagnosis.verdict.effects:
        return course.refinement_of(course.fit(add), course.steps(add), diagnosis)
    explanation = diagnosis.explanation
    found = [_added(each, step.name) for step, each in zip(explanation.steps, explanation.trail, strict=True)]
    return course.refinement_of(explanation.final, [*course.steps(add), *found], diagnosis)


@dataclass(frozen=True)
class Course:
    """A model to which effects are added one after another; every fit is cached.

    Attributes
    ----------
    base
        The fit without new effects.
    effects
        All effects that may be added, by name.

    """

    base: Fit
    effects: Mapping[str, Effect]
    _fits: dict[tuple[str, ...], Fit] = field(default_factory=dict)
    _steps: dict[tuple[str, ...], Added] = field(default_factory=dict)
    _sound: dict[tuple[str, ...], Course] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        readings: Measurements,
        *,
        baseline: str = "colour-points",
        selection: str = "nearest",
        instrument: str | None = None,
        effects: Mapping[str, Effect] | None = None,
        terms: Sequence[Term] = (),
    ) -> Course:
        """Return the model before any effect is added; parameters and errors as for :func:`refine`."""
        problem = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
        return cls(sound_fit(problem, terms)[0], known_under(effects, baseline))

    def with_effects(self, effects: Mapping[str, Effect]) -> Course:
        """Return the same model with other effects that may be added; fits of effects in both sets stay cached."""
        other = copy(self)
        other.__dict__["effects"] = effects
        shared = other.shared_with(self)
        for cache in ("_fits", "_steps", "_sound"):
            cached = getattr(self, cache).items()
            other.__dict__[cache] = {names: each for names, each in cached if shared.issuperset(names)}
        return other

    def shared_with(self, other: Course) -> set[str]:
        """Return the names of the effects that have the same name and origin in another course."""
        mine = {name: each.origin for name, each in self.effects.items()}
        return {name for name, each in other.effects.items() if mine.get(name) == each.origin}

    @cached_property
    def before(self) -> Comparison:
        """The comparison without new effects."""
        return compare_problem(self.base.problem, self.base.terms)

    def check(self, add: Sequence[str]) -> None:
        """Raise LutgenError for an effect that is unknown, in the model already, or invisible under the baseline."""
        for name in add:
            if name not in self.effects:
                raise pick_one("effect", name, self.effects)
            if name in {term.effect.name for term in self.base.terms} or list(add).count(name) > 1:
                raise LutgenError(f"effect {name!r} is in the model already. Leave it out of --add.")
            _check_visible(self.effects[name], self.base.problem.baseline)

    def fit(self, add: Sequence[str]) -> Fit:
        """Return the fit with these effects, each in the form that the readings support; errors as :func:`refine`."""
        self.check(add)
        return self._fit(tuple(add))

    def _fit(self, add: tuple[str, ...]) -> Fit:
        if not add:
            return self.base
        if add not in self._fits:
            self._fits[add] = _with_effect(self._fit(add[:-1]), self.effects[add[-1]])
        return self._fits[add]

    def sound(self, add: Sequence[str]) -> Course:
        """Return the same model without wrong readings that a misfit hides while these effects are missing.

        Where only noise is left, errors of sessions are estimated again, as in a diagnosis. Elsewhere they would take
        up a part of the misfit.
        """
        names = tuple(add)
        if names not in self._sound:
            self._sound[names] = self._without_hidden(self.fit(add)) if add else self
        return self._sound[names]

    def _without_hidden(self, final: Fit) -> Course:
        hidden = wrong_rows(final)
        rest = fit(final.problem.without(hidden), final.terms) if hidden else final
        problem = estimated_again(final, hidden) if is_noise(rest, PureError.of(rest.problem)) else rest.problem
        return self if problem is self.base.problem else Course(fit(problem, self.base.terms), self.effects)

    def steps(self, add: Sequence[str]) -> tuple[Added, ...]:
        """Return each added effect with the comparison after it was added."""
        return tuple(self._step(tuple(add[: place + 1])) for place in range(len(add)))

    def _step(self, add: tuple[str, ...]) -> Added:
        if add not in self._steps:
            self._steps[add] = _added(self.fit(add), add[-1])
        return self._steps[add]

    def refinement(self, add: Sequence[str]) -> Refinement:
        """Return the refinement with these effects, as :func:`refine`."""
        return self.refinement_of(self.fit(add), self.steps(add))

    def refinement_of(self, current: Fit, steps: Sequence[Added], diagnosis: Diagnosis | None = None) -> Refinement:
        """Return the refinement of a final fit and its steps."""
        model = model_of(current, diagnosis, self.before, steps[-1].comparison if steps else self.before)
        gain = current.held_out_gain(self.base) if steps else 0.0
        return Refinement(self.before, tuple(steps), current, model, diagnosis, gain)


def _with_effect(current: Fit, effect: Effect) -> Fit:
    """Add an effect in its best form, then choose the forms of all other effects again."""
    _check_enough(current, effect)
    joint = family(current, effect, freely=True).best.fit
    for name in [term.effect.name for term in current.terms if term.free]:
        term = next(each for each in joint.terms if each.effect.name == name)
        rest = fit(joint.problem, tuple(each for each in joint.terms if each is not term))
        again = family(rest, term.effect, freely=True).best.fit
        joint = again if again.bic < joint.bic else joint
    return joint


def _check_visible(effect: Effect, baseline: str) -> None:
    if not candidates({effect.name: effect}, baseline, ()):
        foretelling = "native-first-hour" if baseline in NATIVE_BASELINES else "first-hour"
        raise LutgenError(
            f"effect {effect.name!r} is hidden by white and primaries that are measured again at each hour: only a fit "
            f"from the hour-0 display shows it. Add --baseline {foretelling}."
        )


def _check_enough(current: Fit, effect: Effect) -> None:
    problem, free = current.problem, min((len(form) for form in effect.forms), default=0)
    if current.parameters + free > problem.max_parameters:
        spare = np.unique(problem.groups[~problem.is_anchor]).size
        raise LutgenError(
            f"{problem.readings.file}: apart from white and primaries there are {spare} different readings, which "
            f"determine at most {problem.max_parameters} free parameters; with {effect.name} the model has "
            f"{current.parameters + free}. Measure greys and ramps too: lutgen plan lists them."
        )


def _added(current: Fit, name: str) -> Added:
    term = next(each for each in current.terms if each.effect.name == name)
    return Added(name, (*term.gridded, *term.free), compare_problem(current.problem, current.terms))
