"""Whether the readings and the model of a build are still those that it was made from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.bake.manifest import Manifest, model_as_json, same_model
from lutgen.display import default_display, load_model
from lutgen.errors import LutgenError
from lutgen.readings import read_measurements

if TYPE_CHECKING:
    from lutgen.display import DisplayModel
    from lutgen.readings import Measurements

#: What a manifest copies of the readings, and its name for people.
_COPIED = {"metadata": "words", "hours": "hours", "xyY": "colours"}


def stale(
    folder: Path, manifest: Manifest, model: DisplayModel | None, built_from: DisplayModel
) -> tuple[list[str], list[str]]:
    """Whether the measurements, and a refined model, are still those that the build was made from."""
    findings, remarks = _stale_readings(folder, manifest, model, built_from)
    if not findings:
        found, more = _stale_model(folder, manifest, model)
        findings, remarks = findings + found, remarks + more
    return findings, remarks


def _stale_readings(
    folder: Path, manifest: Manifest, model: DisplayModel | None, built_from: DisplayModel
) -> tuple[list[str], list[str]]:
    display = manifest.recipe["model"]["display"]
    if model is not None:
        current, name = model.measurements.sha256, model.measurements.file
    else:
        source = default_display() if display["path"] is None else folder / display["path"]
        name = display["file"]
        if not source.is_file():
            return [], [f"the measurements {name} were not found; their copy in the manifest was used"]
        try:
            readings = read_measurements(source)
        except LutgenError as error:
            return [f"stale: the measurements have changed and cannot be read: {error}"], []
        current = readings.sha256
        if current == display["sha256"]:
            return _otherwise_than(readings, folder, manifest, built_from), []
    if current != display["sha256"]:
        why = f"the measurements {name} have changed since the build"
        if model is not None:
            why = f"built from other measurements ({display['file']}) than {name}"
        return [f"stale: {why}; build again"], []
    return [], []


def _otherwise_than(readings: Measurements, folder: Path, manifest: Manifest, built_from: DisplayModel) -> list[str]:
    """Say what the manifest's copy of the readings has otherwise than the file that they are from."""
    copied = manifest.recipe["model"]
    written = model_as_json(replace(built_from, measurements=readings), folder)["display"]
    return [
        f"its copy of the readings {Path(readings.file).name} has other {words} than the file"
        for key, words in _COPIED.items()
        if not _alike(copied["display"].get(key), written[key])
    ]


def _alike(copied: Any, written: Any) -> bool:
    """Whether two parts of a model are the same; numbers up to what another processor rounds."""
    if isinstance(written, dict):
        return bool(copied == written)
    copied, written = np.asarray(copied), np.asarray(written)
    return copied.shape == written.shape and np.allclose(copied, written, rtol=1e-12, atol=0)


def _stale_model(folder: Path, manifest: Manifest, model: DisplayModel | None) -> tuple[list[str], list[str]]:
    built_from = manifest.recipe["model"]
    name, current = built_from.get("file", ""), model
    if model is None:
        if not name:
            return [], []
        if not (folder / name).is_file():
            return [], [f"the model file {Path(name).name} was not found; its copy in the manifest was used"]
        try:
            current = load_model(folder / name)
        except LutgenError as error:
            return [f"stale: the model has changed and cannot be read: {error}"], []
    elif not (model.effects or "effects" in built_from):
        return [], []  # the files themselves tell: any model that says the same as they will do
    if current is None or same_model(built_from, model_as_json(current, folder)):
        return [], []
    which = Path(current.file or name or "given").name
    return [f"stale: the model {which} is not the one that was built from; build again"], []
