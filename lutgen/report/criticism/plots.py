"""The pictures of compare, diagnose and refine, as files in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.criticism.compare import compare_problem
from lutgen.criticism.fit_view import View
from lutgen.report.criticism.fit_plot import plot_fit
from lutgen.report.criticism.residual_plot import plot_residuals
from lutgen.report.criticism.steps_plot import Stage, plot_steps
from lutgen.report.criticism.visibility_plot import plot_visibility

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.criticism.compare import Comparison
    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.refine import Refinement
    from lutgen.effects import Effect

RESIDUALS, STEPS, FIT, VISIBILITY = "residuals.png", "steps.png", "fit.png", "visibility.png"

#: Pictures that compare, diagnose and refine may write.
OF_COMPARE, OF_DIAGNOSE, OF_REFINE = (RESIDUALS,), (RESIDUALS, STEPS, FIT, VISIBILITY), (RESIDUALS, STEPS, FIT)

#: Name of the model before an effect is added.
FIRST = "the model"


def plot_comparison(comparison: Comparison, folder: str | Path, *, force: bool = False) -> list[Path]:
    """Draw a comparison: where the model fails. Raises LutgenError where a picture cannot be written."""
    path = Path(folder) / RESIDUALS
    plot_residuals(comparison, path, force=force)
    return [path]


def plot_diagnosis(
    diagnosis: Diagnosis, effects: Mapping[str, Effect], folder: str | Path, *, force: bool = False
) -> list[Path]:
    """Draw a diagnosis; errors as in :func:`plot_comparison`.

    The fit is drawn of the effects that the verdict names. For ``unexplained`` it is drawn of the effect that comes
    nearest; other verdicts that name no effect have no such picture.
    """
    place, foot = Path(folder), diagnosis.problem.readings.provenance
    explanation, problem = diagnosis.explanation, diagnosis.problem
    # A verdict that names no effect has rejected the steps of the search.
    steps = explanation.steps if diagnosis.verdict.effects else ()
    pictures = plot_comparison(diagnosis.comparison, folder, force=force)
    stages = [Stage(FIRST, diagnosis.comparison)]
    for step, trail in zip(steps, explanation.trail, strict=False):
        stages.append(Stage(f"+ {step.name}", compare_problem(problem, trail.terms)))
    plot_steps(stages, diagnosis, place / STEPS, foot=foot, force=force)
    plot_visibility(diagnosis.visibility, effects, place / VISIBILITY, foot=foot, force=force)
    pictures += [place / STEPS, place / VISIBILITY]
    if steps:
        title, terms = diagnosis.verdict.sentence.rstrip("."), explanation.final.terms
        shown = [step.chosen.effect for step in steps]
    elif diagnosis.verdict.name == "unexplained" and explanation.first:
        nearest = explanation.first[0]
        title, terms = (
            f"No known effect explains it: {nearest.name} comes nearest, and leaves too much",
            nearest.best.fit.terms,
        )
        shown = [nearest.effect]
    else:
        return pictures
    views = [View.of(problem, terms, effect) for effect in shown]
    plot_fit(views, place / FIT, title=title, foot=foot, force=force)
    return [*pictures, place / FIT]


def plot_refinement(
    refinement: Refinement, effects: Mapping[str, Effect], folder: str | Path, *, force: bool = False
) -> list[Path]:
    """Draw a refinement; errors as in :func:`plot_comparison`."""
    place, foot = Path(folder), refinement.found.problem.readings.provenance
    added = ", ".join(step.effect for step in refinement.steps)
    before = refinement.before if refinement.steps else None
    plot_residuals(refinement.after, place / RESIDUALS, force=force, added=added, before=before)
    stages = [
        Stage(FIRST, refinement.before),
        *(Stage(f"+ {step.effect}", step.comparison) for step in refinement.steps),
    ]
    plot_steps(stages, None, place / STEPS, foot=foot, force=force)
    pictures = [place / RESIDUALS, place / STEPS]
    new = [effects[step.effect] for step in refinement.steps]
    if not new:
        return pictures
    views = [View.of(refinement.found.problem, refinement.found.terms, effect) for effect in new]
    plot_fit(views, place / FIT, title=refinement.sentence().rstrip("."), foot=foot, force=force)
    return [*pictures, place / FIT]
