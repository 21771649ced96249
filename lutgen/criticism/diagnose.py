"""Which physical effect is missing? From the search to a verdict in one sentence."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from lutgen.criticism.compare.comparison import Comparison, compare_problem
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.search.influence import Suspicion, suspicious_noise, wrong_rows, wrong_sessions
from lutgen.criticism.search.separate import Separation, what_separates
from lutgen.criticism.search.stepwise import Explanation, explain
from lutgen.criticism.verdict.pronounce import pronounce
from lutgen.criticism.verdict.verdict import VERDICTS, Verdict
from lutgen.criticism.verdict.visibility import Visibility, visibility
from lutgen.effects import catalogue
from lutgen.errors import pick_one
from lutgen.names import FORETELLING_BASELINES, NATIVE_BASELINES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from lutgen.criticism.fit.linear import Term
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

__all__ = ["VERDICTS", "Diagnosis", "Ranked", "diagnose"]

#: The search is repeated where the gain is found to wander by so many times what it was taken to.
UNSTEADIER = 2.0

#: Families of the ranking whose held-out error is computed.
RANKED = 8


@dataclass(frozen=True)
class Ranked:
    """One effect alone beside the model.

    Attributes
    ----------
    effect, form
        Its name and the parameters that its best form frees.
    delta_bic
        By how much BIC falls with it: above 6 is strong.
    rms_sigma, held_out_rms_sigma
        Error with it, of all readings, and of readings withheld from its fit; None where not computed.
    held_out_cells, held_out_left_out
        Groups of readings that belong together, and how many of them could not be withheld, since a parameter rests on
        them; None where not computed.
    explained
        Share of the excess of χ² over the noise that it removes.
    absorbed
        Share of its signature that the tips absorb.
    parameters
        Name → value, stderr (None: the data say nothing), unit, at_bound.

    """

    effect: str
    form: tuple[str, ...]
    delta_bic: float
    rms_sigma: float
    held_out_rms_sigma: float | None
    held_out_cells: int | None
    held_out_left_out: int | None
    explained: float
    absorbed: float | None
    parameters: Mapping[str, Mapping[str, Any]]

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            **self.__dict__,
            "form": list(self.form),
            "parameters": {k: dict(v) for k, v in self.parameters.items()},
        }


@dataclass(frozen=True)
class Diagnosis:
    """What was found.

    Attributes
    ----------
    comparison
        The model without new effects against the readings.
    explanation
        The search.
    verdict
        The verdict and its sentence.
    visibility
        What these data could have seen.
    measure_next
        For effects that cannot be told apart: what would separate them.
    error
        The scatter of replicates that tests go by.

    """

    comparison: Comparison
    explanation: Explanation
    verdict: Verdict
    visibility: tuple[Visibility, ...]
    measure_next: tuple[Separation, ...]
    error: PureError

    @property
    def problem(self) -> Problem:
        """The question."""
        return self.explanation.base.problem

    @cached_property
    def ranking(self) -> tuple[Ranked, ...]:
        """Every effect alone, best first; withheld readings are fitted when it is first asked for."""
        return tuple(_ranking(self.explanation, self.visibility, self.error))

    @cached_property
    def after(self) -> Comparison:
        """The model with what was found against the readings."""
        return compare_problem(self.problem, self.explanation.final.terms)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` prints: the keys of compare, then its own."""
        return {
            **self.comparison.as_json(),
            "verdict": self.verdict.name,
            "sentence": self.verdict.sentence,
            "effects": list(self.verdict.effects),
            "rivals": [list(each) for each in self.verdict.rivals],
            "shares": dict(self.verdict.shares),
            "shares_delta_e": dict(self.verdict.shares_delta_e),
            "ranking": [each.as_json() for each in self.ranking],
            "visibility": [dict(each.__dict__) for each in self.visibility],
            "measure_next": [each.as_json() for each in self.measure_next],
            "parameters": parameters_of(self.explanation.final) if self.verdict.effects else {},
            "remarks": list(self.verdict.remarks),
        }


