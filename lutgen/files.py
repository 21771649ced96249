"""Bounded reading of untrusted files, atomic writing, and temporary folders.

Writing is atomic: a reader sees the old file or the complete new file, never a part of a file. A killed run leaves its
temporary folder behind. The next run removes that folder.
"""

import errno
import hashlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import cache
from math import inf
from pathlib import Path

from lutgen.errors import LutgenError, listed, reason_of

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

#: Suffix of a file that is being written. The next build removes the partial files that a killed build left.
PARTIAL = ".lutgen-partial"

#: Maximum length in bytes of a name to which a dot and ``PARTIAL`` are added. File systems allow 255 bytes.
_LONGEST_NAME = 200

#: Prefix of the names of temporary folders.
PREFIX = "lutgen-"

#: Age in seconds above which an unlocked folder belongs to a killed run. A live run locks its new folder within a few
#: milliseconds.
GRACE = 60.0


def write_atomically(path: Path, data: bytes) -> None:
    """Write ``data`` beside ``path`` and rename it to ``path``. Raises LutgenError: the file cannot be written."""
    with replacing(path) as partial:
        partial.write_bytes(data)


def read_at_most(path: Path, most: int, *, what: str, none: str, advice: str = "") -> bytes:
    """Read an untrusted file. Refuse a file of more than ``most`` bytes before reading it.

    ``what``, ``none`` and ``advice`` are parts of the error messages. ``what`` names the file, such as "the session".
    ``none`` is its kind, such as "session", in "larger than 8 MB, which no session is". ``advice`` is a sentence that
    says what to do.

    Raises LutgenError: the file cannot be read, or is larger than ``most``.
    """
    then = f" {advice}" if advice else ""
    try:
        return bytes_at_most(path, most, none=none, advice=advice)
    except LutgenError:  # LutgenError is a ValueError, which the last clause would catch
        raise
    except OSError as error:
        raise LutgenError(f"{path}: cannot read {what}: {reason_of(error)}.{then}") from None
    except ValueError as error:  # the name contains a NUL
        raise LutgenError(f"{str(path)!r}: cannot read {what}: {error}.{then}") from None


def bytes_at_most(path: Path, most: int, *, none: str, advice: str = "") -> bytes:
    """Read a file as :func:`read_at_most` does, but leave an OSError to the caller, who words its own message.

    Raises OSError: the file cannot be read. Raises LutgenError: the file is larger than ``most``.
    """
    with path.open("rb") as file:
        # A device or a pipe reports no size and may never end: read at most one byte more than is allowed.
        data = file.read(most + 1) if os.fstat(file.fileno()).st_size <= most else None
    if data is None or len(data) > most:
        then = f" {advice}" if advice else ""
        raise LutgenError(f"{path}: larger than {most // 1_000_000} MB, which no {none} is.{then}")
    return data


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file of any size. Raises LutgenError when the file cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise LutgenError(f"{path}: cannot read: {reason_of(error)}.") from None


