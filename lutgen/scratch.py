"""Temporary folders, which a run that was killed leaves and the next run clears."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from collections.abc import Iterator

PREFIX = "lutgen-"

#: An unlocked folder that is older than this, in seconds, belongs to a killed run: a new one is locked within a few
#: milliseconds.
GRACE = 60.0


@contextmanager
def scratch() -> Iterator[Path]:
    """Give a new private folder, which is removed at the end of the block.

    The folder is locked while the process runs, however that ends; the first use in a process removes folders of this
    user that no process holds any more.
    """
    _clear(tempfile.gettempdir())
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name:
        held = _held(Path(name))
        try:
            yield Path(name)
        finally:
            if held is not None:
                os.close(held)


@cache
def _clear(place: str) -> None:
    """Remove the folders that killed runs left; done once in each process."""
    if fcntl is None:
        return
    for folder in Path(place).glob(f"{PREFIX}*"):
        with suppress(OSError):  # somebody else clears it too
            found = folder.lstat()
            ours = found.st_uid == os.getuid() and not folder.is_symlink() and folder.is_dir()
            if ours and time.time() - found.st_mtime > GRACE and (held := _held(folder)) is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(held)


def _held(folder: Path) -> int | None:
    """Lock a folder; None where another process holds it, or where that cannot be done."""
    if fcntl is None:
        return None
    opened = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(opened)
        return None
    return opened
