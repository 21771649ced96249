"""What a folder holds against what its manifest lists: files that are missing, altered or not listed."""

from __future__ import annotations

import stat
from typing import TYPE_CHECKING

from lutgen.bake.build import CONFIG, paths_of
from lutgen.bake.formats import format_named, format_names
from lutgen.bake.manifest import sha256
from lutgen.bake.plan import Plan, direction_of
from lutgen.display import MODES
from lutgen.errors import LutgenError, reason_of

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.bake.manifest import FileRecord, Manifest


def unlisted(folder: Path, manifest: Manifest) -> list[tuple[str, str]]:
    """Return each file that ``manifest`` does not list and should, as its path in ``folder`` and what is wrong.

    Raises
    ------
    LutgenError
        The manifest's options are not those of a build.

    """
    asked, listed = set(_asked(manifest)), {record.path for record in manifest.files}
    names = {format_named(name).file_in(direction_of(manifest)) for name in format_names()} | {CONFIG}
    there = {
        path.relative_to(folder).as_posix()
        for mode in MODES
        for path in folder.glob(f"{mode}/*h/*")
        if path.name in names
    }
    return [
        (path, "the manifest does not list it, though its options ask for it") for path in sorted(asked - listed)
    ] + [(path, "is not in the manifest, so nothing says what it should be") for path in sorted(there - listed - asked)]


def _asked(manifest: Manifest) -> list[str]:
    try:
        options = manifest.recipe["options"]
        plan = Plan(
            hours=tuple(float(hour) for hour in options["hours"]),
            modes=tuple(options["modes"]),
            formats=tuple(options["formats"]),
            direction=direction_of(manifest),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise LutgenError(f"its options are not complete ({error!r})") from None
    return paths_of(plan)


def altered(path: Path, record: FileRecord) -> tuple[str | None, bool]:
    """Return what became of a file, if anything, and whether there is one to read."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            return "is no file any more", False
        # A file of another size is not even read: it may be huge.
        same = path.stat().st_size == record.bytes and sha256(path.read_bytes()) == record.sha256
    except (FileNotFoundError, NotADirectoryError):
        return "missing", False
    except OSError as error:
        return f"cannot be read: {reason_of(error)}", False
    return None if same else "altered: its bytes are not those that lutgen wrote", True
