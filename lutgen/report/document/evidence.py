"""What readings say of the model: compare, diagnose and refine, with the words and pictures that the commands give."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from functools import partial
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from lutgen.report.criticism.comparison import compare_page
from lutgen.report.criticism.diagnosis import diagnose_page
from lutgen.report.criticism.plots import FIT, RESIDUALS, STEPS, VISIBILITY, plot_diagnosis, plot_refinement
from lutgen.report.criticism.refinement import refine_page
from lutgen.report.document.markup import printed
from lutgen.report.document.png import data_uri

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.refine import Refinement
    from lutgen.effects import Effect
    from lutgen.report.parts import Page, Part

#: What each picture shows, for those who do not see it.
_SHOWN = {
    RESIDUALS: "Where the model fails: residuals by hour, colour and condition, beside what noise alone gives",
    STEPS: "How the error falls toward the noise as effects are added",
    FIT: "What the effects explain: the readings and the fitted effects",
    VISIBILITY: "How large each effect must be for these readings to show it",
}


@dataclass(frozen=True)
class Evidence:
    """Readings held against the model.

    Attributes
    ----------
    refinement
        What ``lutgen refine --auto`` found, its diagnosis with it.
    effects
        All effects by name.
    again
        The words that name the readings and options in a command.
    model
        What the model of the pictures was read from, if that was not these readings; "" otherwise.

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


def evidence_section(evidence: Evidence) -> str:
    """Write the section: where the model fails, what is missing, how far that takes the error down."""
    diagnosis, refinement = evidence.diagnosis, evidence.refinement
    readings = diagnosis.problem.readings
    before = _pictures(partial(plot_diagnosis, diagnosis, evidence.effects))
    where = list(compare_page(diagnosis.comparison))
    which = list(diagnose_page(diagnosis, evidence.effects, evidence.again))
    parts = [
        '<section id="readings">',
        "<h2>Does the model hold?</h2>",
        f'<p class="finding">{escape(diagnosis.verdict.name)}: {escape(diagnosis.verdict.sentence)}</p>',
    ]
    if evidence.model:
        parts.append(
            f'<p class="caution">The pictures above show the display of {escape(evidence.model)}; what follows judges '
            f"the readings of {escape(Path(readings.file).name)}.</p>"
        )
    parts += [
        "<h3>Where the model fails</h3>",
        printed(where),
        _figures(before, (RESIDUALS,)),
        "<h3>Which effect is missing</h3>",
        printed(_new(which, where)),
        _figures(before, (STEPS, FIT, VISIBILITY)),
    ]
    if refinement.steps:
        data = shlex.quote(readings.file)
        parts += [
            "<h3>The model with it</h3>",
            "<p>The pictures above do not have it yet: write the refined model, and give it with --model.</p>",
            printed(_new(refine_page(refinement, evidence.effects, data, None), [*where, *which])),
            _figures(_pictures(partial(plot_refinement, refinement, evidence.effects)), (RESIDUALS,)),
        ]
    return "\n".join([*parts, "</section>"])


def _new(page: Page, said: Sequence[Part]) -> Iterator[Part]:
    """Leave out sentences that the page above has said already: each command's page begins with where it stands."""
    before = {part for part in said if isinstance(part, str)}
    return (part for part in page if not (isinstance(part, str) and part in before))


def _pictures(plot: Callable[[str], list[Path]]) -> dict[str, bytes]:
    """Draw into a folder that is gone afterwards: name → PNG."""
    with TemporaryDirectory(prefix="lutgen-") as folder:
        return {path.name: path.read_bytes() for path in plot(folder)}


def _figures(pictures: Mapping[str, bytes], names: Iterable[str]) -> str:
    return "\n".join(
        f'<figure class="plot"><img src="{data_uri(pictures[name])}" alt="{escape(_SHOWN[name])}">'
        f"<figcaption>{escape(_SHOWN[name])}.</figcaption></figure>"
        for name in names
        if name in pictures
    )
