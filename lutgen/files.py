"""Writing files so that a reader sees the old one or the new one, never a part."""

from __future__ import annotations

import tempfile
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Files being written end in this; the next build removes those that a killed one left.
PARTIAL = ".lutgen-partial"


def write_atomically(path: Path, data: bytes) -> None:
    """Write ``data`` beside ``path`` and rename it into place. Raises LutgenError when that cannot be done."""
    with replacing(path) as partial:
        partial.write_bytes(data)


def read_at_most(path: Path, most: int, *, what: str, none: str) -> bytes:
    """Read a file that may be anything: one of more than ``most`` bytes is refused before it is read.

    ``what`` it is, such as "the session", and what no file of that size is, such as "session", are for the sentences.

    Raises
    ------
    LutgenError
        The file cannot be read, or is larger.

    """
    try:
        data = path.read_bytes() if path.stat().st_size <= most else None
    except OSError as error:
        raise LutgenError(f"{path}: cannot read {what}: {(error.strerror or str(error)).lower()}.") from None
    except ValueError as error:  # a NUL in the name
        raise LutgenError(f"{str(path)!r}: cannot read {what}: {error}.") from None
    if data is None:
        raise LutgenError(f"{path}: larger than {most // 1_000_000} MB, which no {none} is.")
    return data


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path``; on success it takes ``path``'s place, on failure it is removed.

    Raises
    ------
    LutgenError
        The folder is read-only or full, or a file stands where a folder should.

    """
    partial = path.with_name(f".{path.name}{PARTIAL}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        partial.replace(path)
    except OSError as error:
        _discard(partial)
        reason = (error.strerror or str(error)).lower()
        message = f"{path}: cannot write: {reason}. Make room, or choose another place to write to."
        raise LutgenError(message) from None
    except BaseException:
        _discard(partial)
        raise


def _discard(partial: Path) -> None:
    # On a read-only disk, or below a file, there is nothing to remove; that the write failed is said already.
    with suppress(OSError):
        partial.unlink(missing_ok=True)


@contextmanager
def under_its_name(path: Path, suffix: str) -> Iterator[Path]:
    """Give a path that ends in ``suffix`` for a file that does not, through a link in a private folder.

    OpenColorIO chooses the reader by the suffix; a partial file has none that it knows.
    """
    with tempfile.TemporaryDirectory(prefix="lutgen-") as folder:
        link = Path(folder) / f"lut{suffix}"
        link.symlink_to(path.resolve())
        yield link
