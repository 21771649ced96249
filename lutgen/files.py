"""Reading of files that may hold anything, atomic writing, and temporary folders.

Writing is atomic: a reader sees the old file or the new one, never a part. A run that was killed leaves its temporary
folder, and the next run removes it.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import tempfile
import time
from contextlib import contextmanager, nullcontext, suppress
from functools import cache
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError, reason_of

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

#: Files being written end in this; the next build removes those that a killed one left.
PARTIAL = ".lutgen-partial"

#: Bytes of a name to which a dot and ``PARTIAL`` can be added: file systems take 255.
_LONGEST_NAME = 200

#: Temporary folders begin with this.
PREFIX = "lutgen-"

#: An unlocked folder that is older than this, in seconds, belongs to a killed run: a new one is locked within a few
#: milliseconds.
GRACE = 60.0


def write_atomically(path: Path, data: bytes) -> None:
    """Write ``data`` beside ``path`` and rename it into place. Raises LutgenError when that cannot be done."""
    with replacing(path) as partial:
        partial.write_bytes(data)


def read_at_most(path: Path, most: int, *, what: str, none: str, advice: str = "") -> bytes:
    """Read a file that may hold anything; a file of more than ``most`` bytes is refused before it is read.

    ``what`` it is, such as "the session", what no file of that size is, such as "session", and what to do, a sentence,
    are for the messages.

    Raises LutgenError: the file cannot be read, or is larger.
    """
    then = f" {advice}" if advice else ""
    try:
        return bytes_at_most(path, most, none=none, advice=advice)
    except LutgenError:  # a ValueError too
        raise
    except OSError as error:
        raise LutgenError(f"{path}: cannot read {what}: {reason_of(error)}.{then}") from None
    except ValueError as error:  # a NUL in the name
        raise LutgenError(f"{str(path)!r}: cannot read {what}: {error}.{then}") from None


def bytes_at_most(path: Path, most: int, *, none: str, advice: str = "") -> bytes:
    """Read as :func:`read_at_most`, for callers with a sentence of their own on a file that is not there.

    Raises OSError: the file cannot be read. Raises LutgenError: it is larger.
    """
    with path.open("rb") as file:
        # A device or a pipe has no size, and may never end.
        data = file.read(most + 1) if os.fstat(file.fileno()).st_size <= most else None
    if data is None or len(data) > most:
        then = f" {advice}" if advice else ""
        raise LutgenError(f"{path}: larger than {most // 1_000_000} MB, which no {none} is.{then}")
    return data


def file_sha256(path: Path) -> str:
    """Return the hash of a file of any size. Raises LutgenError when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise LutgenError(f"{path}: cannot read: {reason_of(error)}.") from None


