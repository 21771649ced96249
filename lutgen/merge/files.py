"""The LUT files of a merged config: those that the user's config names are found as OpenColorIO does, and copied."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any, Self

from lutgen.bindings import leads_out, search_path, sources
from lutgen.errors import LutgenError, reason_of
from lutgen.files import PARTIAL


def located(config: Any, folder: Path, source: str) -> Path | None:
    """Return the file that a relative source names, searched along the search path; None where there is none."""
    for entry in [*search_path(config), ""]:
        path = folder / entry / source
        if path.is_file():
            return path
    return None


def copy_files(config: Any, folder: Path, output: Path) -> list[str]:
    """Copy the files that a config names from ``folder`` to ``output``; return a remark on each that was not."""
    remarks = []
    for source in sources(config):
        if Path(source).is_absolute():
            continue
        if "$" in source or "%" in source:
            remarks.append(f"{source} is chosen by a context variable, and was not copied: copy its files along")
            continue
        path = located(config, folder, source)
        if path is None:
            remarks.append(f"{source} is missing in the config that was merged into")
            continue
        below = os.path.relpath(path, folder)
        if not below.startswith(os.pardir):
            (output / below).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, output / below)
    return remarks


def moved_search_path(config: Any, folder: Path, output: Path) -> None:
    """Rewrite a config's search path for ``output``: relative entries outside ``folder`` keep their folders."""
    entries = search_path(config)
    moved = [
        entry
        if "$" in entry or Path(entry).is_absolute() or not leads_out(entry)
        else os.path.relpath((folder / entry).resolve(), output.resolve())
        for entry in entries
    ]
    if folder_of_luts(config) == "." and "." not in moved:
        moved.append(".")
    config.clearSearchPaths()
    for entry in moved:
        config.addSearchPath(entry)


def folder_of_luts(config: Any) -> str:
    """Return the folder for new LUT files: the first of the search path that lies below the config."""
    for entry in search_path(config):
        if "$" not in entry and not Path(entry).is_absolute() and not leads_out(entry):
            return str(Path(entry))
    # No folder below the config is searched: `moved_search_path` adds the config's own.
    return "."


class NewFolder:
    """A temporary folder beside ``place``: :meth:`finish` moves it into place, and it is removed without that."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self.path = place.absolute().with_name(f".{place.name}{PARTIAL}")

    def __enter__(self) -> Self:
        """Create the temporary folder."""
        try:
            shutil.rmtree(self.path, ignore_errors=True)
            self.path.mkdir(parents=True)
        except OSError as error:
            raise _unwritable(self.place, error) from None
        return self

    def finish(self) -> None:
        """Move the folder into place; where a folder is there already, move the files one by one into it."""
        try:
            if not self.place.exists():
                self.path.rename(self.place)
                return
            for file in sorted(each for each in self.path.rglob("*") if each.is_file()):
                to = self.place / file.relative_to(self.path)
                to.parent.mkdir(parents=True, exist_ok=True)
                file.replace(to)
        except OSError as error:
            raise _unwritable(self.place, error) from None

    def __exit__(self, *_: object) -> None:
        """Remove the temporary folder."""
        shutil.rmtree(self.path, ignore_errors=True)


def _unwritable(place: Path, error: OSError) -> LutgenError:
    reason = reason_of(error)
    return LutgenError(f"{place}: cannot write: {reason}. Make room, or choose another place to write to.")
