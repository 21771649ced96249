"""What the fitting process holds: readings, their model, and every fit of them so far."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError, pick_one
from lutgen.names import AGING_MODES, BASELINES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from lutgen.criticism.compare import Comparison
    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.fit import Fit
    from lutgen.criticism.refine import Course, Refinement
    from lutgen.criticism.visibility import Visibility
    from lutgen.display import DisplayModel
    from lutgen.effects import Effect
    from lutgen.readings import Measurements


class Fitting:
    """Readings and their model, asked by the window (:mod:`lutgen.explore.process`)."""

    beside = frozenset[str]()

    def __init__(self, tell: Callable[..., None]) -> None:
        """Take what tells the window news: of :meth:`idle`'s and :meth:`find`'s."""
        self._tell = tell
        self._opened: Opened | None = None
        self._on: tuple[str, ...] = ()
        self._fitted: tuple[str, ...] = ()
        self._settled = self._judged = True
        self._alone: dict[str, float | None] = {}

    def open(
        self,
        *,
        data: str,
        baseline: str | None,
        model: str | None,
        files: Sequence[str],
        expressions: Sequence[str],
        on: Sequence[str] = (),
    ) -> dict[str, Any]:
        """Open readings, or the readings of a saved model, with some effects switched on.

        What was open stays open where these are refused.
        """
        opened = Opened(data, baseline, model, tuple(files), tuple(expressions))
        if not on:
            self._tell("model", pickle.dumps(opened.fresh))
        self._opened, self._on, self._fitted, self._settled = opened, tuple(on), (), False
        self._alone = {}
        return opened.overview()

    def gather(self, paths: Sequence[str], hours: Sequence[float] | None) -> dict[str, Any]:
        """Make one file of readings of files that were dropped together (:func:`lutgen.explore.sessions.gathered`)."""
        from lutgen.explore.sessions import gathered

        return gathered(paths, hours)

    @property
    def _now(self) -> Opened:
        if self._opened is None:
            raise LutgenError("no readings are open. Drop a table of readings (.csv) first.")
        return self._opened

    def idle(self) -> bool:
        """Finish the fit that was asked for, say what it is worth, then try the effects one by one, each alone."""
        if self._opened is None:
            return False
        if not self._settled:
            self._settle()
        elif not self._judged:
            self._judge()
        else:
            return self._try_one_alone()
        return True

    def _settle(self) -> None:
        """Fit what is switched on, as ``lutgen refine --add`` does, and tell the window.

        Where that is refused, what was fitted before is on again.
        """
        from lutgen.explore.error_view import error_json

        self._settled, self._judged = True, False
        try:
            refinement = self._now.fitted(self._on)
        except LutgenError as error:
            self._tell("failed", {"error": str(error), "on": self._fitted})
            self._on = self._fitted
            refinement = self._now.fitted(self._on)
        self._fitted = self._on
        self._tell("model", pickle.dumps(refinement.model if self._on else self._now.fresh))
        self._tell("error", error_json(refinement.after, self._now, refinement))
        self._tell("effects", self.effects())

    def _judge(self) -> None:
        """Predict readings that are withheld from the fit: whether ``lutgen refine`` asks for ``--keep``."""
        self._judged = True
        refinement = self._now.refinement(self._on)
        self._tell("support", {"keep": not refinement.improves, "sentence": refinement.sentence()})

    def _try_one_alone(self) -> bool:
        name = next((each for each in self._now.choices if each not in self._alone), None)
        if name is None:
            return False
        try:
            self._alone[name] = self._now.course.steps((name,))[0].comparison.ratio
        except LutgenError:
            self._alone[name] = None
        self._tell("effects", self.effects())
        return True

    def effects(self) -> list[dict[str, Any]]:
        """List the effects: what each does, whether these readings can see it, how far the error falls with it."""
        from lutgen.explore.error_view import effects_json

        return effects_json(self._now, self._alone, self._on)

    def switch(self, effects: list[str]) -> dict[str, Any]:
        """Put these effects on: return the error after one linear step; the fit follows as news."""
        from lutgen.criticism.first_step import first_step
        from lutgen.explore.error_view import error_json

        now, on = self._now, self._now.in_order(effects)
        now.course.check(on)
        if now.known(on):
            error = error_json(now.fitted(on).after, now, now.fitted(on))
        else:
            wanted = [now.course.effects[name] for name in (*now.given, *on)]
            error = error_json(first_step(now.course.fit(self._fitted), wanted), now, provisional=True)
        self._on, self._settled = on, False
        return {**error, "on": on}

    def what_if(self, effect: str | None = None, parameter: str = "", value: float = 0.0) -> dict[str, Any]:
        """Give a parameter another value than the fit's, the others as they are; without an effect: the fit again."""
        from lutgen.explore.error_view import error_json

        if not self._settled:
            self._settle()
        now = self._now
        if effect is None:
            self._settled = False
            return error_json(now.fitted(self._on).after, now, now.fitted(self._on))
        comparison, model = now.supposed(self._on, effect, parameter, value)
        self._tell("model", pickle.dumps(model))
        return error_json(comparison, now, what_if=True)

    def own(self, files: Sequence[str], expressions: Sequence[str]) -> list[dict[str, Any]]:
        """Take effects of the user's own beside the catalogue's; what was switched on is switched off."""
        now = self._now
        self.open(data=now.data, baseline=now.baseline, model=now.model, files=files, expressions=expressions)
        return self.effects()

    def find(self) -> dict[str, Any]:
        """Diagnose, telling progress; return the verdict."""
        from lutgen.explore.error_view import verdict_json

        diagnosis = self._now.diagnosis(
            lambda done, of: self._tell("progress", {"what": "find", "done": done, "of": of})
        )
        return verdict_json(diagnosis, self._now)

    def patches(self, between: Sequence[str]) -> bytes:
        """Plan the next session: a patch list (.csv), to tell two effects apart or for general coverage."""
        from lutgen.criticism.plan import plan

        now = self._now
        pair = (between[0], between[1]) if len(between) > 1 else None
        return plan(now.readings, between=pair, baseline=now.baseline, effects=now.effects).as_csv().encode()

    def save(self, path: str) -> dict[str, Any]:
        """Write the model of what is switched on, as ``lutgen refine -o`` does."""
        from lutgen.display import save_model

        save_model(self._to_save(), path, force=True)
        return {}

    def model_text(self) -> bytes:
        """Return the bytes of that file as it is beside the readings."""
        from lutgen.display.model_file import model_text

        return model_text(self._to_save(), Path(self._now.readings.file).parent)

    def _to_save(self) -> DisplayModel:
        if not self._settled:
            self._settle()
        return self._now.refinement(self._on).to_save if self._on else self._now.fresh