def diagnose(
    readings: Measurements,
    *,
    baseline: str = "colour-points",
    selection: str = "nearest",
    instrument: str | None = None,
    effects: Mapping[str, Effect] | None = None,
    without: Sequence[str] = (),
    terms: Sequence[Term] = (),
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Diagnosis:
    """Find which physical effect the model lacks.

    Parameters
    ----------
    readings
        The measurements.
    baseline, selection, instrument
        As in :func:`lutgen.criticism.compare.comparison.compare`.
    effects
        The effects to choose from, by name; None: the catalogue.
    without
        Names of effects to leave out.
    terms
        Effects that the model has already, refitted together with new ones.
    progress
        Told how many effects of how many have been tried.

    Raises
    ------
    LutgenError
        Unknown names, or readings that cannot be used.

    """
    problem = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
    problem = with_shared_errors(problem, terms)
    choices = candidates(effects, baseline, (*without, *(term.effect.name for term in terms)))
    if problem.first_readings:
        # Which of the paper's matrices a colour takes makes no difference where its own reading foretells it.
        choices = [each for each in choices if each.stage != "selection"]
    base, error = fit(problem, terms), PureError.of(problem)
    rows = wrong_rows(base)
    if rows:
        problem = problem.without(rows)
        base, error = fit(problem, terms), PureError.of(problem)
    seen = tuple(visibility(base, choices))
    explanation = explain(base, choices, error, progress)
    # A misfit hides a wandering gain, or looks like one; beside the effects that explain the misfit, the gain shows.
    again = with_shared_errors(problem, explanation.final.terms) if explanation.steps else problem
    if max(again.wander, problem.wander) > UNSTEADIER * min(again.wander, problem.wander):
        problem = again
        base = fit(problem, terms)
        explanation = explain(base, choices, error, progress, known=[step.effect for step in explanation.steps])
    suspicion = _suspicion(base, error, rows)
    verdict = pronounce(explanation, error, seen, suspicion)
    named = [step for step in explanation.steps if step.name in verdict.effects]
    rivals = {(step.name, rival.name) for step in named for rival in step.rivals}
    return Diagnosis(
        compare_problem(problem, base.terms),
        explanation,
        verdict,
        seen,
        tuple(what_separates(explanation, pair) for pair in sorted(rivals)),
        error,
    )


def known_under(effects: Mapping[str, Effect] | None, baseline: str) -> Mapping[str, Effect]:
    """Effects by name, the catalogue's where None are given, as a baseline tells them."""
    known = catalogue() if effects is None else effects
    if baseline not in NATIVE_BASELINES:
        return known
    return {name: each.since_first_session() for name, each in known.items()}


def candidates(effects: Mapping[str, Effect] | None, baseline: str, without: Sequence[str]) -> list[Effect]:
    """Effects that a search under a baseline may choose from. Raises LutgenError for an unknown name."""
    known = known_under(effects, baseline)
    for name in without:
        if name not in known:
            raise pick_one("effect", name, known)
    usable = [each for each in known.values() if each.name not in without]
    return [each for each in usable if baseline in FORETELLING_BASELINES or each.baseline == "colour-points"]


def _suspicion(base: Fit, error: PureError, rows: Sequence[int]) -> Suspicion:
    problem = base.problem
    scale = error.variance
    wrong = tuple(sorted({*problem.noise.outliers, *rows}))
    return Suspicion(wrong, wrong_sessions(base, scale), suspicious_noise(problem))


def _ranking(explanation: Explanation, seen: Sequence[Visibility], error: PureError) -> list[Ranked]:
    base = explanation.base
    absorbed = {each.effect: each.absorbed for each in seen}
    noise = error.variance
    excess = max(base.chi2 - base.freedom * noise, 1e-9)
    rows = []
    for place, family in enumerate(explanation.first):
        best = family.best
        withheld = best.fit.withheld if place < RANKED else None
        rows.append(
            Ranked(
                family.name,
                best.form,
                base.bic - best.fit.bic,
                (best.fit.chi2 / best.fit.readings) ** 0.5,
                withheld.rms_sigma if withheld and withheld.left_out < withheld.squares.size else None,
                withheld.squares.size if withheld else None,
                withheld.left_out if withheld else None,
                min(max(best.gain / excess, 0.0), 1.0),
                absorbed.get(family.name),
                parameters_of(best.fit)[family.name],
            )
        )
    return rows


def parameters_of(found: Fit) -> dict[str, dict[str, dict[str, Any]]]:
    """Parameters of a fit's effects: effect → name → value, stderr, unit, at_bound, free."""
    result: dict[str, dict[str, dict[str, Any]]] = {}
    for term, errors in zip(found.terms, found.stderr, strict=True):
        result[term.effect.name] = {}
        for name, parameter in term.effect.parameters.items():
            value, error = term.values[name], errors.get(name)
            result[term.effect.name][name] = {
                "value": value,
                "stderr": error if error is not None and error < float("inf") else None,
                "unit": parameter.unit,
                "at_bound": name in term.free and parameter.is_at_bound(value),
                "free": name in term.free or name in term.gridded,
            }
    return result
