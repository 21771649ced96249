"""Adding what is missing: effects join the model one by one, all is refitted, the error falls toward the floor."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.compare import Comparison, compare_problem
from lutgen.criticism.diagnose import Diagnosis, candidates, diagnose, parameters_of
from lutgen.criticism.fit import Fit, fit
from lutgen.criticism.heldout import held_out
from lutgen.criticism.linear import Term
from lutgen.criticism.problem import Problem
from lutgen.criticism.search import family
from lutgen.criticism.shared_errors import with_shared_errors
from lutgen.display.carried import what_luts_carry
from lutgen.display.conditions import Conditions, conditions_of
from lutgen.display.fitted import AppliedEffect, Estimate, LatentTips
from lutgen.display.model import DisplayModel
from lutgen.effects import catalogue
from lutgen.errors import LutgenError, pick_one

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from lutgen.effects import Effect
    from lutgen.readings import Measurements


@dataclass(frozen=True)
class Added:
    """One effect added, and the comparison with it."""

    effect: str
    form: tuple[str, ...]
    comparison: Comparison


@dataclass(frozen=True)
class Refinement:
    """What refining has made.

    Attributes
    ----------
    before
        The comparison without new effects.
    steps
        Each effect added, in turn.
    found
        The final fit.
    model
        The display with the effects: what ``lutgen build --model`` bakes.
    diagnosis
        With ``auto`` the diagnosis that chose the effects.
    held_out_gain
        By how much χ² of readings that were withheld from the fits fell with the effects.

    """

    before: Comparison
    steps: tuple[Added, ...]
    found: Fit
    model: DisplayModel
    diagnosis: Diagnosis | None = None
    held_out_gain: float = 0.0

    @property
    def improves(self) -> bool:
        """Whether the error, and that of withheld readings, fell; True where nothing was added."""
        return not self.steps or (self.after.ratio < self.before.ratio and self.held_out_gain >= 0.0)

    @property
    def after(self) -> Comparison:
        """The comparison with all effects."""
        return self.steps[-1].comparison if self.steps else self.before

    def carried(self) -> list[str]:
        """Say what LUTs of this model will carry, and what they cannot."""
        return what_luts_carry(self.model)

    def sentence(self) -> str:
        """Say in plain words how far the error fell."""
        before, after = self.before, self.after
        if not self.steps:
            return "Nothing was added: the model stays as it was."
        names = ", ".join(step.effect for step in self.steps)
        course = (
            f"from {before.ratio:.2f} to {after.ratio:.2f} times the noise floor (mean ΔE2000 "
            f"{before.error.delta_e_mean:.2f} to {after.error.delta_e_mean:.2f}, floor {after.floor.delta_e_mean:.2f})."
        )
        if self.improves:
            return f"With {names} the error falls {course}"
        if after.ratio < before.ratio:
            return f"With {names} the error falls {course} But readings withheld from the fit are predicted no better."
        return f"With {names} the error does not fall: it goes {course}"

    def as_json(self, model: str | None = None) -> dict[str, Any]:
        """Return what ``--json`` prints; ``model`` is the file that was written."""
        return {
            "schema": 1,
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
            "parameters": parameters_of(self.found),
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
        Add what a diagnosis finds, after ``add``, until nothing is missing.

    Raises
    ------
    LutgenError
        An unknown effect, one that is there already, or more parameters than the readings can bear.

    """
    known = catalogue() if effects is None else effects
    for name in add:
        if name not in known:
            raise pick_one("effect", name, known)
        if name in {term.effect.name for term in terms} or list(add).count(name) > 1:
            raise LutgenError(f"effect {name!r} is in the model already. Leave it out of --add.")
    problem = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
    problem = with_shared_errors(problem, terms)
    base = fit(problem, terms)
    before, steps, current = compare_problem(problem, base.terms), [], base
    for name in add:
        current = _joined(current, known[name])
        steps.append(_added(current, name))
    diagnosis = None
    if auto:
        diagnosis = diagnose(
            readings, baseline=baseline, selection=selection, instrument=instrument, effects=known,
            terms=current.terms, progress=progress,
        )  # fmt: skip
        if diagnosis.verdict.effects:
            steps += [_added(each, step.name) for step, each in _trail(diagnosis)]
            current = diagnosis.explanation.final
    model = model_of(current, diagnosis, before, steps[-1].comparison if steps else before)
    gain = held_out(current).gain_over(held_out(base))[0] if steps else 0.0
    return Refinement(before, tuple(steps), current, model, diagnosis, gain)


