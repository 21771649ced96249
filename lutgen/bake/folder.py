"""The output folder: which files in it lutgen wrote, which may be replaced, and which a killed build left.

A lock allows one build at a time. If a build fails, a folder that it had to create is removed.
"""

from __future__ import annotations

import json
import os
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.bake.manifest import JOURNAL, MANIFEST, Manifest, Recipe, planned, read_manifest, without_ways
from lutgen.errors import LutgenError, reason_of
from lutgen.files import PARTIAL, cannot_write, file_sha256, is_file, locked, write_atomically

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path


@dataclass(frozen=True)
class Folder:
    """An output folder that has passed the checks of :func:`claim`.

    ``unfinished`` says how many of an interrupted build's files were missing; None when it was not interrupted.
    ``fresh``: nothing of lutgen's was there before.
    """

    path: Path
    stale: tuple[Path, ...]
    unfinished: tuple[int, int] | None
    fresh: bool

    def begin(self, recipe: Recipe, paths: list[str]) -> None:
        """Write the journal of the files to be made, and remove the partial files of a killed build."""
        write_atomically(self.path / JOURNAL, Manifest(recipe.as_json(), planned(paths)).as_bytes())
        for partial in self.path.rglob(f".*{PARTIAL}"):
            partial.unlink()

    def abandon(self, paths: list[str]) -> None:
        """Remove the files that a failed build wrote into a fresh folder; other folders are left for the next build."""
        if not self.fresh:
            return
        for path in (*(self.path / path for path in paths), self.path / JOURNAL):
            with suppress(OSError):  # a file that cannot be removed stays
                path.unlink(missing_ok=True)
                if path.parent.is_dir():
                    _remove_empty(path.parent, self.path)

    def finish(self, manifest: Manifest) -> None:
        """Write the manifest, then remove the files of the previous build that this build does not make."""
        write_atomically(self.path / MANIFEST, manifest.as_bytes())
        kept = {self.path / record.path for record in manifest.files}
        for path in self.stale:
            if path not in kept:
                path.unlink(missing_ok=True)
                _remove_empty(path.parent, self.path)
        (self.path / JOURNAL).unlink(missing_ok=True)


def claim(path: Path, recipe: Recipe, paths: list[str], *, force: bool) -> Folder:
    """Check, before anything is written, that a build may go into ``path``.

    Raises LutgenError: unreadable, someone else's files, files of ours that were altered, or another build of ours
    without ``force``.
    """
    try:
        return _claimed(path, recipe, paths, force=force)
    except OSError as error:
        where = error.filename or path
        raise LutgenError(f"{where}: cannot be read: {reason_of(error)}. Choose another folder with -o.") from None


def _claimed(path: Path, recipe: Recipe, paths: list[str], *, force: bool) -> Folder:
    manifest, journal = read_manifest(path / MANIFEST), read_manifest(path / JOURNAL)
    # A link to a folder counts as a user's file: lutgen made nothing behind it.
    present = {file for file in path.rglob("*") if file.is_symlink() or not file.is_dir()}
    ours = {path / record.path for build in (manifest, journal) if build for record in build.files}
    housekeeping = {path / MANIFEST, path / JOURNAL}
    foreign = {file for file in present - ours - housekeeping if not file.name.endswith(PARTIAL)}
    places = {path / planned_path for planned_path in paths}
    on_the_way = {folder for place in places for folder in place.parents if path in folder.parents}
    collisions = foreign & (places | on_the_way) | {place for place in places if place.is_dir()}
    if collisions or (foreign and not (manifest or journal)):
        name = min(collisions or foreign)
        raise LutgenError(
            f"{path}: holds files that lutgen did not write, such as {name.name}. They are left alone; choose an empty "
            f"or new folder with -o."
        )
    if not force:
        _refuse_other_build(path, manifest, journal, recipe)
    missing = sum(not (path / record.path).exists() for record in journal.files) if journal else 0
    unfinished = (missing, len(journal.files)) if journal else None
    return Folder(path, tuple(sorted(ours & present)), unfinished, fresh=not (manifest or journal))


def _refuse_other_build(path: Path, manifest: Manifest | None, journal: Manifest | None, recipe: Recipe) -> None:
    for build in (journal, manifest):
        if build and _wherever(build.recipe) != _wherever(json.loads(json.dumps(recipe.as_json()))):
            raise LutgenError(
                f"{path}: holds a build from other measurements, options or another version. Add --force to replace "
                f"what lutgen wrote there, or choose another folder with -o."
            )
    if manifest and not journal:
        for record in manifest.files:
            file = path / record.path
            if file.exists() and file_sha256(file) != record.sha256:
                raise LutgenError(
                    f"{file}: was altered since lutgen wrote it. Add --force to replace it, or choose another folder "
                    f"with -o."
                )


def _wherever(recipe: Mapping[str, Any]) -> Mapping[str, Any]:
    """A recipe without the paths of the files that it names: a folder that was moved holds the same build."""
    model = recipe.get("model")
    try:
        return {**recipe, "model": without_ways(model)}  # type: ignore[arg-type]
    except (KeyError, TypeError, AttributeError):
        return recipe


def _remove_empty(folder: Path, root: Path) -> None:
    while folder != root and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


#: Seconds to wait for another build: the workers of a killed build end within this time.
PATIENCE = 5.0


@contextmanager
def locked_folder(path: Path) -> Iterator[None]:
    """Make the folder ``path`` and lock it for one build; after an error, empty folders that it made are removed.

    Raises LutgenError: not a folder, one that cannot be made, or another build writes into it.
    """
    missing = _missing(path)
    try:
        _make(missing)
        held = _held(path)
        try:
            yield
        finally:
            if held is not None:
                os.close(held)
    except BaseException:
        for folder in missing:
            with suppress(OSError):  # the folder is not empty, or was never made
                folder.rmdir()
        raise


def _missing(path: Path) -> list[Path]:
    """Return ``path`` and the folders above it that do not exist, the innermost first."""
    missing: list[Path] = []
    for place in (path, *path.parents):
        if os.path.lexists(place):
            if not place.is_dir():
                # A link may lead to nothing, or to itself.
                obstacle = "a file" if is_file(place) or not place.is_symlink() else "a link that leads to no folder"
                raise LutgenError(f"{place}: is {obstacle}, and the output is a folder. Choose another with -o.")
            break
        missing.append(place)
    return missing


def _make(missing: list[Path]) -> None:
    for folder in reversed(missing):
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error) from None


def _held(path: Path) -> int | None:
    """Lock a folder as :func:`locked`, and wait some seconds for another build."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return locked(path)
        except BlockingIOError:
            if time.monotonic() > end:
                message = f"{path}: another build writes into it. Wait for its end, or choose another folder with -o."
                raise LutgenError(message) from None
            time.sleep(0.05)
