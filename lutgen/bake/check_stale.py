"""Whether the readings and the model of a build are still those that it was made from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.bake.manifest import Manifest, model_as_json, same_model
from lutgen.display import default_display, load_model
from lutgen.errors import LutgenError
from lutgen.readings import read_measurements

if TYPE_CHECKING:
    from lutgen.display import DisplayModel


def stale(folder: Path, manifest: Manifest, model: DisplayModel | None) -> tuple[list[str], list[str]]:
    """Whether the measurements, and a refined model, are still those that the build was made from."""
    findings, remarks = _stale_readings(folder, manifest, model)
    if not findings:
        found, more = _stale_model(folder, manifest, model)
        findings, remarks = findings + found, remarks + more
    return findings, remarks


def _stale_readings(folder: Path, manifest: Manifest, model: DisplayModel | None) -> tuple[list[str], list[str]]:
    display = manifest.recipe["model"]["display"]
    if model is not None:
        current, name = model.measurements.sha256, model.measurements.file
    else:
        source = default_display() if display["path"] is None else folder / display["path"]
        name = display["file"]
        if not source.is_file():
            return [], [f"the measurements {name} were not found; their copy in the manifest was used"]
        try:
            current = read_measurements(source).sha256
        except LutgenError as error:
            return [f"stale: the measurements have changed and cannot be read: {error}"], []
    if current != display["sha256"]:
        why = f"the measurements {name} have changed since the build"
        if model is not None:
            why = f"built from other measurements ({display['file']}) than {name}"
        return [f"stale: {why}; build again"], []
    return [], []


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
