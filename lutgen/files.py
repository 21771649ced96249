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
