"""Certificates and provenance: the accuracy of a build, and the files and choices behind all numbers of the page."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen import __version__
from lutgen.bake.manifest import MANIFEST, Manifest, model_as_json, read_manifest, same_model
from lutgen.bake.summary import summarise
from lutgen.bindings import oiio
from lutgen.display.aging import show
from lutgen.errors import LutgenError
from lutgen.files import file_sha256
from lutgen.numerals import readable, spaced
from lutgen.report.document.section import PageSection
from lutgen.report.parts import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.display import DisplayModel

#: Group of a certificate → which colours it holds.
_GROUPS = {
    "smooth": "where the display neither jumps nor is clipped",
    "gamut": "at the edge of sRGB",
    "border": "at the model's own jumps",
    "reached": "shown through a correction, within reach",
    "reached_border": "the same, at jumps and at the end of the drive",
    "unreachable": "the same, out of the display's reach",
    "inverse": "within reach, without a file",
}

#: Entry of a model's ``[fit]`` → what it is.
_FITTED = {
    "noise_relative": "noise of a reading, share",
    "noise_floor_cd_m2": "noise of a reading, cd/m²",
    "rms_sigma_before": "error before the fit, σ",
    "rms_sigma_after": "error after the fit, σ",
    "rms_sigma_floor": "error of noise alone, σ",
    "sentence": "verdict",
}

#: First words of the line `# source: …` of readings that were not measured.
_NOT_MEASURED = ("RECONSTRUCTED", "SIMULATED")


@dataclass(frozen=True)
class BuildFolder:
    """A folder of LUTs.

    Attributes
    ----------
    folder
        As the user named it.
    manifest
        Its files with their certificates, from the time of the build.
    sha256
        Of the manifest.

    """

    folder: str
    manifest: Manifest
    sha256: str


def read_build(folder: str) -> BuildFolder:
    """Read a build's manifest. Raises LutgenError where there is none."""
    path = Path(folder) / MANIFEST
    manifest = read_manifest(path)
    if manifest is None:
        raise LutgenError(f"{folder}: holds no {MANIFEST}. Give a folder that lutgen build has made.")
    return BuildFolder(folder, manifest, file_sha256(path))


def certificates_section(built: BuildFolder, model: DisplayModel) -> PageSection:
    """Gather the certificates, and whether they are of the display in the pictures."""
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
    values = {
        "folder": built.folder,
        "count": len(luts),
        "span": f", {spaced(hours[0])} to {spaced(hours[-1])} h" if hours else "",
        "table": Table(headings, rows, words=range(3)) if rows else None,
        "same": _is_of(built, model),
    }
    return PageSection("certificates", "How true the LUTs are", "certificates.html", values)


def _is_of(built: BuildFolder, model: DisplayModel) -> bool:
    """Whether a build is of this display and model; one whose manifest does not say so is not."""
    try:
        return same_model(built.manifest.recipe.get("model", {}), model_as_json(model, Path(built.folder)))
    except (KeyError, TypeError, AttributeError):
        return False


def effects_section(model: DisplayModel) -> PageSection:
    """Gather the effects that the model adds to the paper's."""
    aging = show(model)
    values = {"effects": aging.effects_in_words(), "remarks": aging.remarks, "verdict": model.verdict}
    return PageSection("effects", "Effects of the model", "effects.html", values)


def label(model: DisplayModel) -> str:
    """Say that the display was not measured; "" if it was."""
    source = model.measurements.metadata.get("source", "")
    word = next((word for word in _NOT_MEASURED if source.startswith(word)), "")
    return f"This display is {word.lower()}, not measured." if word else ""


def provenance_section(
    image: Path, model: DisplayModel, built: BuildFolder | None, data: tuple[str, str] | None
) -> PageSection:
    """Gather files with their SHA-256, the model's choices and the versions; ``data`` is a file and its hash."""
    readings = model.measurements
    rows = [("picture", str(image), file_sha256(image)), ("display", Path(readings.file).name, readings.sha256)]
    if model.file:
        rows.append(("model", model.file, file_sha256(Path(model.file))))
    if data:
        rows.append(("readings", *data))
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