def files_below(folder: Path, suffixes: Sequence[str]) -> list[Path] | None:
    """Return the sorted files with one of ``suffixes`` in ``folder`` and its subfolders; None when it is no folder.

    Hidden files and the contents of hidden folders are skipped.

    Raises LutgenError: the folder cannot be listed.
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
        raise LutgenError(f"{folder}: cannot be listed: {reason_of(error)}.") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``. On success rename it to ``path``; on failure remove it.

    Raises LutgenError: the folder is read-only or full, a file stands in the place of a folder, or ``path`` is a device
    or a pipe.
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
    except BaseException as error:
        # On a read-only disk, or where a file stands in the place of a folder, nothing was written and unlink fails.
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise cannot_write(path, error) from None
        raise


def _is_device(path: Path) -> bool:
    """Whether ``path`` exists and is neither a file nor a folder."""
    with suppress(OSError, ValueError):  # the path does not exist, or is not a valid name
        mode = path.stat().st_mode
        return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))
    return False


def _partial(path: Path) -> Path:
    """Return the path of the temporary file for ``path``. A hash replaces a long name, so that the suffix fits."""
    name = path.name if len(os.fsencode(path.name)) <= _LONGEST_NAME else hashlib.sha256(os.fsencode(path)).hexdigest()
    return path.with_name(f".{name}{PARTIAL}")


def check_new_file(path: str | Path, *, force: bool, suffixes: Iterable[str] = ()) -> Path:
    """Return ``path`` when a file can be written there. Callers check this before they do the work.

    Raises LutgenError: the suffix is not one of ``suffixes``, ``path`` is a folder or not writable, or the file exists
    and ``force`` is false.
    """
    file, suffixes = Path(path), tuple(suffixes)
    if suffixes and file.suffix.lower() not in suffixes:
        raise LutgenError(f"{path}: give a name that ends in {listed(suffixes, 'or')}.")
    if file.is_dir():
        raise LutgenError(f"{path}: is a folder. Give the name of a file.")
    if file.exists() and not force:
        raise LutgenError(f"{path}: exists already. Add --force to replace it, or choose another name.")
    place = next(parent for parent in file.absolute().parents if parent.exists())
    if not place.is_dir() or not os.access(place, os.W_OK):
        why = "no right to write there" if place.is_dir() else f"{place} is a file, not a folder"
        raise LutgenError(f"{file}: cannot write: {why}. Choose another place to write to.")
    return file


def free_bytes(folder: Path) -> float:
    """Return the free space of ``folder`` in bytes; infinity when its file system reports no size."""
    usage = shutil.disk_usage(folder)
    return usage.free if usage.total else inf


def is_file(path: Path) -> bool:
    """Whether ``path`` leads to a file. False, where pathlib raises, for a closed parent folder or a name too long."""
    return os.path.isfile(path)  # noqa: PTH113 - Path.is_file raises


def is_folder(path: Path) -> bool:
    """Whether ``path`` leads to a folder. Errors give False, as in :func:`is_file`."""
    return os.path.isdir(path)  # noqa: PTH112 - Path.is_dir raises


def check_name(path: Path) -> None:
    """Raise LutgenError when OpenImageIO cannot use the name of an output file, since it is not UTF-8."""
    if not is_unicode(path):
        raise LutgenError(f"{str(path)!r}: is no name in UTF-8, as images need it. Choose another with -o.")


def is_unicode(path: Path) -> bool:
    """Whether a name is valid Unicode. Python decodes other bytes to surrogates, which cannot be encoded."""
    return str(path).encode(errors="replace").decode() == str(path)


def cannot_write(path: Path, error: OSError) -> LutgenError:
    """Return the error for a path that cannot be written."""
    do = "Make room, or choose" if error.errno in {errno.ENOSPC, errno.EDQUOT} else "Choose"
    return LutgenError(f"{path}: cannot write: {reason_of(error)}. {do} another place to write to.")


@contextmanager
def under_its_name(path: Path, suffix: str, folder: Path | None = None) -> Iterator[Path]:
    """Yield a symbolic link to ``path`` whose name ends in ``suffix``, in a private folder.

    OpenColorIO chooses the reader by the suffix, and does not know the suffix of a partial file. ``folder`` is an
    existing private folder, which several processes may share; None creates a new folder.
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
    """Yield a new private folder and remove it at the end of the block.

    The folder is locked during the block. The system releases the lock when the process ends, even if it is killed. The
    first call in a process removes folders of this user that no process locks any more.
    """
    _clear(tempfile.gettempdir())
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name:
        lock = None
        with suppress(BlockingIOError):  # no other process has a reason to lock a new folder
            lock = locked(Path(name))
        try:
            yield Path(name)
        finally:
            if lock is not None:
                os.close(lock)


@cache
def _clear(place: str) -> None:
    """Remove the folders that killed runs left. The cache makes this run once in each process."""
    if fcntl is None:
        return
    for folder in Path(place).glob(f"{PREFIX}*"):
        with suppress(OSError):  # another process may remove the same folder
            status = folder.lstat()
            ours = status.st_uid == os.getuid() and not folder.is_symlink() and folder.is_dir()
            if ours and time.time() - status.st_mtime > GRACE and (lock := locked(folder)) is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(lock)


def locked(folder: Path) -> int | None:
    """Lock a folder and return the file descriptor; closing the descriptor releases the lock.

    Return None where locks are not supported, as on some network drives. The lock needs no file. The system releases
    the lock when the last process that holds it ends, even if that process is killed.

    Raises BlockingIOError: another process holds the lock.
    """
    if fcntl is None:
        return None
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        return None  # later reading of the folder raises a clearer message
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        if isinstance(error, BlockingIOError):
            raise
        return None
    return descriptor
