"""``lutgen merge``: adds aged displays to a user's own OpenColorIO config. Other parts of the config do not change.

An aged view sends the display's code values through the LUT of the aged display. The *source space* is the user's
colour space of these code values. A config with the role ``aces_interchange`` needs no source space, since the sRGB
signal can be defined through ACES2065-1 (:mod:`lutgen.merge.additions`).

OpenColorIO's own ``ConfigMerger`` (2.5) is not used. It joins two whole configs, and would add the build's displays,
roles and colour spaces. New parts are inserted into the config's text, which preserves its comments and digits
(:mod:`lutgen.merge.additions`). If that fails, OpenColorIO writes the whole config, and comments and digits are lost.

Functions that lint also needs are in ``lutgen.bindings``.
"""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen import bindings
from lutgen.bake.config import CONFIG
from lutgen.bake.manifest import MANIFEST, FileRecord, read_manifest
from lutgen.callable_package import make_callable
from lutgen.display import hour_name
from lutgen.errors import LutgenError, in_one_line, refuse_unknown
from lutgen.files import PARTIAL, cannot_write
from lutgen.merge.additions import AgedNames, add_aged, add_source_signal, check_source, inserted, with_search_path
from lutgen.merge.proof import ROUNDING, aged_difference, compare_parts, missing_parts

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

#: The name of the folder of the LUTs beside the merged config.
LUTS = "lutgen-aged"


@dataclass(frozen=True)
class Merging:
    """The displays to add to a config, and the names of the new parts."""

    #: Modes and hours of the aged displays. The build must have a LUT for each.
    displays: Sequence[tuple[str, float]]
    #: The prefix of all new names. It has no comma, since OpenColorIO separates active views by commas.
    prefix: str = "Aged"
    #: The user's colour space of the code values that are sent to the display; None to use ``aces_interchange``.
    source_space: str | None = None
    #: The user's displays that get the views; empty for all displays with sRGB in their name.
    onto: Sequence[str] = ()


@dataclass(frozen=True)
class Merged:
    """The result of a merge."""

    config: Path
    #: Display and name of each new view.
    views: tuple[tuple[str, str], ...]
    #: The colour space of the code values that the new views use.
    source_space: str
    #: Number of parts of the user's config that were compared before and after the merge.
    compared: int
    #: Largest difference of an aged view from the build's own view, in code values.
    difference: float
    #: Remarks for the user on the merged config.
    remarks: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON data; see ``schema/merge.json``."""
        return {
            "schema": 1,
            "config": str(self.config),
            "views": [{"display": display, "view": view} for display, view in self.views],
            "source_space": self.source_space,
            "parts_unchanged": self.compared,
            "largest_difference": self.difference,
            "remarks": list(self.remarks),
        }


def merge(build: str | Path, into: str | Path, output: str | Path, wanted: Merging, *, force: bool = False) -> Merged:
    """Write a folder with the user's config and its new aged views, its LUT files and the LUTs of the aged displays.

    Raises
    ------
    LutgenError
        The build or the config does not exist, a wanted display is missing, a name is in use, the code values of the
        display are not defined, the folder exists without ``force``, or the merged config fails the proof.

    """
    lib = bindings.ocio()
    build, into, output = Path(build), Path(into), Path(output)
    prefix = wanted.prefix
    if not prefix or prefix != prefix.strip() or "," in prefix or not prefix.isprintable():
        advice = "give a word that new names begin with, without commas and blanks around it"
        raise LutgenError(f"--prefix {prefix!r}: {advice}.")
    if output.exists() and not (force and output.is_dir()):
        raise LutgenError(f"{output}: exists already. Add --force to replace its files, or choose another folder.")
    luts = {which: _lut(build, *which) for which in wanted.displays}
    with bindings.warnings_logged(lib), _new_folder(output) as partial:
        before = _load(lib, into)
        plan = _plan_of(lib, into, wanted, luts)
        remarks = [*plan.remarks, *copy_files(before, into.parent, partial)]
        for which, lut in luts.items():
            to = partial / folder_of_luts(before) / _place(which, lut)
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(build / lut.path, to)
        merged, compared, change = _write(plan, before, into, output, partial)
        difference = max(
            aged_difference(build / which[0] / hour_name(which[1]), merged, plan.source, display, names.view)
            for which, names in plan.names.items()
            for display in plan.onto
        )
    if change is not None:
        digits = f"; its digits change pixels by up to {change:.1g}" if change else ""
        remarks.append(f"the config is as OpenColorIO writes it, without comments{digits}: keep the original beside it")
    return Merged(
        config=output / CONFIG,
        views=tuple((display, names.view) for names in plan.names.values() for display in plan.onto),
        source_space=plan.source,
        compared=compared,
        difference=difference,
        remarks=tuple(remarks),
    )


@dataclass(frozen=True)
class _Plan:
    """OpenColorIO's object of the config with all new parts, and the names of the new parts."""

    config: Any
    names: Mapping[tuple[str, float], AgedNames]
    source: str
    onto: Sequence[str]
    remarks: Sequence[str]


