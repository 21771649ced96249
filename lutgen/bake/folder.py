"""The output folder: what in it is lutgen's, what may be written, and what a killed build left."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.bake.manifest import JOURNAL, MANIFEST, Manifest, Recipe, planned, read_manifest, without_ways
from lutgen.errors import LutgenError
from lutgen.files import PARTIAL, file_sha256, write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


@dataclass(frozen=True)
class Folder:
    """An output folder that was found fit to build into.

    ``unfinished`` says how many of an interrupted build's files were missing; None when it was not interrupted.
    """

    path: Path
    stale: tuple[Path, ...]
    unfinished: tuple[int, int] | None

    def begin(self, recipe: Recipe, paths: list[str]) -> None:
        """Note what is about to be made, and clear what a killed build half wrote."""
        existed = self.path.exists()
        try:
            write_atomically(self.path / JOURNAL, Manifest(recipe.as_json(), planned(paths)).as_bytes())
        except LutgenError:
            if not existed and self.path.is_dir():
                self.path.rmdir()
            raise
        for partial in self.path.rglob(f".*{PARTIAL}"):
            partial.unlink()

    def finish(self, manifest: Manifest) -> None:
        """Write the manifest, then remove what the last build made and this one does not."""
        write_atomically(self.path / MANIFEST, manifest.as_bytes())
        kept = {self.path / record.path for record in manifest.files}
        for path in self.stale:
            if path not in kept:
                path.unlink(missing_ok=True)
                _remove_empty(path.parent, self.path)
        (self.path / JOURNAL).unlink(missing_ok=True)


def claim(path: Path, recipe: Recipe, paths: list[str], *, force: bool) -> Folder:
    """Check, before anything is written, that a build may go into ``path``.

    Raises
    ------
    LutgenError
        Not a folder, unreadable, someone else's files, files of ours that were altered, or another build of ours
        without ``force``.

    """
    in_the_way = next((place for place in (path, *path.parents) if place.exists()), path)
    if in_the_way.exists() and not in_the_way.is_dir():
        message = f"{in_the_way}: is a file, and the output is a folder. Choose another with -o."
        raise LutgenError(message)
    try:
        manifest, journal = read_manifest(path / MANIFEST), read_manifest(path / JOURNAL)
        present = {file for file in path.rglob("*") if not file.is_dir()} if path.is_dir() else set()
    except PermissionError as error:
        message = f"{path}: cannot be read: {(error.strerror or '').lower()}. Choose another folder with -o."
        raise LutgenError(message) from None
    ours = {path / record.path for build in (manifest, journal) if build for record in build.files}
    housekeeping = {path / MANIFEST, path / JOURNAL}
    foreign = {file for file in present - ours - housekeeping if not file.name.endswith(PARTIAL)}
    collisions = foreign & {path / planned_path for planned_path in paths}
    if collisions or (foreign and not (manifest or journal)):
        name = min(collisions or foreign)
        message = (
            f"{path}: holds files that lutgen did not write, such as {name.name}. They are left alone; choose an empty "
            f"or new folder with -o."
        )
        raise LutgenError(message)
    if not force:
        _refuse_other_build(path, manifest, journal, recipe)
    missing = sum(not (path / record.path).exists() for record in journal.files) if journal else 0
    unfinished = (missing, len(journal.files)) if journal else None
    return Folder(path, tuple(sorted(ours & present)), unfinished)


def _refuse_other_build(path: Path, manifest: Manifest | None, journal: Manifest | None, recipe: Recipe) -> None:
    for build in (journal, manifest):
        if build and _wherever(build.recipe) != _wherever(json.loads(json.dumps(recipe.as_json()))):
            message = (
                f"{path}: holds a build from other measurements, options or another version. Add --force to replace "
                f"what lutgen wrote there, or choose another folder with -o."
            )
            raise LutgenError(message)
    if manifest and not journal:
        for record in manifest.files:
            file = path / record.path
            if file.exists() and file_sha256(file) != record.sha256:
                message = (
                    f"{file}: was altered since lutgen wrote it. Add --force to replace it, or choose another folder "
                    f"with -o."
                )
                raise LutgenError(message)


def _wherever(recipe: Mapping[str, Any]) -> Mapping[str, Any]:
    """A recipe as read, without the ways to the files it names: a folder that was moved holds the same build."""
    model = recipe.get("model")
    try:
        return {**recipe, "model": without_ways(model)}  # type: ignore[arg-type]
    except (KeyError, TypeError, AttributeError):
        return recipe


def _remove_empty(folder: Path, root: Path) -> None:
    while folder != root and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent
