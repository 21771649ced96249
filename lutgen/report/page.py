"""The page of ``lutgen report``: one HTML file that loads no other file, with the same bytes on every run."""

import platform
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from lutgen.bake.figures import summarise
from lutgen.bake.manifest import MANIFEST, Manifest, model_as_json, read_manifest, same_model
from lutgen.bindings import oiio
from lutgen.criticism.diagnose import Diagnosis
from lutgen.criticism.refine import Refinement
from lutgen.display import DisplayModel, not_measured
from lutgen.display.aging import show
from lutgen.effects import Effect
from lutgen.errors import LutgenError
from lutgen.files import file_sha256, scratch, write_atomically
from lutgen.numerals import readable, spaced
from lutgen.pictures.lifetime import Lifetimes
from lutgen.report import page_scenes
from lutgen.report.comparison import compare_page
from lutgen.report.criticism_plots import FIT, RESIDUALS, STEPS, VISIBILITY, plot_diagnosis, plot_refinement
from lutgen.report.diagnosis import diagnose_page, refine_page
from lutgen.report.drawing import data_address
from lutgen.report.lifetimes import lifetime_page
from lutgen.report.page_template import PageSection, chart, render, style_and_script
from lutgen.report.parts import Headline, Page, Part, Table
from lutgen.version import __version__

#: Picture → its caption, which screen readers read in place of the picture.
CAPTIONS = {
    RESIDUALS: "Where the model fails: residuals by hour, colour and condition, beside what noise alone gives",
    STEPS: "How the error falls toward the noise as effects are added",
    FIT: "What the effects explain: the readings and the fitted effects",
    VISIBILITY: "How large each effect must be for these readings to show it",
}


@dataclass(frozen=True)
class Evidence:
    """Readings compared with the model."""

    #: The result of ``lutgen refine --auto``, with its diagnosis.
    refinement: Refinement
    #: All effects by name.
    effects: Mapping[str, Effect]
    #: The readings and options, as arguments of the next command.
    again: str
    #: File of the display in the pictures if it is not the display of these readings, else "".
    model: str = ""

    @property
    def diagnosis(self) -> Diagnosis:
        """The diagnosis of these readings. Raises ValueError for a refinement without a diagnosis."""
        if self.refinement.diagnosis is None:
            raise ValueError("a report needs a refinement with its diagnosis: refine(…, auto=True).")
        return self.refinement.diagnosis


def answer(evidence: Evidence) -> dict[str, str]:
    """Return the verdict on the readings, and a sentence on the error before or after the refinement."""
    verdict, refinement = evidence.diagnosis.verdict, evidence.refinement
    error = refinement.sentence() if refinement.steps else evidence.diagnosis.comparison.sentence()
    return {"verdict": f"{verdict.name}: {verdict.sentence}", "error": error}


def evidence_section(evidence: Evidence) -> PageSection:
    """Return the section on the model's residuals, the missing effect, and the error with this effect."""
    diagnosis, refinement = evidence.diagnosis, evidence.refinement
    readings, verdict = diagnosis.problem.readings, answer(evidence)["verdict"]
    pictures = _pictures(partial(plot_diagnosis, diagnosis, evidence.effects))
    comparison = list(compare_page(diagnosis.comparison))
    which = list(diagnose_page(diagnosis, evidence.effects, evidence.again))
    values = {
        "verdict": verdict,
        "model": evidence.model,
        "readings": Path(readings.file).name,
        "comparison": comparison,
        "residuals": _plots(pictures, RESIDUALS),
        "diagnosis": _without_repetition(which, [Headline(verdict), *comparison]),
        "effects": _plots(pictures, STEPS, FIT, VISIBILITY),
        "refinement": [],
    }
    if refinement.steps:
        page = refine_page(refinement, evidence.effects, shlex.quote(readings.file), None)
        values["refinement"] = _without_repetition(page, [*comparison, *which])
        values["refined"] = _plots(_pictures(partial(plot_refinement, refinement, evidence.effects)), RESIDUALS)
    return PageSection("readings", "Does the model hold?", "readings.html", values)


def _without_repetition(page: Page, before: Sequence[Part]) -> list[Part]:
    """Return a page without the sentences and headlines of ``before``, since pages of commands begin alike."""
    above = {part for part in before if not isinstance(part, Table)}
    return [part for part in page if isinstance(part, Table) or part not in above]


def _pictures(plot: Callable[[str], list[Path]]) -> dict[str, bytes]:
    """Draw into a temporary folder; return name → PNG."""
    with scratch() as folder:
        return {path.name: path.read_bytes() for path in plot(str(folder))}


def _plots(pictures: Mapping[str, bytes], *names: str) -> list[dict[str, str]]:
    shown = [name for name in names if name in pictures]
    return [{"address": data_address(pictures[name]), "caption": CAPTIONS[name]} for name in shown]


def finding(lifetimes: Lifetimes) -> str:
    """Return a sentence on when the mean ΔE2000 reaches the first tolerance."""
    tolerance, words = min(lifetimes.tolerances), page_scenes.MODES_IN_WORDS
    parts = []
    for mode, curve in lifetimes.images[0].curves.items():
        hours = curve.hours_until("mean", tolerance)
        when = f"after {spaced(round(hours))} h" if hours is not None else f"not within {spaced(lifetimes.last)} h"
        parts.append(f"{when} {f'{words[mode]} ({mode})' if mode in words else f'in mode {mode}'}")
    return f"This picture has changed by a mean ΔE2000 of {tolerance:g} {', and '.join(parts)}."


def lifetimes_section(lifetimes: Lifetimes, scenes: page_scenes.Scenes) -> PageSection:
    """Return the section with the curves, Table 1 and the numbers of every frame."""
    # The section on provenance names the source of the readings; the page's first lines name the luminance law.
    elsewhere = (lifetimes.model.measurements.provenance, lifetimes.model.luminance.sentence())
    tables = []
    for mode, of_mode in scenes.modes.items():
        numbers = (each.numbers for each in of_mode)
        rows = [(spaced(each.hours), *page_scenes.numbers_in_words(each).values()) for each in numbers]
        headings = ("hours", *page_scenes.TILES.values())
        tables.append(Table(headings, rows, words=(), caption=f"{mode}, at the hours shown"))
    page = [part for part in lifetime_page(lifetimes) if part not in elsewhere]
    values = {"chart": chart(lifetimes), "page": page, "tables": tables}
    return PageSection("lifetimes", "How long pictures stay true", "lifetimes.html", values)


#: Group of a certificate → its colours.
_GROUPS = {
    "smooth": "where the display neither jumps nor is clipped",
    "gamut": "at the edge of sRGB",
    "border": "at the model's own jumps",
    "reached": "shown through a correction, within reach",
    "reached_border": "the same, at jumps and at the end of the drive",
    "unreachable": "the same, out of the display's reach",
    "inverse": "within reach, without a file",
}

#: Entry of a model's ``[fit]`` → its meaning.
_FITTED = {
    "noise_relative": "noise of a reading, share",
    "noise_floor_cd_m2": "noise of a reading, cd/m²",
    "rms_sigma_before": "error before the fit, σ",
    "rms_sigma_after": "error after the fit, σ",
    "rms_sigma_floor": "error of noise alone, σ",
    "sentence": "verdict",
}


@dataclass(frozen=True)
class BuildFolder:
    """A folder of LUTs that ``lutgen build`` has written."""

    #: Path as given by the user.
    folder: str
    #: Files of the folder with their certificates, as written by the build.
    manifest: Manifest
    #: Hash of the manifest.
    sha256: str


def read_build(folder: str) -> BuildFolder:
    """Read a build's manifest. Raises LutgenError if there is no manifest."""
    path = Path(folder) / MANIFEST
    manifest = read_manifest(path)
    if manifest is None:
        raise LutgenError(f"{folder}: holds no {MANIFEST}. Give a folder that lutgen build has made.")
    return BuildFolder(folder, manifest, file_sha256(path))


def certificates_section(built: BuildFolder, model: DisplayModel) -> PageSection:
    """Return the section with the certificates, and whether they are for the display in the pictures."""
    luts = [record for record in built.manifest.files if record.kind == "lut"]
    hours = sorted({record.hours for record in luts if record.hours is not None})
    rows = [
        (
            *(row.mode, row.format, _GROUPS.get(row.group, row.group), str(row.files)),
            *(f"{value:.4f}" for value in (row.mean, row.p99, row.max)),
        )
        for row in summarise(luts)
    ]
    headings = ("mode", "format", "colours", "files", "mean", "99 %", "max")
    try:
        same = same_model(built.manifest.recipe.get("model", {}), model_as_json(model, Path(built.folder)))
    except (KeyError, TypeError, AttributeError):
        same = False
    values = {
        "folder": built.folder,
        "count": len(luts),
        "span": f", {spaced(hours[0])} to {spaced(hours[-1])} h" if hours else "",
        "table": Table(headings, rows, words=range(3)) if rows else None,
        "same": same,
    }
    return PageSection("certificates", "How true the LUTs are", "certificates.html", values)


