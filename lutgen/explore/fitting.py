"""The object in the fitting process: the open readings, and the effects that are switched on."""

import pickle
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lutgen.criticism.compare.comparison import Comparison, compare_problem
from lutgen.criticism.fit.least_squares import Fit
from lutgen.criticism.fit.linear import State
from lutgen.criticism.plan import plan
from lutgen.criticism.search.candidates import best_start
from lutgen.display import DisplayModel, save_model
from lutgen.display.model_file import model_text
from lutgen.effects import Effect
from lutgen.errors import LutgenError
from lutgen.explore.error_view import effects_json, error_json, verdict_json
from lutgen.explore.exchange import gathered
from lutgen.explore.opened import Opened
from lutgen.explore.process import Hosted

#: Number of campaigns of pure noise whose mean is the noise floor. A preview needs no more accurate floor.
FEW = 4


class Fitting(Hosted):
    """Readings and their model. The window calls its methods."""

    def __init__(self, tell: Callable[..., None]) -> None:
        """Begin without readings."""
        super().__init__(tell)
        self._opened: Opened | None = None
        self._on: tuple[str, ...] = ()
        self._fitted: tuple[str, ...] = ()
        self._settled = self._judged = True
        self._alone: dict[str, float | None] = {}
        self._switch = 0

    def open(self, *, on: Sequence[str] = (), switch: int = 0, **readings: Any) -> dict[str, Any]:
        """Open ``readings``, as :class:`Opened` takes them, with some effects switched on.

        If they are refused, the previous readings stay open. ``switch``: as in :meth:`switch`.
        """
        opened = Opened(**readings)
        _ = opened.effects  # raises LutgenError for a refused effect, of the user or of an installed package
        self._tell("without", pickle.dumps(opened.fresh))
        self._opened, self._on, self._fitted, self._settled = opened, tuple(on), (), False
        self._alone, self._switch = {}, switch
        return opened.overview()

    #: Files dropped together → one file of readings.
    gather = staticmethod(gathered)

    @property
    def _now(self) -> Opened:
        if self._opened is None:
            raise LutgenError("no readings are open. Drop a table of readings (.csv) first.")
        return self._opened

    def idle(self) -> bool:
        """Finish the requested fit, test it on withheld readings, then fit each effect alone, one for each call."""
        if self._opened is None:
            return False
        if not self._settled:
            self._settle()
        elif not self._judged:
            # Readings withheld from the fit tell whether ``lutgen refine`` requires ``--keep``.
            self._judged = True
            refinement = self._now.refinement(self._on)
            self._tell("support", {"keep": not refinement.improves, "sentence": refinement.sentence()})
        else:
            return self._try_one_alone()
        return True

    def _settle(self) -> None:
        """Fit the effects that are switched on, as ``lutgen refine --add`` does, and send the result to the window."""
        # If the fit is refused, the effects fitted before are switched on again.
        self._settled, self._judged = True, False
        try:
            refinement = self._now.fitted(self._on)
        except LutgenError as error:
            self._tell("failed", {"error": str(error), "on": self._fitted})
            self._on = self._fitted
            refinement = self._now.fitted(self._on)
        self._fitted = self._on
        self._tell("model", pickle.dumps(refinement.model if self._on else self._now.fresh))
        self._tell("error", error_json(refinement.after, self._now, refinement) | {"switch": self._switch})
        self._tell("effects", self.effects())

    def _try_one_alone(self) -> bool:
        # Effects that these readings cannot detect come last.
        seen = self._now.visibility()
        choices = sorted(self._now.choices, key=lambda name: not (name in seen and seen[name].visible))
        name = next((each for each in choices if each not in self._alone), None)
        if name is None:
            return False
        try:
            self._alone[name] = self._now.course.steps((name,))[0].comparison.ratio
        except LutgenError:
            self._alone[name] = None
        self._tell("effects", self.effects())
        return True

    def effects(self) -> list[dict[str, Any]]:
        """Return the effects: what each does, whether these readings can detect it, and the error with it alone."""
        return effects_json(self._now, self._alone, self._on)

    def switch(self, effects: list[str], switch: int = 0) -> dict[str, Any]:
        """Switch these effects on. Return the error after one linear step; the fit follows as an event.

        Both have the number ``switch``, since the fit may reach the page before the response does.
        """
        now, on = self._now, self._now.in_order(effects)
        now.course.check(on)
        if on in now.fits:
            error = error_json(now.fitted(on).after, now, now.fitted(on))
        else:
            chosen = [now.course.effects[name] for name in (*now.given, *on)]
            error = error_json(first_step(now.course.fit(self._fitted), chosen), now, provisional=True)
        self._on, self._settled, self._switch = on, False, switch
        return {**error, "on": on, "switch": switch}

    def what_if(self, effect: str | None = None, parameter: str = "", value: float = 0.0) -> dict[str, Any]:
        """Set a parameter to a value, with the other parameters as fitted; without an effect: return to the fit."""
        if not self._settled:
            self._settle()
        now = self._now
        if effect is None:
            self._settled = False
            return error_json(now.fitted(self._on).after, now, now.fitted(self._on)) | {"switch": self._switch}
        comparison, model = now.supposed(self._on, effect, parameter, value)
        self._tell("model", pickle.dumps(model))
        return error_json(comparison, now, what_if=True) | {"switch": self._switch}

    def own(self, files: Sequence[str], expressions: Sequence[str]) -> list[dict[str, Any]]:
        """Add the user's own effects to the catalogue. Effects that are switched on stay on."""
        stay = self._now.take_own(files, expressions)
        self._settled = self._settled and stay.issuperset(self._on)
        self._on = tuple(name for name in self._on if name in self._now.effects)
        self._fitted = self._fitted if stay.issuperset(self._fitted) else ()
        self._alone = {name: each for name, each in self._alone.items() if name in stay}
        return self.effects()

    def find(self) -> dict[str, Any]:
        """Diagnose, and send progress as events; return the verdict."""
        diagnosis = self._now.diagnosis(
            lambda done, of: self._tell("progress", {"what": "find", "done": done, "of": of})
        )
        return verdict_json(diagnosis, self._now)

    def patches(self, between: Sequence[str]) -> bytes:
        """Return the patch list (.csv) of the next session: to distinguish two effects, or for general coverage.

        Effects that the present readings already tell apart need no patches; then the list is for general coverage.
        """
        now = self._now
        known = partial(plan, now.readings, baseline=now.baseline, selection=now.selection, effects=now.effects)
        told = known(between=(between[0], between[1])) if len(between) > 1 else None
        return (told if told and told.patches else known()).as_csv().encode()

    def save(self, path: str) -> dict[str, Any]:
        """Write the model with the effects that are switched on, as ``lutgen refine -o`` does."""
        save_model(self._to_save(), path, force=True)
        return {}

    def model_text(self) -> bytes:
        """Return the bytes of the model file, with paths relative to the folder of the readings."""
        return model_text(self._to_save(), Path(self._now.readings.file).parent)

    def _to_save(self) -> DisplayModel:
        if not self._settled:
            self._settle()
        return self._now.refinement(self._on).to_save if self._on else self._now.fresh


def first_step(current: Fit, effects: Sequence[Effect]) -> Comparison:
    """Compare the model with ``effects`` after one linear step from a fit that has other effects: a preview.

    Effects of ``current`` start at their fitted values; others at rest, in their simple form with the largest linear
    gain. Raises LutgenError: an effect happens between two sessions, and the readings hold one session.
    """
    fitted = {term.effect.name: term for term in current.terms}
    terms = tuple(fitted.get(effect.name) or best_start(current, effect) for effect in effects)
    system, state = current.system_of(terms), State(terms, current.tips, current.gains)
    moved = system.moved(state, system.step(terms).parameters)
    return compare_problem(current.problem, moved.terms, draws=FEW)