class Opened:
    """Readings that are open, and the model that effects are added to."""

    def __init__(
        self, data: str, baseline: str | None, model: str | None, files: tuple[str, ...], expressions: tuple[str, ...]
    ) -> None:
        """Read them; errors as the command line's."""
        from lutgen.display import DisplayModel, load_model
        from lutgen.effects.own import everything
        from lutgen.readings import read_measurements

        self.model, self.files, self.expressions = model, files, expressions
        self.effects: Mapping[str, Effect] = everything(files, expressions)
        if files or expressions:
            from lutgen.effects.contract import refuse_unsound

            refuse_unsound(files, expressions)
        self.saved = load_model(model) if model else None
        self.readings: Measurements = self.saved.measurements if self.saved and not data else read_measurements(data)
        self.data = data or self.readings.file
        self.baseline = baseline or (self.saved.baseline if self.saved else "colour-points")
        if self.baseline not in BASELINES:
            raise pick_one("baseline", self.baseline, BASELINES)
        if self.saved and self.baseline != self.saved.baseline:
            raise LutgenError(
                f"--baseline {self.baseline} contradicts --model, whose baseline is {self.saved.baseline}."
            )
        self.fresh: DisplayModel = self.saved or DisplayModel(self.readings, baseline=self.baseline)
        self.expressed = tuple(name for name, each in self.effects.items() if each.origin in expressions)
        self._course: Course | None = None
        self._seen: dict[str, Visibility] = {}
        self._fitted: dict[tuple[str, ...], Refinement] = {}
        self._refined: dict[tuple[str, ...], Refinement] = {}

    @property
    def selection(self) -> str:
        """The paper's choice of matrix."""
        return self.saved.selection if self.saved else "nearest"

    @property
    def course(self) -> Course:
        """The model, and the fits with effects added to it."""
        from lutgen.criticism.refine import Course, terms_of

        if self._course is None:
            terms = terms_of(self.saved) if self.saved else ()
            known = {**self.effects, **{term.effect.name: term.effect for term in terms}}
            self._course = Course.of(
                self.readings, baseline=self.baseline, selection=self.selection, effects=known, terms=terms
            )
        return self._course

    @property
    def given(self) -> list[str]:
        """Names of the effects that the saved model has already."""
        return [term.effect.name for term in self.course.base.terms]

    @property
    def choices(self) -> list[str]:
        """Names of the effects that may be switched on, in the order of the light's way."""
        from lutgen.criticism.diagnose import candidates

        return [each.name for each in candidates(self.effects, self.baseline, ()) if each.name not in self.given]

    def visibility(self) -> dict[str, Visibility]:
        """What these readings can see, by effect."""
        from lutgen.criticism.visibility import visibility

        if not self._seen:
            known = [self.effects[name] for name in self.choices]
            self._seen = {each.effect: each for each in visibility(self.course.base, known)}
        return self._seen

    def in_order(self, names: Sequence[str]) -> tuple[str, ...]:
        """Names as ``lutgen refine`` adds them: effects of one line come last."""
        for name in names:
            if name not in self.course.effects:
                raise pick_one("effect", name, self.course.effects)
        new = [name for name in names if name not in self.given]
        return (
            *(each for each in new if each not in self.expressed),
            *(each for each in new if each in self.expressed),
        )

    def known(self, names: tuple[str, ...]) -> bool:
        """Whether these effects were fitted already."""
        return names in self._fitted

    def fitted(self, names: tuple[str, ...]) -> Refinement:
        """What ``lutgen refine --add`` makes of these effects, but for the readings that it withholds."""
        from lutgen.criticism.refine import Refinement, model_of

        if names not in self._fitted:
            found, steps, before = self.course.fit(names), self.course.steps(names), self.course.before
            model = model_of(found, None, before, steps[-1].comparison if steps else before)
            self._fitted[names] = Refinement(before, steps, found, model).of_saved(self.saved)
        return self._fitted[names]

    def refinement(self, names: tuple[str, ...]) -> Refinement:
        """What ``lutgen refine --add`` makes of these effects."""
        if names not in self._refined:
            self._refined[names] = self.course.refinement(names).of_saved(self.saved)
        return self._refined[names]

    def supposed(
        self, names: tuple[str, ...], effect: str, parameter: str, value: float
    ) -> tuple[Comparison, DisplayModel]:
        """Compare with a parameter set to a value, the other effects as fitted, white and primaries solved again."""
        from lutgen.criticism.compare import compare_problem
        from lutgen.criticism.fit import fit
        from lutgen.criticism.refine import model_of

        found: Fit = self.course.fit(names)
        term = next((each for each in found.terms if each.effect.name == effect), None)
        if term is None or parameter not in term.values:
            raise LutgenError(f"{effect} {parameter}: no such parameter is switched on.")
        low, high = term.effect.parameters[parameter].bounds
        if not low <= value <= high:
            raise LutgenError(f"{effect} {parameter}: {value:g} is outside its bounds, {low:g} to {high:g}.")
        terms = tuple(
            replace(each, free=(), values={**each.values, parameter: value} if each is term else each.values)
            for each in found.terms
        )
        comparison = compare_problem(found.problem, terms)
        return comparison, model_of(fit(found.problem, terms), None, self.course.before, comparison)

    def diagnosis(self, progress: Callable[[int, int], None]) -> Diagnosis:
        """Find what is missing, as ``lutgen diagnose`` does."""
        from lutgen.criticism.diagnose import diagnose

        course = self.course
        return diagnose(
            self.readings, baseline=self.baseline, selection=self.selection, effects=course.effects,
            terms=course.base.terms, progress=progress,
        )  # fmt: skip

    def overview(self) -> dict[str, Any]:
        """Say what was opened."""
        readings, hours = self.readings, sorted(set(map(float, self.readings.hours)))
        return {
            "name": Path(self.data).name,
            "data": self.data,
            "provenance": readings.provenance,
            "simulated": "simulated" in readings.provenance.lower(),
            "readings": int(readings.hours.size),
            "hours": hours,
            "max_hours": float(self.fresh.tips.hours[-1]),
            "modes": list(AGING_MODES),
            "baseline": self.baseline,
            "baselines": BASELINES,
            "can_diagnose": bool(readings.hours.size > 4 * len(hours)),
        }
