"""Check of a build's manifest against the files of its folder, and against the readings and the model of the build.

Files may be missing, altered or not listed. The readings and the model may have changed since the build.
"""

import os
import stat
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from lutgen.bake.build import paths_of
from lutgen.bake.formats import format_named, format_names
from lutgen.bake.littlecms import source_profile_of
from lutgen.bake.manifest import JOURNAL, MANIFEST, FileRecord, HeldFile, Manifest, model_as_json, same_model
from lutgen.bake.plan import BuildPlan, direction_of
from lutgen.bindings import LARGEST_LUT
from lutgen.display import DisplayModel, default_display, hour_name, load_model
from lutgen.errors import LutgenError, reason_of
from lutgen.files import PARTIAL
from lutgen.names import DIRECTIONS
from lutgen.readings import Measurements, read_measurements


def unlisted(manifest: Manifest, strangers: Sequence[str]) -> list[tuple[str, str]]:
    """Return each difference between a manifest's files and its options, as the file's path and the fault.

    ``strangers`` are the results of :func:`strangers`. Those that look like files of a build are faults too.

    Raises LutgenError: the manifest's options are not valid options of a build.
    """
    expected, listed = expected_records(plan_of(manifest)), {record.path: record for record in manifest.files}
    missing = [path for path in expected if path not in listed]
    faults = [(path, "the manifest does not list it, though its options ask for it") for path in missing]
    for path, record in listed.items():
        if path not in expected:
            faults.append((path, "the manifest lists it, though its options do not ask for it"))
            continue
        for name in ("kind", "mode", "hours", "format", "clipped"):
            stated, wanted = getattr(record, name), getattr(expected[path], name)
            if stated != wanted:
                faults.append((path, f"{MANIFEST}: {name} is {stated!r}, and the options ask for {wanted!r}"))
    return faults + [
        (path, "the manifest does not list this file, so it cannot be checked")
        for path in strangers
        if _looks_built(path) and path not in expected
    ]


def strangers(folder: Path, manifest: Manifest) -> list[str]:
    """Return the path, relative to the folder, of every file in a build's folder that the manifest does not list."""
    ours = {folder / record.path for record in manifest.files} | {folder / MANIFEST, folder / JOURNAL}
    files = (path for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())
    return sorted(path.relative_to(folder).as_posix() for path in files if path not in ours)


def foreign_files(strangers: Sequence[str]) -> list[str]:
    """Return a remark for each unlisted file that does not look like a file of a build: a file of the user."""
    return [f"{path} is not of this build" for path in strangers if not _looks_built(path)]


def _looks_built(path: str) -> bool:
    name = PurePosixPath(path).name
    names = {format_named(each).file_in(direction) for each in format_names() for direction in DIRECTIONS}
    # Suffixes that programs recognise as LUTs or configs, without suffixes of images.
    suffixes = {format_named(each).suffix for each in format_names()} - {".png"} | {".ocio", ".icm"}
    return name in names or name.endswith(PARTIAL) or PurePosixPath(path).suffix.lower() in suffixes


def plan_of(manifest: Manifest) -> BuildPlan:
    """Return the plan of a manifest's options. Raises LutgenError when the options are not valid options of a build."""
    try:
        options = manifest.recipe["options"]
        plan = BuildPlan(
            hours=tuple(float(hour) for hour in options["hours"]),
            modes=tuple(options["modes"]),
            formats=tuple(options["formats"]),
            cubesize=options["cubesize"],
            tolerance=options["tolerance"],
            certify=options["certify"],
            direction=direction_of(manifest),
            unreachable=options.get("unreachable", "clip"),
            gpu=options.get("gpu", False),
            source=source_profile_of(options["source_profile"]) if "source_profile" in options else None,
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, LutgenError):
            raise
        raise LutgenError(f"its options are not complete ({error!r})") from None
    written = plan.as_json()
    wrong = [key for key in {**options, **written} if options.get(key, ...) != written.get(key, ...)]
    if wrong:
        raise LutgenError(f"its option {wrong[0]} is not one that lutgen writes: {options.get(wrong[0])!r}")
    return plan


