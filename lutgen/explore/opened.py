"""The open readings, their model, and all fits so far."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import AGING_MODES, BASELINES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.criticism.compare.comparison import Comparison
    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.refine import Course, Refinement
    from lutgen.criticism.verdict.visibility import Visibility
    from lutgen.display import DisplayModel
    from lutgen.effects import Effect
    from lutgen.progress import Progress
    from lutgen.readings import Measurements

#: Points along an edge of the tables that the page applies.
POINTS = 33


class Opened:
    """The open readings, and the model to which effects are added."""

    def __init__(
        self,
        data: str,
        baseline: str | None,
        model: str | None,
        files: Sequence[str] = (),
        expressions: Sequence[str] = (),
    ) -> None:
        """Read the readings and the model; errors as on the command line."""
        from lutgen.display import DisplayModel, load_model
        from lutgen.readings import read_measurements

        self.expressions = expressions
        if files or expressions:
            self.effects = _sound(files, expressions)
        self.saved = load_model(model) if model else None
        self.readings: Measurements = self.saved.measurements if self.saved and not data else read_measurements(data)
        self.data = data or self.readings.file
        self.baseline = baseline or (self.saved.baseline if self.saved else "colour-points")
        refuse_unknown("baseline", self.baseline, BASELINES)
        if self.saved and self.baseline != self.saved.baseline:
            raise LutgenError(
                f"--baseline {self.baseline} contradicts --model, whose baseline is {self.saved.baseline}."
            )
        self.fresh: DisplayModel = self.saved or DisplayModel(self.readings, baseline=self.baseline)
        self._seen: dict[str, Visibility] = {}
        #: Names of added effects → their fit, for each set that was fitted.
        self.fits: dict[tuple[str, ...], Refinement] = {}
        self._refined: dict[tuple[str, ...], Refinement] = {}

    def take_own(self, files: Sequence[str], expressions: Sequence[str]) -> set[str]:
        """Replace the user's own effects; return the names of unchanged effects, which keep their fits.

        Raises LutgenError: an effect is refused, or breaks the contract. Then the previous effects stay.
        """
        from lutgen.criticism.diagnose import known_under

        effects = _sound(files, expressions)
        course, given = self.course, {name: self.course.effects[name] for name in self.given}
        self.course = course.with_effects({**known_under(effects, self.baseline), **given})
        self.expressions, self.effects, self._seen = expressions, effects, {}
        stay = self.course.shared_with(course)
        self.fits = {names: each for names, each in self.fits.items() if stay.issuperset(names)}
        self._refined = {names: each for names, each in self._refined.items() if stay.issuperset(names)}
        return stay

    @cached_property
    def effects(self) -> Mapping[str, Effect]:
        """All effects by name. Those without the user's own are loaded late, since no picture needs them."""
        from lutgen.effects.own import everything

        return everything()

    @property
    def selection(self) -> str:
        """The rule that selects the paper's matrix of a colour."""
        return self.saved.selection if self.saved else "nearest"

    @cached_property
    def course(self) -> Course:
        """The model, and its fits with added effects."""
        from lutgen.criticism.display_model import terms_of
        from lutgen.criticism.refine import Course

        terms = terms_of(self.saved) if self.saved else ()
        known = {**self.effects, **{term.effect.name: term.effect for term in terms}}
        return Course.of(self.readings, baseline=self.baseline, selection=self.selection, effects=known, terms=terms)

    @property
    def given(self) -> list[str]:
        """Names of the effects in the saved model."""
        return [term.effect.name for term in self.course.base.terms]

    @property
    def choices(self) -> list[str]:
        """Names of the effects that may be switched on, in the order of the signal path."""
        from lutgen.criticism.diagnose import candidates

        return [each.name for each in candidates(self.effects, self.baseline, ()) if each.name not in self.given]

    def visibility(self) -> dict[str, Visibility]:
        """Effect → its visibility in these readings."""
        from lutgen.criticism.verdict.visibility import visibility

        if not self._seen:
            known = [self.course.effects[name] for name in self.choices]
            self._seen = {each.effect: each for each in visibility(self.course.base, known)}
        return self._seen

    def in_order(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return names in the order in which ``lutgen refine`` adds them: one-line effects come last."""
        for name in names:
            refuse_unknown("effect", name, self.course.effects)
        new = [name for name in names if name not in self.given]
        expressed = {name for name, each in self.effects.items() if each.origin in self.expressions}
        return tuple(sorted(new, key=expressed.__contains__))

    def fitted(self, names: tuple[str, ...]) -> Refinement:
        """Return the fit of these effects as ``lutgen refine --add``, without the test on withheld readings."""
        from lutgen.criticism.display_model import model_of
        from lutgen.criticism.refine import Refinement

        if names not in self.fits:
            course = self.course.sound(names)
            fit, steps, before = course.fit(names), course.steps(names), course.before
            model = model_of(fit, None, before, steps[-1].comparison if steps else before)
            self.fits[names] = Refinement(before, steps, fit, model).of_saved(self.saved)
        return self.fits[names]

    def refinement(self, names: tuple[str, ...]) -> Refinement:
        """Return the result of ``lutgen refine --add`` for these effects."""
        if names not in self._refined:
            self._refined[names] = self.course.sound(names).refinement(names).of_saved(self.saved)
        return self._refined[names]

    def supposed(
        self, names: tuple[str, ...], effect: str, parameter: str, value: float
    ) -> tuple[Comparison, DisplayModel]:
        """Compare with one parameter set to a value, others as fitted, and white and primaries solved again."""
        from lutgen.criticism.compare.comparison import compare_problem
        from lutgen.criticism.display_model import model_of
        from lutgen.criticism.fit.least_squares import fit

        course = self.course.sound(names)
        fitted: Fit = course.fit(names)
        term = next((each for each in fitted.terms if each.effect.name == effect), None)
        if term is None or parameter not in term.values:
            raise LutgenError(f"{effect} {parameter}: no such parameter is switched on.")
        low, high = term.effect.parameters[parameter].bounds
        if not low <= value <= high:
            raise LutgenError(f"{effect} {parameter}: {value:g} is outside its bounds, {low:g} to {high:g}.")
        terms = tuple(
            replace(each, free=(), values={**each.values, parameter: value} if each is term else each.values)
            for each in fitted.terms
        )
        comparison = compare_problem(fitted.problem, terms)
        return comparison, model_of(fit(fitted.problem, terms), None, course.before, comparison)

    def diagnosis(self, progress: Progress) -> Diagnosis:
        """Return the diagnosis, as ``lutgen diagnose``."""
        from lutgen.criticism.diagnose import diagnose

        course = self.course
        return diagnose(
            self.readings, baseline=self.baseline, selection=self.selection, effects=course.effects,
            terms=course.base.terms, progress=progress,
        )  # fmt: skip

    def overview(self) -> dict[str, Any]:
        """Describe the open readings."""
        readings, hours = self.readings, sorted(set(map(float, self.readings.hours)))
        return {
            "name": Path(self.data).name,
            "data": self.data,
            "provenance": readings.provenance,
            "simulated": "simulated" in readings.provenance.lower(),
            "readings": int(readings.hours.size),
            "hours": hours,
            "max_hours": (last := float(self.fresh.tips.hours[-1])),
            "first": {"mode": AGING_MODES[-1], "hours": last, "size": POINTS},
            "modes": list(AGING_MODES),
            "baseline": self.baseline,
            "baselines": BASELINES,
            "can_diagnose": bool(readings.hours.size > 4 * len(hours)),
        }


def _sound(files: Sequence[str], expressions: Sequence[str]) -> Mapping[str, Effect]:
    """Return all effects by name. Raises LutgenError if a user's own effect is refused or breaks the contract."""
    from lutgen.effects.contract import refuse_unsound
    from lutgen.effects.own import everything

    effects = everything(files, expressions)
    refuse_unsound(files, expressions)
    return effects