def _plan_of(lib: Any, into: Path, wanted: Merging, luts: Mapping[tuple[str, float], FileRecord]) -> _Plan:
    config = _load(lib, into)
    onto = _displays(config, wanted.onto)
    source = f"{wanted.prefix} source signal" if wanted.source_space is None else wanted.source_space
    names = {which: AgedNames.of(wanted.prefix, *which) for which in luts}
    try:
        if wanted.source_space is None:
            add_source_signal(config, source)
        check_source(config, source)
        for which, lut in luts.items():
            add_aged(config, names[which], source=source, onto=onto, lut=_place(which, lut).as_posix())
    except bindings.ocio_errors() as error:
        # Newer versions of OpenColorIO have more kinds of names that may be in use: roles, aliases, shared views.
        raise LutgenError(f"{into}: {in_one_line(error)} Choose another --prefix.") from None
    without = "a config of version 1 has no named transforms: views, looks and colour spaces alone were added"
    return _Plan(config, names, source, onto, [without] if config.getMajorVersion() < 2 else [])


def _place(which: tuple[str, float], lut: FileRecord) -> Path:
    """Return the path of a display's LUT, relative to a folder of the search path."""
    return Path(LUTS, which[0], hour_name(which[1]), Path(lut.path).name)


def _write(plan: _Plan, before: Any, into: Path, output: Path, folder: Path) -> tuple[Any, int, float | None]:
    """Write the merged config into ``folder`` and prove it: with its own text, else as OpenColorIO writes it.

    Return the loaded config, the number of compared parts, and their largest difference; None for its own text.
    """
    lib = bindings.ocio()
    moved_search_path(plan.config, into.parent, output)
    try:
        plan.config.validate()
        serialised = str(plan.config.serialize())
    except bindings.ocio_errors() as error:
        raise LutgenError(f"{into}: OpenColorIO {lib.__version__} does not write it: {in_one_line(error)}") from None
    own = into.read_bytes().decode("utf-8", errors="surrogateescape")
    ends = "\r\n" if "\r\n" in own else "\n"
    added = [plan.source, *(name for names in plan.names.values() for name in names)]
    known = {name for name in added if before.getColorSpace(name) is not None}
    views = [(display, names) for names in plan.names.values() for display in plan.onto]
    text = inserted(own.replace("\r\n", "\n"), serialised, [name for name in added if name not in known], views)
    if text is not None and bindings.search_path(before) != bindings.search_path(plan.config):
        text = None if bindings.search_path(before) else with_search_path(text)
    for attempt, exact in ((text, True), (serialised, False)):
        if attempt is None:
            continue
        (folder / CONFIG).write_text(attempt, encoding="utf-8", errors="surrogateescape", newline=ends)
        try:
            merged = _load(lib, folder / CONFIG)
        except LutgenError:
            if exact:
                continue
            raise
        if exact and missing_parts(plan.config, merged):
            continue
        proof = compare_parts(before, merged)
        if not proof.changed:
            return merged, proof.compared, None if exact else 0.0
        if not exact and proof.largest <= ROUNDING:
            return merged, proof.compared, proof.largest
    raise LutgenError(f"{into}: merging would change {', '.join(proof.changed[:3])}. Nothing was written.")


def _lut(build: Path, mode: str, hours: float) -> FileRecord:
    """Return the LUT of a display in a build, an unclipped LUT if one exists."""
    manifest = read_manifest(build / MANIFEST)
    if manifest is None:
        raise LutgenError(f"{build}: has no {MANIFEST}, so it is no folder that `lutgen build` made.")
    luts = sorted((each for each in manifest.files if each.kind == "lut"), key=lambda lut: bool(lut.clipped))
    for lut in luts:
        if (lut.mode, lut.hours) == (mode, hours):
            return lut
    of_the_mode = [each for each in luts if each.mode == mode] or luts
    available = dict.fromkeys(f"{each.mode} at {hour_name(each.hours or 0.0)}" for each in of_the_mode)
    raise LutgenError(
        f"{build}: has no LUT for {mode} at {hour_name(hours)}. It has {', '.join(available) or 'none'}: choose one "
        "with --mode and --hours, or build that display too."
    )


