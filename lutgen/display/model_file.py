"""Model files (TOML): a display's model, written by ``lutgen refine`` or by hand.

A file written by hand needs only ``schema = 1``; ``[display]`` and ``[model]`` are optional. A refined model also holds
the figures of its fit (``[fit]``), the first session's own curves and black (``[native]``) for native baselines, the
tips before the effects (``[tips]``), the effects in chain order with unit and standard error of every parameter, the
covariance of the errors (``[covariance]``), and conditions that differ from the usual values. Written numbers read back
bit by bit.
"""

from __future__ import annotations

import os
import re
from math import isfinite
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.display.conditions import REFERENCE, conditions_of
from lutgen.display.fitted import AppliedEffect, Estimate, FitCovariance, LatentTips, found_by, record_of
from lutgen.display.model import DisplayModel, default_display
from lutgen.display.native import CHANNELS, NativeDisplay
from lutgen.display.own_model.stored import MAX_BYTES as OWN_MAX_BYTES
from lutgen.display.own_model.stored import StoredModel
from lutgen.display.tips import LAWS, UNSTATED, law_of_table, luminance_law
from lutgen.documents import from_toml, toml_text
from lutgen.errors import LutgenError
from lutgen.files import read_at_most, write_atomically
from lutgen.names import FORETELLING_BASELINES
from lutgen.readings import read_measurements
from lutgen.readings.formats import holds_readings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from lutgen.display.tips import LuminanceLaw
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

