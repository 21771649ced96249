"""Whether readings agree with the model: the pages and pictures of compare, diagnose and refine, in one section."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.files import scratch
from lutgen.report.criticism.comparison import compare_page
from lutgen.report.criticism.diagnosis import diagnose_page, refine_page
from lutgen.report.criticism.plots import FIT, RESIDUALS, STEPS, VISIBILITY, plot_diagnosis, plot_refinement
from lutgen.report.document.section import PageSection
from lutgen.report.drawing import data_address

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.refine import Refinement
    from lutgen.effects import Effect
    from lutgen.report.parts import Page, Part

#: What each picture shows; its caption, and what is read aloud in its place.
CAPTIONS = {
    RESIDUALS: "Where the model fails: residuals by hour, colour and condition, beside what noise alone gives",
    STEPS: "How the error falls toward the noise as effects are added",
    FIT: "What the effects explain: the readings and the fitted effects",
    VISIBILITY: "How large each effect must be for these readings to show it",
}


@dataclass(frozen=True)
class Evidence:
    """Readings compared with the model.

    Attributes
    ----------
    refinement
        The result of ``lutgen refine --auto``, with its diagnosis.
    effects
        All effects by name.
    again
        The readings and options, as arguments of a next command.
    model
        File of the display in the pictures, if it is not that of these readings; "" otherwise.

    """

    refinement: Refinement
    effects: Mapping[str, Effect]
    again: str
    model: str = ""

    @property
    def diagnosis(self) -> Diagnosis:
        """Which effect is missing."""
        if self.refinement.diagnosis is None:
            raise ValueError("a report needs a refinement with its diagnosis: refine(…, auto=True).")
        return self.refinement.diagnosis


@dataclass(frozen=True)
class PageVerdict:
    """The verdict for the top of the page: its sentence, and how large the error is or becomes."""

    verdict: str
    error: str


def answer(evidence: Evidence) -> PageVerdict:
    """Say in two sentences what the readings say of the model."""
    verdict, refinement = evidence.diagnosis.verdict, evidence.refinement
    error = refinement.sentence() if refinement.steps else evidence.diagnosis.comparison.sentence()
    return PageVerdict(f"{verdict.name}: {verdict.sentence}", error)


@dataclass(frozen=True)
class Plot:
    """A picture inside the page: the address that holds it, and what it shows."""

    address: str
    caption: str


def evidence_section(evidence: Evidence) -> PageSection:
    """Gather where the model fails, which effect is missing, and how far that effect takes the error down."""
    diagnosis, refinement = evidence.diagnosis, evidence.refinement
    readings = diagnosis.problem.readings
    pictures = _pictures(partial(plot_diagnosis, diagnosis, evidence.effects))
    comparison = list(compare_page(diagnosis.comparison))
    which = list(diagnose_page(diagnosis, evidence.effects, evidence.again))
    values = {
        "verdict": f"{diagnosis.verdict.name}: {diagnosis.verdict.sentence}",
        "model": evidence.model,
        "readings": Path(readings.file).name,
        "comparison": comparison,
        "residuals": _plots(pictures, (RESIDUALS,)),
        "diagnosis": _without_repetition(which, comparison),
        "effects": _plots(pictures, (STEPS, FIT, VISIBILITY)),
        "refinement": [],
        "refined": [],
    }
    if refinement.steps:
        page = refine_page(refinement, evidence.effects, shlex.quote(readings.file), None)
        refined = _pictures(partial(plot_refinement, refinement, evidence.effects))
        values["refinement"] = _without_repetition(page, [*comparison, *which])
        values["refined"] = _plots(refined, (RESIDUALS,))
    return PageSection("readings", "Does the model hold?", "readings.html", values)


def _without_repetition(page: Page, before: Sequence[Part]) -> list[Part]:
    """Leave out sentences that stand above already: the page of each command begins with the same ones."""
    sentences = {part for part in before if isinstance(part, str)}
    return [part for part in page if not (isinstance(part, str) and part in sentences)]


def _pictures(plot: Callable[[str], list[Path]]) -> dict[str, bytes]:
    """Draw into a folder that is gone afterwards: name → PNG."""
    with scratch() as folder:
        return {path.name: path.read_bytes() for path in plot(str(folder))}


def _plots(pictures: Mapping[str, bytes], names: Iterable[str]) -> list[Plot]:
    return [Plot(data_address(pictures[name]), CAPTIONS[name]) for name in names if name in pictures]
