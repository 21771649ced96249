"""The output folder: which of its files lutgen wrote, which files may be replaced, and which a killed build left.

A lock allows one build at a time. A failed build removes the folders that it created.
"""

import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lutgen.bake.manifest import JOURNAL, MANIFEST, FileRecord, Manifest, read_manifest, without_paths
from lutgen.errors import LutgenError, reason_of
from lutgen.files import PARTIAL, cannot_write, file_sha256, is_file, locked, write_atomically


@dataclass(frozen=True)
class Folder:
    """An output folder that has passed the checks of :func:`claim`.

    ``stale`` are the existing files of previous builds. ``unfinished`` are the numbers of missing files and of all
    files of an interrupted build; None without an interrupted build. ``fresh``: the folder held no build before.
    """

    path: Path
    stale: tuple[Path, ...]
    unfinished: tuple[int, int] | None
    fresh: bool

    def begin(self, recipe: Mapping[str, Any], paths: list[str]) -> None:
        """Write the journal with the planned files, and remove the partial files of a killed build."""
        # Only the paths of these records have a meaning.
        planned = tuple(FileRecord(path, "planned", None, None, "", 0) for path in paths)
        write_atomically(self.path / JOURNAL, Manifest(recipe, planned).as_bytes())
        for partial in self.path.rglob(f".*{PARTIAL}"):
            partial.unlink()

    def abandon(self, paths: list[str]) -> None:
        """Remove the files that a failed build wrote into a fresh folder. In other folders the next build continues."""
        if not self.fresh:
            return
        for path in (*(self.path / path for path in paths), self.path / JOURNAL):
            with suppress(OSError):  # the file cannot be removed
                path.unlink(missing_ok=True)
                if path.parent.is_dir():
                    _remove_empty(path.parent, self.path)

    def finish(self, manifest: Manifest) -> None:
        """Write the manifest, then remove the files of the previous build that this build does not contain."""
        write_atomically(self.path / MANIFEST, manifest.as_bytes())
        kept = {self.path / record.path for record in manifest.files}
        for path in self.stale:
            if path not in kept:
                path.unlink(missing_ok=True)
                _remove_empty(path.parent, self.path)
        (self.path / JOURNAL).unlink(missing_ok=True)


def is_unfinished(path: Path) -> bool:
    """Whether a folder holds an unfinished build, which the next build with the same options continues."""
    return (path / JOURNAL).exists()


def claim(path: Path, recipe: Mapping[str, Any], paths: list[str], *, force: bool) -> Folder:
    """Check, before any file is written, that a build may use the folder ``path``.

    Raises LutgenError: the folder is unreadable or holds foreign files. Without ``force`` also: the folder holds
    another build, or altered files of a build.
    """
    try:
        return _checked_folder(path, recipe, paths, force=force)
    except OSError as error:
        where = error.filename or path
        raise LutgenError(f"{where}: cannot be read: {reason_of(error)}. Choose another folder with -o.") from None


def _checked_folder(path: Path, recipe: Mapping[str, Any], paths: list[str], *, force: bool) -> Folder:
    manifest, journal = read_manifest(path / MANIFEST), read_manifest(path / JOURNAL)
    # A link to a folder counts as a user's file, since lutgen never writes through links.
    present = {file for file in path.rglob("*") if file.is_symlink() or not file.is_dir()}
    ours = {path / record.path for build in (manifest, journal) if build for record in build.files}
    housekeeping = {path / MANIFEST, path / JOURNAL}
    foreign = {file for file in present - ours - housekeeping if not file.name.endswith(PARTIAL)}
    places = {path / planned_path for planned_path in paths}
    parents = {folder for place in places for folder in place.parents if path in folder.parents}
    collisions = foreign & (places | parents) | {place for place in places if place.is_dir()}
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


def _refuse_other_build(
    path: Path, manifest: Manifest | None, journal: Manifest | None, recipe: Mapping[str, Any]
) -> None:
    for build in (journal, manifest):
        if build and _without_paths(build.recipe) != _without_paths(json.loads(json.dumps(recipe))):
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


def _without_paths(recipe: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a recipe without the paths of its files, since a moved folder holds the same build."""
    model = recipe.get("model")
    try:
        return {**recipe, "model": without_paths(model)}  # type: ignore[arg-type]
    except (KeyError, TypeError, AttributeError):
        return recipe


def _remove_empty(folder: Path, root: Path) -> None:
    while folder != root and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


#: Maximum time to wait for another build, in seconds. The workers of a killed build end within this time.
PATIENCE = 5.0


@contextmanager
def locked_folder(path: Path) -> Iterator[None]:
    """Create the folder ``path`` and lock it for one build. After an error, remove the created folders that are empty.

    Raises LutgenError: the path is no folder or cannot be created, or another build writes into it.
    """
    missing = _missing(path)
    try:
        for folder in reversed(missing):
            try:
                folder.mkdir(exist_ok=True)
            except OSError as error:
                raise cannot_write(folder, error) from None
        lock = _wait_for_lock(path)
        try:
            yield
        finally:
            if lock is not None:
                os.close(lock)
    except BaseException:
        for folder in missing:
            with suppress(OSError):  # the folder is not empty, or was not created
                folder.rmdir()
        raise


def _missing(path: Path) -> list[Path]:
    """Return those of ``path`` and its parent folders that do not exist, the innermost first."""
    missing: list[Path] = []
    for place in (path, *path.parents):
        if os.path.lexists(place):
            if not place.is_dir():
                # The target of a link may be missing, or be the link itself.
                obstacle = "a file" if is_file(place) or not place.is_symlink() else "a link that leads to no folder"
                raise LutgenError(f"{place}: is {obstacle}, and the output is a folder. Choose another with -o.")
            break
        missing.append(place)
    return missing


def _wait_for_lock(path: Path) -> int | None:
    """Lock a folder as :func:`locked` does. Wait up to ``PATIENCE`` for another build."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return locked(path)
        except BlockingIOError:
            if time.monotonic() > end:
                message = f"{path}: another build writes into it. Wait for its end, or choose another folder with -o."
                raise LutgenError(message) from None
            time.sleep(0.05)
