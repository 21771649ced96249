"""Files that are dropped on the page: bounded, under safe names, in the window's own folder."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from lutgen.server import RefusedError, pieces

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.requests import Request

#: Bytes of readings, of an image and of a Python file that the page may send.
READINGS, IMAGE, CODE = 8_000_000, 300_000_000, 200_000

#: Files of a session or a campaign that are dropped together.
MOST_FILES = 200

#: Limits as the page is told of them, so that it need not send what is refused.
LIMITS = {"readings": READINGS, "image": IMAGE, "code": CODE}


async def kept(request: Request, folder: Path, most: int, what: str) -> Path:
    """Write what the page sends into a folder, under the name that it gives; errors as ``lutgen.server.pieces``."""
    name = PurePosixPath(request.query_params.get("name", "").replace("\\", "/")).name
    if not name.isprintable() or name in ("", ".", "..") or len(name.encode()) > 200:
        raise RefusedError(400, "bad", f"name={name!r}: give the file's name.")
    path = folder / name
    try:
        with path.open("wb") as file:
            async for piece in pieces(request, most, what):
                file.write(piece)
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    return path
