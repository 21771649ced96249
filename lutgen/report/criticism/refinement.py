"""The page of ``lutgen refine``: the error step by step, what was fitted, what LUTs of the model will carry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from lutgen.criticism.diagnose import parameters_of
from lutgen.report.criticism.comparison import data_line, table
from lutgen.report.criticism.diagnosis import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rich.console import RenderableType
    from rich.table import Table

    from lutgen.criticism.compare import Comparison
    from lutgen.criticism.refine import Refinement
    from lutgen.effects import Effect


def refine_page(
    refinement: Refinement, effects: Mapping[str, Effect], data: str, model: str | None
) -> Iterator[RenderableType]:
    """Yield what ``lutgen refine`` prints; ``data`` is DATA as a shell reads it, ``model`` the file written."""
    yield Text(refinement.sentence(), style="bold")
    if refinement.diagnosis:
        verdict = refinement.diagnosis.verdict
        yield f"Verdict: {verdict.name}: {verdict.sentence}"
    yield data_line(refinement.found.problem)
    yield ""
    yield _steps_table(refinement)
    if refinement.found.terms:
        yield ""
        yield parameter_table(parameters_of(refinement.found), effects)
        yield ""
        yield from refinement.carried() or ["LUTs of this model carry all of it."]
    yield ""
    if not refinement.after.agrees and not refinement.diagnosis:
        first = "" if model else "Write the model (-o MODEL.toml), then:  "
        yield f"Something is left. {first}lutgen diagnose {data} --model {model or 'MODEL.toml'}"
    if model:
        last = f"{float(refinement.found.problem.hours[-1]):g}"
        yield f"Model written: {model}. Bake it:  lutgen build --model {model} --hours 0..{last} -o aged/"
    else:
        yield "No model was written: -o MODEL.toml writes it."


def _steps_table(refinement: Refinement) -> Table:
    made = table("model", "mean ΔE2000", "noise alone", "rms σ", "noise alone", "ratio")
    terms = ", ".join(term.effect.name for term in refinement.before.terms)
    _step(made, f"the model with {terms}" if terms else "the paper's model", refinement.before)
    for step in refinement.steps:
        _step(made, f"+ {step.effect}", step.comparison)
    return made


def _step(made: Table, name: str, comparison: Comparison) -> None:
    error, floor = comparison.error, comparison.floor
    made.add_row(
        name,
        f"{error.delta_e_mean:.3f}",
        f"{floor.delta_e_mean:.3f}",
        f"{error.rms_sigma:.2f}",
        f"{floor.rms_sigma:.2f}",
        f"{comparison.ratio:.2f} ×",
    )
