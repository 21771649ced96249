"""The whole page: one file that fetches nothing, the same bytes on every run."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from lutgen.display.aging import show
from lutgen.files import write_atomically
from lutgen.report.document import sections
from lutgen.report.document.evidence import Evidence, evidence_section
from lutgen.report.document.origin import (
    Built,
    certificates_section,
    effects_section,
    label,
    provenance_section,
)

if TYPE_CHECKING:
    from lutgen.appearance.lifetime import Lifetimes
    from lutgen.report.document.scenes import Scenes


@dataclass(frozen=True)
class Run:
    """What a report gathers.

    Attributes
    ----------
    found
        Lifetimes of one image.
    scenes
        The image on the aged displays.
    built
        A folder of LUTs; None: none was given.
    evidence
        Readings held against the model; None: none were given.

    """

    found: Lifetimes
    scenes: Scenes
    built: Built | None = None
    evidence: Evidence | None = None


def write_report(run: Run, path: str | Path) -> None:
    """Write the page. Raises LutgenError where it cannot be written."""
    write_atomically(Path(path), html(run).encode())


def html(run: Run) -> str:
    """Return the page."""
    model, image = run.found.model, Path(run.found.images[0].file)
    kind = model.measurements.metadata.get("display") or Path(model.measurements.file).name
    about = [
        sections.lifetimes(run.found, run.scenes),
        sections.frames(run.scenes),
        evidence_section(run.evidence) if run.evidence else "",
        effects_section(model),
        certificates_section(run.built, model) if run.built else "",
        provenance_section(image, model, run.built, _data(run.evidence)),
    ]
    return Template(_part("page.html")).substitute(
        title=escape(f"{image.name} on an aged display"),
        finding=escape(sections.finding(run.found)),
        display=escape(f"Display: {kind.rstrip('.')}. {show(model).sentence()}"),
        label=label(model),
        caption=escape(sections.picture_caption(run.found, run.scenes)),
        viewer=sections.viewer(run.scenes),
        sections="\n".join(part for part in about if part),
        style=_part("page.css"),
        script=_part("page.js"),
        data=sections.data_of(run.scenes),
    )


def _data(evidence: Evidence | None) -> tuple[str, str] | None:
    if evidence is None:
        return None
    readings = evidence.diagnosis.problem.readings
    return readings.file, readings.sha256


def _part(name: str) -> str:
    return files("lutgen.report").joinpath("templates", name).read_text(encoding="utf-8")
