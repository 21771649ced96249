"""Files that the page uploads and downloads.

Files that a user drops on the page are limited in size, stored under safe names in the window's own folder, and then
opened together: a table of readings, a campaign file, or sessions of one display, whose operating hours the page asks
for. Commands of the command line make the files to download, in a process that can be cancelled.
"""

from __future__ import annotations

import asyncio
import io
import sys
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from lutgen.documents import toml_text
from lutgen.errors import LutgenError
from lutgen.explore.commands import MODEL, build_words, lut_options, report_words
from lutgen.processes import python_environment
from lutgen.server import RefusedError, pieces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.requests import Request

    from lutgen.explore.window import Window

#: Formats of one hour's LUT.
LUTS = ("cube", "clf", "icc")


async def taken(window: Window, item: str, *, mode: str, hours: float, kind: str) -> tuple[str, bytes]:
    """Make the file that the page requests; return its name and bytes. Raises LutgenError as the command does."""
    place = window.new_folder()
    stem = Path(window.overview["name"]).stem
    if item == "patches":
        return f"{stem}-next.csv", await window.fits("patches", between=window.between)
    if item == "readings":
        return window.overview["name"], await asyncio.to_thread(Path(window.state.data).read_bytes)
    model = place / MODEL
    await window.fits("save", path=str(model))
    if item == "model":
        return MODEL, await window.fits("model_text")
    state, shown = replace(window.state, dropped=frozenset()), ["--model", str(model)]
    if item in LUTS:
        options = lut_options(mode, hours, item, kind)
        await _run(build_words(shown, *options, "--no-certificates", to=str(place / "lut")))
        (file,) = place.rglob(f"*.{item}")
        return f"{stem}-{mode}-{hours:.0f}h-{kind}.{item}", file.read_bytes()
    if item == "build":
        await _run(build_words(shown, "--hours", f"0..{window.overview['max_hours']:.12g}", to=str(place / "aged")))
        return f"{stem}-aged.zip", zipped(place / "aged")
    if item == "report":
        await _run(report_words(state, shown, to=str(place / "report.html")))
        return f"{stem}-report.html", (place / "report.html").read_bytes()
    raise LutgenError(f"take {item!r}: pick one of model, {', '.join(LUTS)}, build, report, patches, readings.")


async def _run(words: Sequence[str]) -> None:
    """Run a lutgen command. The command is ended when the request is cancelled."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", *words,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
        env=python_environment(),
        start_new_session=True,
    )  # fmt: skip
    try:
        _, error = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
    if process.returncode:
        message = error.decode(errors="replace").strip().removeprefix("lutgen: error: ")
        raise LutgenError(message or "the command was ended.")


def zipped(folder: Path) -> bytes:
    """Return a ZIP archive of a folder; the same files give the same bytes."""
    packed = io.BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        for path in sorted(each for each in folder.rglob("*") if each.is_file()):
            archive.writestr(ZipInfo(path.relative_to(folder.parent).as_posix()), path.read_bytes(), ZIP_DEFLATED)
    return packed.getvalue()


#: Most bytes of readings, of an image and of a Python file that the page may send.
READINGS, IMAGE, CODE = 8_000_000, 300_000_000, 200_000

#: Most files that are dropped together.
MOST_FILES = 200

#: Limits for the page, so that it does not send files that would be refused.
LIMITS = {"readings": READINGS, "image": IMAGE, "code": CODE}


async def kept(request: Request, folder: Path, most: int, what: str) -> Path:
    """Write a file that the page sends into a folder, under the file's name; errors as ``lutgen.server.pieces``."""
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
    """Return ``data``, the file to read; or ``needs_hours``, the sessions whose hours the user must give.

    ``same``: the sessions are of one display although they look like several displays. Raises LutgenError: as
    ``lutgen sessions init``, or the number of hours differs from the number of sessions.
    """
    # The server only receives files: it starts faster without the modules that read them.
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
    entries = [f"[[sessions]]\nfile = {toml_text(file.name)}\nhours = {float(hour)!r}" for hour, file in ordered]
    to = files[0].parent / "campaign.toml"
    to.write_text("\n\n".join(["schema = 1", *entries, ""]), encoding="utf-8")
    return {"data": str(to)}