def _trail(diagnosis: Diagnosis) -> list[tuple[Any, Fit]]:
    return list(zip(diagnosis.explanation.steps, diagnosis.explanation.trail, strict=True))


def _joined(current: Fit, effect: Effect) -> Fit:
    """Add an effect in its best form, and choose the forms of all effects anew."""
    if not candidates({effect.name: effect}, current.problem.baseline, ()):
        raise LutgenError(
            f"effect {effect.name!r} is hidden by white and primaries that are measured again at each hour: it can "
            f"only be fitted from the hour-0 display. Add --baseline first-hour."
        )
    _check_enough(current, effect)
    found = family(current, effect).best.fit
    for name in [term.effect.name for term in found.terms if term.free][:-1]:
        term = next(each for each in found.terms if each.effect.name == name)
        rest = fit(found.problem, tuple(each for each in found.terms if each is not term))
        again = family(rest, term.effect).best.fit
        found = again if again.bic < found.bic else found
    return found


def _check_enough(current: Fit, effect: Effect) -> None:
    problem, free = current.problem, min((len(form) for form in effect.forms), default=0)
    if current.parameters + free > problem.bears:
        spare = np.unique(problem.groups[~problem.is_anchor]).size
        raise LutgenError(
            f"{problem.readings.file}: beside white and primaries there are {spare} different readings, which bear "
            f"{problem.bears} free parameters; with {effect.name} the model has {current.parameters + free}. Measure "
            f"greys and ramps too: lutgen plan lists them."
        )


def _added(found: Fit, name: str) -> Added:
    term = next(each for each in found.terms if each.effect.name == name)
    return Added(name, (*term.gridded, *term.free), compare_problem(found.problem, found.terms))


def model_of(found: Fit, diagnosis: Diagnosis | None, before: Comparison, after: Comparison) -> DisplayModel:
    """Make the display model that a fit has found, with its provenance."""
    problem = found.problem
    knots = problem.is_knot
    parameters = parameters_of(found)
    applied = tuple(
        AppliedEffect(
            term.effect,
            {
                name: Estimate(each["value"], each["stderr"], each["at_bound"])
                for name, each in parameters[term.effect.name].items()
            },
            (*term.gridded, *term.free),
        )
        for term in found.terms
    )
    noise = problem.noise
    record: dict[str, str | float] = {
        "readings": int(problem.rows.size),
        "noise_relative": noise.relative,
        "noise_floor_cd_m2": noise.floor_cd_m2,
        "rms_sigma_before": before.error.rms_sigma,
        "rms_sigma_after": after.error.rms_sigma,
        "rms_sigma_floor": after.floor.rms_sigma,
    }
    if diagnosis:
        record["sentence"] = diagnosis.verdict.sentence
    return DisplayModel(
        problem.readings,
        selection=problem.selection,
        conditions=_at_rest(problem, [term.effect for term in found.terms]),
        effects=applied,
        latent=LatentTips(problem.hours[knots], np.array(found.tips[knots])),
        baseline=problem.baseline,
        held=problem.held,
        native=problem.native,
        verdict=diagnosis.verdict.name if diagnosis else "",
        fit=record,
    )


def _at_rest(problem: Problem, effects: Sequence[Effect]) -> Conditions:
    """The campaign's own rest, in the columns that the effects need: what is baked unless ``--at`` says otherwise."""
    needed = {name for effect in effects for name in effect.needs}
    return conditions_of({name: value for name, value in problem.readings.usual().items() if name in needed})


def terms_of(model: DisplayModel) -> tuple[Term, ...]:
    """Return the effects of a saved model as a fit takes them, free as they were."""
    found = []
    for applied in model.effects:
        grids = tuple(name for name in applied.free if applied.effect.parameters[name].grid)
        free = tuple(name for name in applied.free if name not in grids)
        found.append(replace(Term(applied.effect, dict(applied.values)), free=free, gridded=grids))
    return tuple(found)
