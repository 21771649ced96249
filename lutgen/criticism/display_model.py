"""The display model of a fit, as a file holds it, and the terms of a fit from such a model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.diagnose import parameters_of
from lutgen.criticism.fit.anchored import anchored_tips
from lutgen.criticism.fit.joint_covariance import joint_covariance
from lutgen.criticism.fit.least_squares import start_state
from lutgen.criticism.fit.linear import Term
from lutgen.display.conditions import Conditions, conditions_of
from lutgen.display.fitted import AppliedEffect, Estimate, LatentTips
from lutgen.display.model import DisplayModel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.compare.comparison import Comparison
    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem
    from lutgen.effects import Effect


def model_of(current: Fit, diagnosis: Diagnosis | None, before: Comparison, after: Comparison) -> DisplayModel:
    """Return the display model of a fit, with its provenance."""
    problem = current.problem
    knots = problem.is_knot
    tips = _tips_of(current, after)
    parameters = parameters_of(current)
    applied = tuple(
        AppliedEffect(
            term.effect,
            {
                name: Estimate(each["value"], each["stderr"], each["at_bound"])
                for name, each in parameters[term.effect.name].items()
            },
            (*term.gridded, *term.free),
        )
        for term in current.terms
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
        conditions=_at_rest(problem, [term.effect for term in current.terms]),
        effects=applied,
        latent=LatentTips(problem.hours[knots], np.array(tips[knots])),
        covariance=joint_covariance(current),
        baseline=problem.baseline,
        held=problem.held,
        native=problem.native,
        verdict=diagnosis.verdict.name if diagnosis else "",
        fit=record,
    )


def _tips_of(current: Fit, after: Comparison) -> Array:
    """Return the latent tips for a model file, (H, 4, 3), cd/m².

    Fitted tips that compensate for an unexplained residual are not the tips of the display. Therefore, without effects,
    the measured tips are returned; if more than noise is left, the tips are solved from their own readings.
    """
    if not current.terms:
        return start_state(current.problem, ()).tips
    return current.tips if after.agrees else anchored_tips(current.problem.as_baked, current.terms)


def _at_rest(problem: Problem, effects: Sequence[Effect]) -> Conditions:
    """Return the rest conditions of the campaign that effects need; a bake uses them unless ``--at`` states others."""
    needed = {name for effect in effects for name in effect.needs}
    return conditions_of({name: value for name, value in problem.readings.usual().items() if name in needed})


def terms_of(model: DisplayModel) -> tuple[Term, ...]:
    """Return the effects of a saved model as terms of a fit, with the same free parameters."""
    terms = []
    for applied in model.effects:
        gridded = tuple(name for name in applied.free if applied.effect.parameters[name].grid)
        free = tuple(name for name in applied.free if name not in gridded)
        terms.append(Term(applied.effect, dict(applied.values), free, gridded))
    return tuple(terms)
