"""Lock the output folder for one build; create it first, and remove it if the build fails."""

from __future__ import annotations

import os
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.files import cannot_write, is_file

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

#: Seconds to wait for another build: the workers of one that was killed end within them.
PATIENCE = 5.0


@contextmanager
def locked_folder(path: Path) -> Iterator[None]:
    """Make the folder ``path`` and hold it for one build; after an error, folders that it made and are empty go again.

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
            with suppress(OSError):  # not empty, or never made
                folder.rmdir()
        raise


def _missing(path: Path) -> list[Path]:
    """Return ``path`` and the folders above it that do not exist, the innermost first."""
    missing: list[Path] = []
    for place in (path, *path.parents):
        if os.path.lexists(place):
            if not place.is_dir():
                # What a link leads to may be nothing, or the link itself.
                what = "a file" if is_file(place) or not place.is_symlink() else "a link that leads to no folder"
                raise LutgenError(f"{place}: is {what}, and the output is a folder. Choose another with -o.")
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
    """Lock a folder; None where that cannot be done, as on some network drives.

    The lock needs no file, and ends with the last process that holds it, however that ends.
    """
    if fcntl is None:
        return None
    try:
        folder = os.open(path, os.O_RDONLY)
    except OSError:
        return None  # unreadable: said better by whoever reads it
    end = time.monotonic() + PATIENCE
    while True:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > end:
                os.close(folder)
                message = f"{path}: another build writes into it. Wait for its end, or choose another folder with -o."
                raise LutgenError(message) from None
            time.sleep(0.05)
        except OSError:
            break
        else:
            break
    return folder
