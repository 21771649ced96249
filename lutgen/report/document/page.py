"""The whole page: one file that fetches nothing, the same bytes on every run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.display.aging import show
from lutgen.files import write_atomically
from lutgen.report.document.evidence import Evidence, answer, evidence_section
from lutgen.report.document.lifetimes import finding, lifetimes_section, picture_caption
from lutgen.report.document.origin import BuildFolder, certificates_section, effects_section, label, provenance_section
from lutgen.report.document.section import render, style_and_script
from lutgen.report.document.viewer import frames_section, script_data, viewer_section

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.pictures.lifetime import Lifetimes
    from lutgen.report.document.scenes import Scenes
    from lutgen.report.document.section import PageSection


@dataclass(frozen=True)
class Run:
    """The results that a report shows.

    Attributes
    ----------
    lifetimes
        Lifetimes of one image.
    scenes
        The image on the aged displays, hour by hour.
    built
        A folder of LUTs, or None.
    evidence
        Readings compared with the model, or None.

    """

    lifetimes: Lifetimes
    scenes: Scenes
    built: BuildFolder | None = None
    evidence: Evidence | None = None


def write_report(run: Run, path: str | Path) -> None:
    """Write the page. Raises LutgenError where it cannot be written."""
    write_atomically(Path(path), html(run).encode())


def html(run: Run) -> str:
    """Return the page."""
    model, image = run.lifetimes.model, Path(run.lifetimes.images[0].file)
    kind = model.measurements.metadata.get("display") or Path(model.measurements.file).name
    return render(
        "page.html",
        title=f"{image.name} on an aged display",
        finding=finding(run.lifetimes),
        display=f"Display: {kind.rstrip('.')}. {show(model).sentence()}",
        label=label(model),
        answer=answer(run.evidence) if run.evidence else None,
        caption=picture_caption(run.lifetimes, run.scenes),
        sections=list(_sections(run)),
        data=script_data(run.scenes),
        **style_and_script(),
    )


def _sections(run: Run) -> Iterator[PageSection]:
    model, image = run.lifetimes.model, Path(run.lifetimes.images[0].file)
    yield viewer_section(run.scenes)
    yield lifetimes_section(run.lifetimes, run.scenes)
    yield frames_section(run.scenes)
    if run.evidence:
        yield evidence_section(run.evidence)
    if model.effects:
        yield effects_section(model)
    if run.built:
        yield certificates_section(run.built, model)
    yield provenance_section(image, model, run.built, _data(run.evidence))


def _data(evidence: Evidence | None) -> tuple[str, str] | None:
    if evidence is None:
        return None
    readings = evidence.diagnosis.problem.readings
    return readings.file, readings.sha256