def provenance_section(
    image: Path, model: DisplayModel, built: BuildFolder | None, evidence: Evidence | None
) -> PageSection:
    """Return the section with the files and their SHA-256, the model's options and the versions."""
    readings = model.measurements
    rows = [("picture", image.name, file_sha256(image)), ("display", Path(readings.file).name, readings.sha256)]
    if model.file:
        rows.append(("model", model.file, file_sha256(Path(model.file))))
    if evidence:
        compared = evidence.diagnosis.problem.readings
        rows.append(("readings", compared.file, compared.sha256))
    if built:
        rows.append(("build", str(Path(built.folder) / MANIFEST), built.sha256))
    values = {
        "readings": readings.provenance,
        "files": Table(("what", "file", "SHA-256"), rows, words=range(3)),
        "choices": list(_choices(model)),
    }
    return PageSection("provenance", "Where all this comes from", "provenance.html", values)


def _choices(model: DisplayModel) -> Iterator[tuple[str, str]]:
    yield "lutgen", __version__
    yield "Python, numpy, OpenImageIO", f"{platform.python_version()}, {np.__version__}, {oiio().VERSION_STRING}"
    yield "matrix of a colour", model.selection
    yield "reference", model.reference
    law = ", ".join(f"{factor:g} at {spaced(hour)} h" for hour, factor in model.luminance.table)
    yield "luminance law of chroma-luma", f"{model.luminance.name}{f': {law}' if law else ''}"
    yield "baseline", model.baseline
    stated = ", ".join(f"{name} {value}" for name, value in model.conditions.stated().items())
    yield "seen", stated or "at the centre, in a dark room, warm, full screen"
    for name, value in model.fit.items():
        yield _FITTED.get(name, name), readable(value) if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Run:
    """The results that a report shows."""

    #: Lifetimes of one image.
    lifetimes: Lifetimes
    #: The image on the aged displays, hour by hour.
    scenes: page_scenes.Scenes
    #: A folder of LUTs, or None.
    built: BuildFolder | None = None
    #: Readings compared with the model, or None.
    evidence: Evidence | None = None
    #: The image as it lies on the screen, or None.
    placed: page_scenes.PlacedStills | None = None


def write_report(run: Run, path: str | Path) -> None:
    """Write the page. Raises LutgenError if it cannot be written."""
    write_atomically(Path(path), html(run).encode())


def html(run: Run) -> str:
    """Return the page as HTML."""
    model, image, frame = run.lifetimes.model, Path(run.lifetimes.images[0].file), run.scenes.frame
    size = f"{spaced(frame.source_width)} × {spaced(frame.source_height)} pixels"
    shown = (
        "shown whole" if frame.whole else f"shown at {frame.width} × {frame.height}; numbers are those of all pixels"
    )
    kind = model.measurements.metadata.get("display") or Path(model.measurements.file).name
    return render(
        "page.html",
        title=f"{image.name} on an aged display",
        finding=finding(run.lifetimes),
        display=f"Display: {kind.rstrip('.')}. {show(model).sentence()} {model.luminance.sentence()}",
        label=not_measured(model),
        answer=answer(run.evidence) if run.evidence else None,
        caption=f"{image.name}, {size}, {shown}.",
        sections=list(_sections(run)),
        data=page_scenes.script_data(run.scenes),
        **style_and_script(),
    )


def _sections(run: Run) -> Iterator[PageSection]:
    model, image = run.lifetimes.model, Path(run.lifetimes.images[0].file)
    yield page_scenes.viewer_section(run.scenes)
    yield lifetimes_section(run.lifetimes, run.scenes)
    yield page_scenes.frames_section(run.scenes)
    if run.placed:
        yield page_scenes.on_screen_section(run.placed, run.scenes)
    if run.evidence:
        yield evidence_section(run.evidence)
    if model.effects:
        aging = show(model)
        values = {"effects": aging.effects_in_words(), "remarks": aging.remarks, "verdict": model.verdict}
        yield PageSection("effects", "Effects of the model", "effects.html", values)
    if run.built:
        yield certificates_section(run.built, model)
    yield provenance_section(image, model, run.built, run.evidence)