def files_below(folder: Path, suffixes: Sequence[str]) -> list[Path] | None:
    """Return the files of these suffixes in a folder and below, in order, or None where it is no folder.

    Hidden ones, and what is in hidden folders, are left out.

    Raises LutgenError: it cannot be looked into.
    """
    try:
        if not folder.is_dir():
            return None
        return sorted(
            path
            for path in folder.rglob("*")
            if path.suffix.lower() in suffixes
            and path.is_file()
            and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        )
    except OSError as error:
        raise LutgenError(f"{folder}: cannot be looked into: {reason_of(error)}.") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path``; on success it takes ``path``'s place, on failure it is removed.

    Raises LutgenError: the folder is read-only or full, a file stands where a folder should, or a device or a pipe
    stands there.
    """
    if _is_device(path):
        raise LutgenError(
            f"{path}: is a device or a pipe, which a file would replace. Choose another place to write to."
        )
    partial = _partial(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        partial.replace(path)
    except OSError as error:
        _discard(partial)
        raise cannot_write(path, error) from None
    except BaseException:
        _discard(partial)
        raise


def _is_device(path: Path) -> bool:
    """Whether something stands there that is neither a file nor a folder."""
    with suppress(OSError, ValueError):  # nothing, or no name
        mode = path.stat().st_mode
        return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))
    return False


def _partial(path: Path) -> Path:
    """Name the temporary file of ``path``: no longer than a file system takes, for a name that it takes itself."""
    name = path.name if len(os.fsencode(path.name)) <= _LONGEST_NAME else hashlib.sha256(os.fsencode(path)).hexdigest()
    return path.with_name(f".{name}{PARTIAL}")


def check_new_file(path: str | Path, *, force: bool, suffixes: Iterable[str] = ()) -> Path:
    """Return the path when a file may be written there, before any work is done for it.

    Raises LutgenError: another suffix, a folder, or a file that exists without ``force``.
    """
    file, suffixes = Path(path), tuple(suffixes)
    if suffixes and file.suffix.lower() not in suffixes:
        raise LutgenError(f"{path}: give a name that ends in {' or '.join(suffixes)}.")
    if file.is_dir():
        raise LutgenError(f"{path}: is a folder. Give the name of a file.")
    if file.exists() and not force:
        raise LutgenError(f"{path}: exists already. Add --force to replace it, or choose another name.")
    return file


def free_bytes(folder: Path) -> float:
    """Bytes that may still be written into ``folder``; infinite where its file system does not say."""
    usage = shutil.disk_usage(folder)
    return usage.free if usage.total else inf


def is_file(path: Path) -> bool:
    """Whether ``path`` leads to a file; not, where a folder above it is closed or a name too long: pathlib raises."""
    with suppress(OSError):
        return path.is_file()
    return False


def is_folder(path: Path) -> bool:
    """Whether ``path`` leads to a folder; as :func:`is_file`."""
    with suppress(OSError):
        return path.is_dir()
    return False


def check_name(path: Path) -> None:
    """Raise LutgenError for the name of an output that OpenImageIO cannot take."""
    if not is_unicode(path):
        raise LutgenError(f"{str(path)!r}: is no name in UTF-8, as images need it. Choose another with -o.")


def is_unicode(path: Path) -> bool:
    """Whether a name is Unicode: Python turns other bytes of a name into surrogates, which cannot be encoded again."""
    return str(path).encode(errors="replace").decode() == str(path)


def cannot_write(path: Path, error: OSError) -> LutgenError:
    """Return the sentence for a place that cannot be written to."""
    reason = reason_of(error)
    return LutgenError(f"{path}: cannot write: {reason}. Make room, or choose another place to write to.")


def _discard(partial: Path) -> None:
    # On a read-only disk, or below a file, there is nothing to remove; the failure to write is reported already.
    with suppress(OSError):
        partial.unlink(missing_ok=True)


@contextmanager
def under_its_name(path: Path, suffix: str, folder: Path | None = None) -> Iterator[Path]:
    """Give a path that ends in ``suffix`` for a file that does not, through a link in a private folder.

    OpenColorIO chooses the reader by the suffix; a partial file has none that it knows. ``folder``: a private one that
    is there already, perhaps of several processes; None: a new one.
    """
    with nullcontext(folder) if folder else scratch() as place:
        link = place / f"{os.getpid()}-lut{suffix}"
        link.symlink_to(path.resolve())
        try:
            yield link
        finally:
            link.unlink()


@contextmanager
def scratch() -> Iterator[Path]:
    """Give a new private folder, which is removed at the end of the block.

    The folder is locked while the process runs, however that ends; the first use in a process removes folders of this
    user that no process holds any more.
    """
    _clear(tempfile.gettempdir())
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name:
        held = None
        with suppress(BlockingIOError):  # nobody else has a reason to
            held = locked(Path(name))
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
            status = folder.lstat()
            ours = status.st_uid == os.getuid() and not folder.is_symlink() and folder.is_dir()
            if ours and time.time() - status.st_mtime > GRACE and (held := locked(folder)) is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(held)


def locked(folder: Path) -> int | None:
    """Lock a folder until what is returned is closed; None where that cannot be done, as on some network drives.

    The lock needs no file, and ends with the last process that holds it, however that ends. Raises BlockingIOError:
    another process holds it.
    """
    if fcntl is None:
        return None
    try:
        opened = os.open(folder, os.O_RDONLY)
    except OSError:
        return None  # an unreadable folder gets a clearer message when it is read
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(opened)
        if isinstance(error, BlockingIOError):
            raise
        return None
    return opened
