"""Files that are dropped on the page: bounded, under safe names, in the window's own folder, and then opened together.

Readings are a table, a campaign file, or sessions of one display, whose operating hours the page asks for.
"""

from __future__ import annotations

import json
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.server import RefusedError, pieces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.requests import Request

#: Bytes of readings, of an image and of a Python file that the page may send.
READINGS, IMAGE, CODE = 8_000_000, 300_000_000, 200_000

#: Files of a session or a campaign that are dropped together.
MOST_FILES = 200

#: Limits as the page gets them, so that it does not send files that would be refused.
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


def gathered(paths: Sequence[str], hours: Sequence[float] | None, *, same: bool = False) -> dict[str, Any]:
    """Return ``data``, the file to read; or ``needs_hours``, the sessions whose hours only a person knows.

    ``same``: they are of one display although they look like several.

    Raises LutgenError: as ``lutgen sessions init``, or as many hours as there are sessions were not given.
    """
    # The server takes files and opens none: it starts sooner without the modules that open them.
    from lutgen.history.draft import check_one_display
    from lutgen.readings import read_session

    files = [Path(path) for path in paths]
    campaign = next((file for file in files if file.suffix.lower() == ".toml"), None)
    if campaign or len(files) == 1:
        return {"data": str(campaign or files[0])}
    sessions = [read_session(file) for file in files]
    if not same:
        check_one_display(sessions)
    if hours is None:
        dates = [each.created.strftime("%Y-%m-%d %H:%M") if each.created else None for each in sessions]
        names = [{"name": file.name, "dated": date} for file, date in zip(files, dates, strict=True)]
        return {"needs_hours": names}
    if len(hours) != len(files):
        raise LutgenError(f"{len(hours)} hours were given for {len(files)} sessions. Give one for each.")
    ordered = sorted(zip(hours, files, strict=True))
    entries = [f"[[sessions]]\nfile = {json.dumps(file.name)}\nhours = {float(hour)!r}" for hour, file in ordered]
    to = files[0].parent / "campaign.toml"
    to.write_text("\n\n".join(["schema = 1", *entries, ""]), encoding="utf-8")
    return {"data": str(to)}
