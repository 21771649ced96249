"""The page of ``lutgen refine``: the error after each added effect, the fitted parameters, what LUTs can carry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.criticism.diagnose import parameters_of
from lutgen.report.criticism.comparison import data_line
from lutgen.report.criticism.diagnosis import parameter_table
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from lutgen.criticism.compare import Comparison
    from lutgen.criticism.refine import Refinement
    from lutgen.effects import Effect
    from lutgen.report.parts import Part


def refine_page(refinement: Refinement, effects: Mapping[str, Effect], data: str, model: str | None) -> Iterator[Part]:
    """Yield what ``lutgen refine`` prints; ``data`` is DATA quoted for a shell, ``model`` the model file written."""
    yield Headline(refinement.sentence())
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
    terms = ", ".join(term.effect.name for term in refinement.before.terms)
    stages = {
        f"the model with {terms}" if terms else "the paper's model": refinement.before,
        **{f"+ {step.effect}": step.comparison for step in refinement.steps},
    }
    headings = ("model", "mean ΔE2000", "noise alone", "rms σ", "noise alone", "ratio")
    return Table(headings, [_errors(name, comparison) for name, comparison in stages.items()])


def _errors(name: str, comparison: Comparison) -> tuple[str, ...]:
    error, floor = comparison.error, comparison.floor
    return (
        name,
        f"{error.delta_e_mean:.3f}",
        f"{floor.delta_e_mean:.3f}",
        f"{error.rms_sigma:.2f}",
        f"{floor.rms_sigma:.2f}",
        f"{comparison.ratio:.2f} ×",
    )
