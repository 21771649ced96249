"""Diagnose which physical effect the model lacks: run the search, and return a verdict in one sentence."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from lutgen.criticism.compare.comparison import Comparison, compare_problem
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.search.influence import (
    Suspicion,
    estimated_again,
    sound_fit,
    suspicious_noise,
    wrong_rows,
    wrong_sessions,
)
from lutgen.criticism.search.separate import Separation, what_separates
from lutgen.criticism.search.stepwise import explain
from lutgen.criticism.verdict.pronounce import pronounce
from lutgen.criticism.verdict.verdict import VERDICTS, Verdict
from lutgen.criticism.verdict.visibility import Visibility, visibility
from lutgen.effects import catalogue
from lutgen.errors import pick_one
from lutgen.names import FORETELLING_BASELINES, NATIVE_BASELINES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.search.explanation import Explanation
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

__all__ = ["VERDICTS", "Diagnosis", "Ranked", "diagnose"]

#: Number of effects, from the best, whose held-out error is computed.
RANKED = 8


@dataclass(frozen=True)
class Ranked:
    """One effect, added alone to the model.

    Attributes
    ----------
    effect, form
        Name of the effect, and the parameters that its best form frees.
    delta_bic
        Decrease of BIC with the effect: above 6 is strong.
    rms_sigma, held_out_rms_sigma
        Error with the effect, of all readings, and of readings withheld from the fit; None if not computed.
    held_out_cells, held_out_left_out
        Number of groups of readings, and number of groups that could not be withheld, because a parameter depends on
        them; None if not computed.
    explained
        Share of the excess of χ² over the noise that the effect explains.
    absorbed
        Share of the effect's signature that the tips absorb.
    parameters
        Name → value, stderr (None: not determined by the readings), unit, at_bound.

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
    """The result of a diagnosis.

    Attributes
    ----------
    comparison
        Comparison of the model without new effects with the readings.
    explanation
        The result of the search; if the verdict names effects, with these effects alone.
    verdict
        The verdict and its sentence.
    visibility
        For every effect, whether these readings could show it.
    measure_next
        For effects that these readings cannot distinguish: the patches that would distinguish them.
    error
        Scatter of the replicates, on which the tests rest.

    """

    comparison: Comparison
    explanation: Explanation
    verdict: Verdict
    visibility: tuple[Visibility, ...]
    measure_next: tuple[Separation, ...]
    error: PureError

    @property
    def problem(self) -> Problem:
        """The readings and the model that were fitted."""
        return self.explanation.base.problem

    @cached_property
    def ranking(self) -> tuple[Ranked, ...]:
        """Every effect alone, best first; withheld readings are predicted at the first access."""
        return tuple(_ranking(self.explanation, self.visibility, self.error))

    @cached_property
    def after(self) -> Comparison:
        """Comparison of the readings with the model that includes the effects that were found."""
        return compare_problem(self.problem, self.explanation.final.terms)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` prints: the keys of ``compare``, then those of ``diagnose``."""
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
        Effects that the model has already; they are refitted together with new effects.
    progress
        Called with the number of effects tried and the number of all effects.

    Raises
    ------
    LutgenError
        Unknown names, or readings that cannot be used.

    """
    everything = Problem.of(readings, baseline=baseline, selection=selection, instrument=instrument)
    base, exchanged, wrong = sound_fit(everything, terms)
    problem, error = base.problem, PureError.of(base.problem)
    choices = candidates(effects, baseline, (*without, *(term.effect.name for term in terms)))
    if problem.first_readings:
        # The choice among the paper's matrices has no influence if a colour is predicted from its own first reading.
        choices = [each for each in choices if each.stage != "selection"]
    seen = tuple(visibility(base, choices))
    explanation = explain(base, choices, error, progress)
    # Effects that explain a misfit may uncover wrong readings.
    hidden = wrong_rows(explanation.final) if explanation.steps else ()
    again = estimated_again(explanation.final, hidden) if explanation.steps else problem
    if again is not problem:
        problem, wrong = again, (*wrong, *hidden)
        base, error = fit(problem, terms), PureError.of(problem)
        explanation = explain(base, choices, error, progress, known=[step.chosen for step in explanation.steps])
    rows = tuple(sorted({*problem.noise.outliers, *wrong, *(row for pair in exchanged for row in pair)}))
    suspicion = Suspicion(rows, wrong_sessions(base, error.variance), suspicious_noise(problem), exchanged)
    verdict = pronounce(explanation, error, seen, suspicion)
    named = [step for step in explanation.steps if step.name in verdict.effects]
    rivals = {(step.name, rival.name) for step in named for rival in step.rivals}
    return Diagnosis(
        compare_problem(problem, base.terms),
        explanation.of(verdict.effects),
        verdict,
        seen,
        tuple(what_separates(explanation, pair) for pair in sorted(rivals)),
        error,
    )


def known_under(effects: Mapping[str, Effect] | None, baseline: str) -> Mapping[str, Effect]:
    """Return the effects by name (None: the catalogue); under native baselines they act since the first session."""
    known = catalogue() if effects is None else effects
    if baseline not in NATIVE_BASELINES:
        return known
    return {name: each.since_first_session() for name, each in known.items()}


def candidates(effects: Mapping[str, Effect] | None, baseline: str, without: Sequence[str]) -> list[Effect]:
    """Return the effects that a search under a baseline may choose from; raise LutgenError for an unknown name."""
    known = known_under(effects, baseline)
    for name in without:
        if name not in known:
            raise pick_one("effect", name, known)
    usable = [each for each in known.values() if each.name not in without]
    return [each for each in usable if baseline in FORETELLING_BASELINES or each.baseline == "colour-points"]


def _ranking(explanation: Explanation, seen: Sequence[Visibility], error: PureError) -> list[Ranked]:
    base = explanation.base
    absorbed = {each.effect: each.absorbed for each in seen}
    excess = max(base.chi2 - base.freedom * error.variance, 1e-9)
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


def parameters_of(current: Fit) -> dict[str, dict[str, dict[str, Any]]]:
    """Return the parameters of a fit's effects: effect → name → value, stderr, unit, at_bound, free."""
    result: dict[str, dict[str, dict[str, Any]]] = {}
    for term, errors in zip(current.terms, current.stderr, strict=True):
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
