"""The PNG file of a picture: its path is checked before any work, and it is renamed into place when it is whole."""

from __future__ import annotations

from base64 import b64encode
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.files import replacing

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Metadata of a PNG that matplotlib writes: without the version of matplotlib, so that the bytes stay the same.
METADATA: Any = {"Software": None}


def check_new_png(path: str | Path, *, force: bool) -> Path:
    """Return ``path`` when a picture may be written there, before any work is done for it.

    Raises
    ------
    LutgenError
        Not a .png, a folder, or a file that exists, without ``force``.

    """
    path = Path(path)
    if path.suffix.lower() != ".png":
        message = f"{path}: pictures are written as PNG. Give a name that ends in .png."
        raise LutgenError(message)
    if path.is_dir():
        message = f"{path}: is a folder. Give the name of a .png file."
        raise LutgenError(message)
    if path.exists() and not force:
        message = f"{path}: exists already. Add --force to replace it, or choose another name."
        raise LutgenError(message)
    return path


@contextmanager
def new_png(path: str | Path, *, force: bool) -> Iterator[Path]:
    """Yield a temporary path that is renamed to ``path`` on success; errors as in :func:`check_new_png`."""
    with replacing(check_new_png(path, force=force)) as partial:
        yield partial


def data_address(image: bytes) -> str:
    """Return a PNG as an address that holds the picture itself (RFC 2397)."""
    return f"data:image/png;base64,{b64encode(image).decode()}"