def expected_records(plan: BuildPlan) -> dict[str, FileRecord]:
    """Return the expected record of each file of a plan, by path, without hash, size and certificate."""
    displays = {folder: (mode, hours) for mode, hours, folder in plan.folders()}
    formats = {format_named(name).file_in(plan.direction): name for name in plan.formats}
    records = {}
    for path in paths_of(plan):
        folder, _, name = path.rpartition("/")
        mode, hours = displays.get(folder, (None, None))
        form = formats.get(name)
        clipped = None if form is None else not format_named(form).unclipped
        records[path] = FileRecord(path, "lut" if form else "config", mode, hours, "", 0, form, clipped=clipped)
    return records


def altered(path: Path, record: FileRecord) -> tuple[str | None, HeldFile | None]:
    """Return the fault of a file, or None, and its bytes, or None when the file cannot be a file of a build."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            return "is no file any more", None
        if path.stat().st_size > LARGEST_LUT:
            return f"altered: larger than {LARGEST_LUT // 1_000_000} MB, which no file of a build is", None
        file = HeldFile(path, path.read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        return "missing", None
    except OSError as error:
        return f"cannot be read: {reason_of(error)}", None
    same = len(file.data) == record.bytes and file.sha256 == record.sha256
    return None if same else "altered: its bytes are not those that lutgen wrote", file


def unknown_values(plan: BuildPlan) -> list[str]:
    """Return a remark for each context variable of the environment whose mode or hour the build does not have.

    OpenColorIO reads context variables from the environment.
    """
    known = {"AGING_MODE": list(plan.modes), "AGING_HOURS": [hour_name(hours)[:-1] for hours in plan.hours]}
    return [
        f"the environment says {name}={os.environ[name]}, which this build does not have; it has {', '.join(values)}"
        for name, values in known.items()
        if name in os.environ and os.environ[name] not in values
    ]


#: Fields of the readings that a manifest copies → their names in messages.
_COPIED = {"metadata": "metadata", "hours": "hours", "xyY": "colours"}


def stale(
    folder: Path, manifest: Manifest, model: DisplayModel | None, built_from: DisplayModel
) -> tuple[list[str], list[str]]:
    """Return findings and remarks on measurements, or a refined model, that have changed since the build."""
    findings, remarks = _stale_readings(folder, manifest, model, built_from)
    if not findings:
        findings, more = _stale_model(folder, manifest, model)
        remarks = remarks + more
    return findings, remarks


def _stale_readings(
    folder: Path, manifest: Manifest, model: DisplayModel | None, built_from: DisplayModel
) -> tuple[list[str], list[str]]:
    display = manifest.recipe["model"]["display"]
    name = display["file"]
    if model is not None:
        other = model.measurements.sha256 != display["sha256"]
        why = f"built from other measurements ({name}) than {model.measurements.file}"
        return [f"stale: {why}; build again"] if other else [], []
    source = default_display() if display["path"] is None else folder / display["path"]
    if not source.is_file():
        return [], [f"the measurements {name} were not found; their copy in the manifest was used"]
    try:
        readings = read_measurements(source)
    except LutgenError as error:
        return [f"stale: the measurements have changed and cannot be read: {error}"], []
    if readings.sha256 != display["sha256"]:
        return [f"stale: the measurements {name} have changed since the build; build again"], []
    return _differing_fields(readings, folder, manifest, built_from), []


def _differing_fields(readings: Measurements, folder: Path, manifest: Manifest, built_from: DisplayModel) -> list[str]:
    """Return a finding for each field in which the manifest's copy of the readings differs from the file."""
    copied = manifest.recipe["model"]
    written = model_as_json(replace(built_from, measurements=readings), folder)["display"]
    return [
        f"its copy of the readings {Path(readings.file).name} has other {part} than the file"
        for key, part in _COPIED.items()
        if not _equal_parts(copied["display"].get(key), written[key])
    ]


def _equal_parts(copied: Any, written: Any) -> bool:
    """Whether two parts of a model are equal. Numbers may differ by the rounding of another processor."""
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
        return [], []  # without effects, every model of the same display is the same model
    if current is None or same_model(built_from, model_as_json(current, folder)):
        return [], []
    which = Path(current.file or name or "given").name
    return [f"stale: the build was made from another version of the model {which}; build again"], []