#: Pattern of keys that need no quotes.
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def value_text(value: Any) -> str:
    """Return a text, a number (also of NumPy), a Boolean, or a list of these as TOML 1.0, with all digits."""
    if isinstance(value, str):
        return toml_text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Integral):
        return repr(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    return f"[{', '.join(map(value_text, value))}]"


def key_text(key: str) -> str:
    """Return a key as TOML."""
    return key if _BARE.fullmatch(key) else value_text(key)


def table_lines(head: str, values: Mapping[str, Any], comments: Mapping[str, str] | None = None) -> list[str]:
    """Return the lines of a table: its head, then each key with its comment.

    A value of None is left out. A list of lists has one line for each row.
    """
    lines = [head] if head else []
    for key, value in values.items():
        if value is None:
            continue
        comment = f"  # {comments[key]}" if comments and key in comments else ""
        if isinstance(value, list) and value and isinstance(value[0], list):
            lines += [f"{key_text(key)} = [{comment}", *(f"  {value_text(row)}," for row in value), "]"]
        else:
            lines.append(f"{key_text(key)} = {value_text(value)}{comment}")
    return lines


def document(parts: Iterable[list[str]]) -> bytes:
    """Join tables with empty lines between them."""
    return ("\n\n".join("\n".join(part) for part in parts if part) + "\n").encode()


SCHEMA = 1

#: Largest size of a model file, far above a model with every effect and many hours of tips; suffix of the file next to
#: the model file that holds the display's own model.
MAX_BYTES, OWN_SUFFIX = 16_000_000, ".npz"

HEAD = "# A lutgen display model: lutgen build --model THIS_FILE bakes it. Made by lutgen refine; edit with care."


def save_model(model: DisplayModel, path: str | Path, *, force: bool = False) -> None:
    """Write ``model`` to a file for :func:`load_model`, with the path and the hash of its readings.

    Raises
    ------
    LutgenError
        The readings have no file, an effect cannot be recorded, ``path`` exists and ``force`` is False, or ``path``
        cannot be written.

    """
    path = Path(path)
    if path.is_dir():
        raise LutgenError(f"{path}: is a folder. Give the name of a .toml file.")
    own = model.native.own if model.native else None
    own_path = path.with_suffix(OWN_SUFFIX)
    for file in (path, *([own_path] if own else [])):
        if file.exists() and not force:
            raise LutgenError(f"{file}: exists already. Add --force to replace it, or choose another name.")
    text = model_text(model, path.parent, own_path.name)
    if own:
        write_atomically(own_path, own.content)
    write_atomically(path, text)


def model_text(model: DisplayModel, folder: Path, own_file: str = "") -> bytes:
    """Return the content of a model file in ``folder``; ``own_file`` is the file of the display's own model, or ""."""
    head = [HEAD, *table_lines("", {"schema": SCHEMA})]
    parts = [head, _display_lines(model.measurements, folder), _model_lines(model)]
    if model.conditions != REFERENCE:
        parts.append(table_lines("[conditions]", model.conditions.stated()))
    if model.verdict or model.fit:
        parts.append(table_lines("[fit]", {"verdict": model.verdict, **model.fit}))
    if model.native is not None:
        notes = {
            "source": "the readings of the first session that the curves were made of",
            "black": "X, Y, Z of code 0 as shares of white's",
            **dict.fromkeys(CHANNELS, "code value, linear light relative to that at code 1"),
            "own": "the display's own model, in the same folder",
        }
        own = model.native.own
        own_entries = {"own": own_file, "own_sha256": own.sha256} if own else {}
        parts.append(table_lines("[native]", model.native.as_record() | own_entries, notes))
    for each in model.effects:
        parts += _effect_lines(each, folder)
    if model.latent is not None:
        tips = {"hours": model.latent.hours.tolist(), "xyz_cd_m2": model.latent.xyz_cd_m2.tolist()}
        notes = {"hours": "of the display before its effects", "xyz_cd_m2": "X, Y, Z of white, red, green, blue; cd/m²"}
        parts.append(table_lines("[tips]", tips, notes))
    if model.covariance is not None:
        notes = {"of": "then the numbers of [tips], in their order", "rows": "lower triangle"}
        parts.append(table_lines("[covariance]", model.covariance.as_record(), notes))
    return document(parts)


def _display_lines(readings: Measurements, folder: Path) -> list[str]:
    if not readings.sha256:
        raise LutgenError(
            "the model's readings come from no file, so a model file cannot name them. Read them from a file."
        )
    built_in = Path(readings.file) == default_display()
    file = None if built_in else Path(os.path.relpath(Path(readings.file).resolve(), folder.resolve())).as_posix()
    notes = {"file": "the readings, as seen from this file", "sha256": "of the readings that the model was made from"}
    return table_lines("[display]", {"file": file, "sha256": readings.sha256}, notes)


def _model_lines(model: DisplayModel) -> list[str]:
    law = model.luminance
    values = {
        "baseline": model.baseline,
        "held": model.held if model.baseline in FORETELLING_BASELINES else None,
        "reference": model.reference,
        "selection": model.selection,
        "luminance": law.name,
        "luminance_table": None if law.name in LAWS else [list(row) for row in law.table],
    }
    notes = {"luminance_table": "hour, white's luminance relative to hour 0"}
    return table_lines("[model]", values, notes)


def _effect_lines(each: AppliedEffect, folder: Path) -> list[list[str]]:
    head = {"name": each.effect.name, **record_of(each.effect, folder)}
    parts = [table_lines("[[effects]]", head)]
    for name, parameter in each.effect.parameters.items():
        estimate = each.estimates[name]
        values = {
            "value": estimate.value,
            "stderr": estimate.stderr,
            "unit": parameter.unit,
            "bounds": [float(bound) for bound in parameter.bounds],
            "free": name in each.free,
            "at_bound": estimate.at_bound,
        }
        parts.append(table_lines(f"[effects.parameters.{name}]", values, {"value": parameter.meaning}))
    return parts


def load_model(path: str | Path, effects: Mapping[str, Effect] | None = None) -> DisplayModel:
    """Load a model file.

    The file has ``schema = 1`` and the tables of :func:`save_model`. Every table is optional; without ``[display]`` the
    model is that of the default display.

    Parameters
    ----------
    path
        The file.
    effects
        Further effects by name; they take precedence over the effects that the file records.

    Raises
    ------
    LutgenError
        The file is unreadable, too large or not TOML; a key or value is invalid; an effect is missing; or the readings
        have changed since the model was made.

    """
    path = Path(path)
    data = read_at_most(path, MAX_BYTES, what="the model", none="model")
    try:
        content, invalid = from_toml(data.decode("utf-8")), ""
    except ValueError as error:
        content, invalid = {}, f"{path}: not a model file (TOML): {error}."
    if "model" not in content and holds_readings(path):
        raise LutgenError(f"{path}: holds measurements, not a saved model. Give it with --display, or as DATA.")
    if invalid:
        raise LutgenError(invalid)
    if content.get("schema") != SCHEMA:
        raise LutgenError(
            f"{path}: schema is {content.get('schema')!r}; this version of lutgen reads `schema = {SCHEMA}`. Was the "
            f"file written by a newer one? Update lutgen."
        )
    try:
        return _model_of(_TomlTable(content, "the file"), path, effects or {})
    except LutgenError as error:
        raise LutgenError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None


def _model_of(content: _TomlTable, path: Path, effects: Mapping[str, Effect]) -> DisplayModel:
    folder = path.parent
    content.allow("schema", "display", "model", "conditions", "fit", "native", "tips", "covariance", "effects")
    model, fit = content.table("model", _MODEL_KEYS), content.table("fit", None)
    conditions, tips = content.table("conditions", None), content.table("tips", ("hours", "xyz_cd_m2"))
    native, errors = content.table("native", _NATIVE_KEYS), content.table("covariance", ("of", "rows"))
    loaded = DisplayModel(
        _readings(content.table("display", ("file", "sha256")), folder),
        reference=model.text("reference", ""),
        selection=model.text("selection", "nearest"),
        luminance=_law(model, folder),
        effects=tuple(_effect(_TomlTable(each, "[[effects]]"), folder, effects) for each in content.tables("effects")),
        latent=LatentTips(tips.numbers("hours"), tips.numbers("xyz_cd_m2")) if tips.values else None,
        covariance=FitCovariance.from_record(errors.values) if errors.values else None,
        baseline=model.text("baseline", "colour-points"),
        held=model.flag("held"),
        native=NativeDisplay.from_record(native.values, _own(native, folder)) if native.values else None,
        conditions=conditions_of({name: conditions.number(name) for name in conditions.values}),
        verdict=fit.text("verdict", ""),
        fit={name: fit.scalar(name) for name in fit.values if name != "verdict"},
        file=str(path),
    )
    if loaded.covariance:
        loaded.covariance.check(loaded.fitted, loaded.fitted_hours)
    return loaded


_MODEL_KEYS = ("baseline", "held", "reference", "selection", "luminance", "luminance_table")
_NATIVE_KEYS = ("source", "black", *CHANNELS, "remarks", "own", "own_sha256")
_PARAMETER_KEYS = ("value", "stderr", "unit", "bounds", "free", "at_bound")


def _readings(display: _TomlTable, folder: Path) -> Measurements:
    file = folder / display.text("file", "") if "file" in display.values else default_display()
    readings, made_from = read_measurements(file), display.text("sha256", "")
    if made_from and readings.sha256 != made_from:
        raise LutgenError(
            f"the readings {file} have changed since the model was made from them (SHA-256 {readings.sha256[:12]}…, "
            f"was {made_from[:12]}…). Restore them, or make the model again: lutgen refine {file}."
        )
    return readings


def _own(native: _TomlTable, folder: Path) -> StoredModel | None:
    """Return the display's own model that the table [native] names, or None."""
    name = native.text("own", "")
    if not name:
        return None
    file = folder / name
    if Path(name).name != name:
        raise LutgenError(f"[native]: own is {name!r}; it must be the name of a file beside the model file.")
    advice = "It belongs in the folder of the model file: put it back, or make the model again with lutgen refine."
    content = read_at_most(file, OWN_MAX_BYTES, what="the display's own model", none="own model", advice=advice)
    try:
        own = StoredModel(content)
    except LutgenError as error:
        raise LutgenError(f"{file}: {error}") from None
    if own.sha256 != native.text("own_sha256", ""):
        raise LutgenError(
            f"the display's own model {file} is not the one that this model file was written with (SHA-256 "
            f"{own.sha256[:12]}…, was {native.text('own_sha256', '')[:12] or 'unknown'}…). Put that back, or make the "
            f"model again with lutgen refine."
        )
    return own


def _law(model: _TomlTable, folder: Path) -> LuminanceLaw:
    if not {"luminance", "luminance_table"} & set(model.values):
        return UNSTATED
    name = model.text("luminance", "table")
    if "luminance_table" in model.values:
        rows = model.numbers("luminance_table")
        if rows.ndim != 2 or rows.shape[1] != 2:
            raise LutgenError("[model] luminance_table holds rows of two numbers, [hour, factor].")
        return law_of_table(name, tuple((hour, factor) for hour, factor in rows.tolist()), where="luminance_table")
    return luminance_law(str(folder / name) if name.endswith(".csv") else name)


def _effect(each: _TomlTable, folder: Path, effects: Mapping[str, Effect]) -> AppliedEffect:
    each.allow("name", "origin", "sha256", "parameters")
    name = each.text("name", "")
    record: dict[str, str] = {key: each.text(key, "") for key in ("origin", "sha256") if key in each.values}
    effect = effects.get(name) or found_by(name, record, folder)
    parameters = each.table("parameters", None)
    estimates, free = {}, []
    for key in parameters.values:
        parameter = parameters.table(key, _PARAMETER_KEYS, f"effect {name!r}: parameter {key!r}")
        _check_unit(parameter, effect, key)
        stderr = parameter.number("stderr") if "stderr" in parameter.values else None
        if stderr is not None and stderr < 0:
            raise LutgenError(f"{parameter.where}: stderr is {stderr:g}; a standard error is never negative.")
        estimates[key] = Estimate(parameter.number("value"), stderr, parameter.flag("at_bound"))
        if parameter.flag("free"):
            free.append(key)
    return AppliedEffect(effect, estimates, tuple(free))


def _check_unit(parameter: _TomlTable, effect: Effect, name: str) -> None:
    """Raise LutgenError for a unit other than the effect's; bounds in a file are informative only."""
    declared = effect.parameters.get(name)
    if declared and parameter.text("unit", declared.unit) != declared.unit:
        raise LutgenError(
            f"{parameter.where}: its unit is {parameter.values['unit']!r}, but the effect takes {declared.unit!r}."
        )
    if "bounds" in parameter.values and parameter.numbers("bounds").shape != (2,):
        raise LutgenError(f"{parameter.where}: bounds are two numbers, the smaller first.")


class _TomlTable:
    """A table of the file; its methods return checked values or raise LutgenError."""

    def __init__(self, values: Any, where: str) -> None:
        if not isinstance(values, dict):
            raise LutgenError(f"{where} is a table, not {values!r}.")
        self.values: dict[str, Any] = values
        self.where = where

    def allow(self, *keys: str) -> None:
        unknown = [key for key in self.values if key not in keys]
        if unknown:
            raise LutgenError(f"unknown key {unknown[0]!r} in {self.where}. Pick one of: {', '.join(keys)}.")

    def table(self, key: str, allowed: tuple[str, ...] | None, where: str = "") -> _TomlTable:
        table = _TomlTable(self.values.get(key, {}), where or f"[{key}]")
        if allowed is not None:
            table.allow(*allowed)
        return table

    def tables(self, key: str) -> list[Any]:
        tables = self.values.get(key, [])
        if not isinstance(tables, list):
            raise LutgenError(f"{key} is a list of tables: write [[{key}]].")
        return tables

    def text(self, key: str, absent: str) -> str:
        value = self.values.get(key, absent)
        if not isinstance(value, str):
            raise self._wrong(key, "a text")
        return value

    def flag(self, key: str) -> bool:
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise self._wrong(key, "true or false")
        return value

    def number(self, key: str) -> float:
        value = self.values.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise self._wrong(key, "a finite number")
        return float(value)

    def scalar(self, key: str) -> str | float:
        value = self.values[key]
        if not isinstance(value, str | int | float):
            raise self._wrong(key, "a text or a number")
        return value

    def numbers(self, key: str) -> np.ndarray:
        try:
            return np.array(self.values.get(key, []), dtype=np.float64)
        except (ValueError, TypeError):
            raise self._wrong(key, "a list of numbers, all rows alike") from None

    def _wrong(self, key: str, allowed: str) -> LutgenError:
        given = f"is {self.values[key]!r}" if key in self.values else "is missing"
        return LutgenError(f"{self.where}: {key} {given}; it must be {allowed}.")