def _load(lib: Any, path: Path) -> Any:
    lib.ClearAllCaches()
    if path.is_dir():
        raise LutgenError(f"{path}: is a folder. Give the OpenColorIO config itself, such as {path / 'config.ocio'}.")
    if not path.is_file():
        raise LutgenError(f"{path}: there is no such file. Give an OpenColorIO config (config.ocio).")
    bindings.refuse_unlikely(path)
    try:
        config = lib.Config.CreateFromFile(bindings.named_for_ocio(path))
        config.validate()
    except bindings.ocio_errors() as error:
        raise LutgenError(f"{path}: OpenColorIO {lib.__version__} does not load it: {in_one_line(error)}") from None
    if not bindings.is_utf8(config):
        raise LutgenError(f"{path}: has names or texts that are not UTF-8. Save it as UTF-8, then merge again.")
    if endless := bindings.endless_file(config):
        why = "opens its metadata and never closes them. Correct or remove that file first"
        raise LutgenError(f"{path}: names {endless}, which {why}.")
    return config


def _displays(config: Any, wanted: Sequence[str]) -> list[str]:
    displays = list(config.getDisplaysAll())
    for name in wanted:
        refuse_unknown("display", name, displays)
    chosen = list(wanted) or [name for name in displays if "srgb" in name.lower()]
    if not chosen:
        raise LutgenError(
            "no display of this config has sRGB in its name. Say which one shows sRGB code values with --onto DISPLAY, "
            f"one of: {', '.join(displays)}."
        )
    return chosen


def copy_files(config: Any, folder: Path, output: Path) -> list[str]:
    """Copy the files of a config from ``folder`` to ``output``. Return a remark for each file that was not copied."""
    remarks = []
    for source in bindings.sources(config):
        if Path(source).is_absolute():
            continue
        if "$" in source or "%" in source:
            remarks.append(f"{source} is chosen by a context variable, and was not copied: copy its files yourself")
            continue
        places = (folder / entry / source for entry in [*bindings.search_path(config), ""])
        path = next((place for place in places if place.is_file()), None)
        if path is None:
            remarks.append(f"{source} was not copied: your config names it, and there is no such file")
            continue
        below = os.path.relpath(path, folder)
        if not bindings.leads_out(below):
            (output / below).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, output / below)
    return remarks


def moved_search_path(config: Any, folder: Path, output: Path) -> None:
    """Rewrite a config's search path for ``output``. Relative entries outside ``folder`` keep their targets."""
    entries = bindings.search_path(config)
    moved = [
        entry
        if "$" in entry or Path(entry).is_absolute() or not bindings.leads_out(entry)
        else os.path.relpath((folder / entry).resolve(), output.resolve())
        for entry in entries
    ]
    if folder_of_luts(config) == "." and "." not in moved:
        moved.append(".")
    config.clearSearchPaths()
    for entry in moved:
        config.addSearchPath(entry)


def folder_of_luts(config: Any) -> str:
    """Return the folder for new LUT files: the first folder of the search path that lies below the config, or "."."""
    for entry in bindings.search_path(config):
        if "$" not in entry and not Path(entry).is_absolute() and not bindings.leads_out(entry):
            return str(Path(entry))
    return "."  # which `moved_search_path` adds to the search path


@contextmanager
def _new_folder(place: Path) -> Iterator[Path]:
    """Yield a folder beside ``place``. At the end move it there, or its files one by one into an existing ``place``."""
    folder = place.absolute().with_name(f".{place.name}{PARTIAL}")
    try:
        with _writing(place):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
        yield folder
        with _writing(place):
            if not place.exists():
                folder.rename(place)
                return
            for file in sorted(each for each in folder.rglob("*") if each.is_file()):
                to = place / file.relative_to(folder)
                to.parent.mkdir(parents=True, exist_ok=True)
                file.replace(to)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _writing(place: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise cannot_write(place, error) from None


make_callable(__name__, merge)
