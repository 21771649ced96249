"""``manifest.json``: the inputs of a build, and the measured errors of its files.

The manifest holds the colour points (tips), so that ``lutgen check`` can compare the files with the model without the
measurements. It also holds the hash of the measurements, so that ``lutgen check`` can report changed measurements.
"""

import hashlib
import json
import os
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.colorimetry import xyY_to_xyz
from lutgen.display import AppliedEffect, DisplayModel, LatentTips, default_display
from lutgen.display.carried import what_luts_carry
from lutgen.display.conditions import REFERENCE, conditions_of
from lutgen.display.fitted import found_by, record_of
from lutgen.display.native import NativeDisplay
from lutgen.display.own_model.stored import StoredModel
from lutgen.display.tips import LAWS, law_of_table, luminance_law
from lutgen.documents import from_json
from lutgen.errors import LutgenError, reason_of
from lutgen.files import bytes_at_most
from lutgen.readings.rest import TIP_DRIVES
from lutgen.readings.table import Measurements
from lutgen.version import __version__

MANIFEST = "manifest.json"
JOURNAL = ".lutgen-build.json"
SCHEMA = 1

#: Maximum size of a manifest. The record of a LUT has some two thousand bytes, so this is a hundred thousand LUTs.
MAX_BYTES = 256_000_000


def recipe_of(model: Mapping[str, Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs that decide the bytes of a build, in the form of the manifest: the model and the options."""
    return {"schema": SCHEMA, "generator": f"lutgen {__version__}", "model": model, "options": options}


@dataclass(frozen=True)
class FileRecord:
    """One file of a build.

    ``kind`` is ``lut`` or ``config``. ``space``, ``size``, ``clipped`` and ``certificate`` are None for a config.
    ``gpu`` is the result of ``bake/gpu.py``, or None when the shaders were not run.
    """

    path: str
    kind: str
    mode: str | None
    hours: float | None
    sha256: str
    bytes: int
    format: str | None = None
    space: str | None = None
    size: int | None = None
    clipped: bool | None = None
    certificate: Mapping[str, Any] | None = None
    gpu: Mapping[str, Any] | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the record in the form of the manifest. The key ``gpu`` is omitted when it was not measured."""
        content = vars(self)
        return content.copy() if self.gpu else {key: value for key, value in content.items() if key != "gpu"}


@dataclass(frozen=True)
class Manifest:
    """A finished build."""

    recipe: Mapping[str, Any]
    files: tuple[FileRecord, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the content with keys in a fixed order and without dates."""
        return {**self.recipe, "files": [record.as_json() for record in self.files]}

    def as_bytes(self) -> bytes:
        """Return the bytes of the manifest, with one line for each file."""
        recipe = json.dumps(self.recipe, indent=1, ensure_ascii=False).removesuffix("\n}")
        files = ",\n  ".join(json.dumps(record.as_json(), ensure_ascii=False) for record in self.files)
        return f'{recipe},\n "files": [\n  {files}\n ]\n}}\n'.encode()


@dataclass(frozen=True, eq=False)
class HeldFile:
    """A file and its bytes."""

    path: Path
    data: bytes

    @cached_property
    def sha256(self) -> str:
        """The SHA-256 of the bytes, in the form of manifests."""
        return sha256(self.data)


def sha256(data: bytes) -> str:
    """Return the SHA-256 of ``data`` in the form of manifests."""
    return hashlib.sha256(data).hexdigest()


def model_as_json(model: DisplayModel, output: Path) -> dict[str, Any]:
    """Describe a model as JSON data, from which :func:`model_from_json` rebuilds the model.

    The paths of the measurements, of the model's file and of users' own effects are relative to the output folder. The
    path of the measurements is None for lutgen's built-in display.
    """
    readings = model.measurements
    built_in = Path(readings.file) == default_display()
    # The calibrations of the sessions' files, if the model uses them.
    known = readings.calibrations if model.known else {}
    calibrations = [[hour, curves.tolist()] for hour, curves in known.items()]
    return {
        "display": {
            "file": Path(readings.file).name,
            "path": None if built_in else Path(os.path.relpath(readings.file, output)).as_posix(),
            "sha256": readings.sha256,
            "metadata": dict(readings.metadata),
            "hours": model.tips.hours.tolist(),
            "xyY": model.tips.xyY.tolist(),
            **({"calibrations": calibrations} if known else {}),
        },
        "reference": model.reference,
        "selection": model.selection,
        "luminance": {"law": model.luminance.name, "table": [list(row) for row in model.luminance.table]},
        **_refinements_as_json(model, output),
    }


def _refinements_as_json(model: DisplayModel, output: Path) -> dict[str, Any]:
    """Return the choices of a model that differ from the paper. A key is omitted where the model follows the paper."""
    content: dict[str, Any] = {}
    if model.baseline != "colour-points":
        content |= {"baseline": model.baseline, "held": model.held}
    if model.native:
        own = model.native.own
        stored = {"own": b64encode(own.content).decode("ascii")} if own else {}
        content["native"] = model.native.as_record() | stored
    if model.conditions != REFERENCE:
        content["conditions"] = model.conditions.stated()
    if model.latent:
        content["latent"] = {"hours": model.latent.hours.tolist(), "xyz_cd_m2": model.latent.xyz_cd_m2.tolist()}
    if model.effects:
        content["effects"] = [
            {"name": each.effect.name, **record_of(each.effect, output), "parameters": each.values}
            for each in model.effects
        ]
    if model.verdict:
        content["verdict"] = model.verdict
    if content and model.file:
        content["file"] = Path(os.path.relpath(model.file, output)).as_posix()
    carried = what_luts_carry(model)
    return content | ({"carries": carried} if carried else {})


def same_model(model: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two descriptions describe the same display. Paths, conditions, verdict and ``carries`` are ignored."""
    one, another = (
        {key: value for key, value in each.items() if key not in {"conditions", "carries", "verdict"}}
        for each in (model, json.loads(json.dumps(other)))
    )
    return without_paths(one) == without_paths(another)


def without_paths(model: Mapping[str, Any]) -> dict[str, Any]:
    """Return a description without the paths of its files, since a moved folder holds the same build."""
    display, effects = model["display"], model.get("effects", [])
    content = {key: value for key, value in model.items() if key not in {"display", "file", "effects"}}
    content["display"] = {**display, "path": None}
    content["effects"] = [{**each, "origin": Path(str(each.get("origin"))).name} for each in effects]
    return content


def _check_law(name: str, table: tuple[tuple[float, float], ...], where: str) -> None:
    if name in LAWS and table != luminance_law(name).table:
        raise LutgenError(f"{where}: the luminance law {name!r} has another table. Build again.")


def model_from_json(content: Mapping[str, Any], *, where: str) -> DisplayModel:
    """Rebuild the model of a manifest. ``where`` is its path. Raises LutgenError when the description is not valid."""
    try:
        display, law = content["display"], content["luminance"]
        _check_kind(display, "path", str | None)
        _check_kind({"file": "", **content}, "file", str)
        hours = np.array(display["hours"], dtype=np.float64)
        tips = np.array(display["xyY"], dtype=np.float64)
        measurements = Measurements(
            hours=np.repeat(hours, 4),
            drive=np.tile(TIP_DRIVES, (hours.size, 1)),
            xyz_cd_m2=xyY_to_xyz(tips).reshape(-1, 3),
            lines=np.arange(hours.size * 4, dtype=np.float64),
            metadata=display["metadata"],
            calibrations={float(hour): np.array(curves) for hour, curves in display.get("calibrations", [])},
            file=display["file"],
            sha256=display["sha256"],
        )
        table = tuple((float(hour), float(factor)) for hour, factor in law["table"])
        _check_law(law["law"], table, where)
        return DisplayModel(
            measurements,
            reference=content["reference"],
            selection=content["selection"],
            luminance=law_of_table(law["law"], table, where=where) if table else luminance_law("measured"),
            **_refinements_from_json(content, Path(where).parent),
        )
    except LutgenError:
        raise
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise LutgenError(f"{where}: the model in the manifest is not complete ({error!r}). Build again.") from None


def _refinements_from_json(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    latent, native = content.get("latent"), content.get("native", {})
    own = StoredModel(b64decode(native["own"], validate=True)) if "own" in native else None
    return {
        "baseline": content.get("baseline", "colour-points"),
        "held": content.get("held", False),
        "native": NativeDisplay.from_record(native, own) if "native" in content else None,
        "conditions": conditions_of(content.get("conditions", {})),
        "latent": LatentTips(latent["hours"], latent["xyz_cd_m2"]) if latent else None,
        "effects": tuple(
            AppliedEffect.of(found_by(each["name"], each, folder), each["parameters"])
            for each in content.get("effects", [])
        ),
        "verdict": content.get("verdict", ""),
    }


def read_manifest(path: Path) -> Manifest | None:
    """Read a manifest or a journal; None when it does not exist. Raises LutgenError when it is not valid."""
    advice = "Was it edited? Build into another folder."
    if path.is_fifo():  # opening a pipe would wait for a writer
        raise LutgenError(f"{path}: is no file. Build into another folder.")
    try:
        content = from_json(bytes_at_most(path, MAX_BYTES, none="manifest", advice=advice))
    except FileNotFoundError:
        return None
    except LutgenError:  # LutgenError is a ValueError, which a later clause would catch
        raise
    except OSError as error:
        raise LutgenError(f"{path}: cannot be read: {reason_of(error)}.") from None
    except ValueError as error:
        raise LutgenError(f"{path}: cannot be read as a lutgen manifest ({error}). {advice}") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        message = f"{path}: not a manifest of this version of lutgen (schema {SCHEMA}). Build into another folder."
        raise LutgenError(message)
    try:
        files = tuple(map(_file_record, content.pop("files")))
    except (KeyError, TypeError) as error:
        raise LutgenError(f"{path}: the list of files is damaged ({error}). Build into another folder.") from None
    for record in files:
        inside = Path(record.path)
        if inside.is_absolute() or ".." in inside.parts:
            raise LutgenError(f"{path}: lists a file outside its folder ({record.path!r}). Was it edited?")
    return Manifest(content, files)


def _file_record(content: dict[str, Any]) -> FileRecord:
    for key, kind in (("path", str), ("sha256", str), ("mode", str | None), ("hours", int | float | None)):
        _check_kind(content, key, kind)
    return FileRecord(**content)


def _check_kind(content: Mapping[str, Any], key: str, kind: Any) -> None:
    if not isinstance(content[key], kind):
        raise TypeError(f"{key} is {content[key]!r}")
