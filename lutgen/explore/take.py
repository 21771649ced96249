"""The files to download: the command line makes them, in a process that can be cancelled."""

from __future__ import annotations

import asyncio
import io
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from lutgen.errors import LutgenError
from lutgen.explore.commands import MODEL, build_words, lut_options, report_words
from lutgen.processes import python_environment

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.explore.window import Window

#: Formats of one hour's LUT.
LUTS = ("cube", "clf", "icc")


async def taken(window: Window, what: str, *, mode: str, hours: float, kind: str) -> tuple[str, bytes]:
    """Make the file that the page asks for; return its name and bytes. Raises LutgenError as the command does."""
    place = window.new_folder()
    stem = Path(window.overview["name"]).stem
    if what == "patches":
        return f"{stem}-next.csv", await window.patches()
    if what == "readings":
        return window.overview["name"], await asyncio.to_thread(Path(window.asked.data).read_bytes)
    model = place / MODEL
    await window.fits("save", path=str(model))
    if what == "model":
        return MODEL, await window.fits("model_text")
    asked, shown = replace(window.asked, dropped=frozenset()), ["--model", str(model)]
    if what in LUTS:
        await _run(
            build_words(shown, *lut_options(mode, hours, what, kind), "--no-certificates", to=str(place / "lut"))
        )
        return f"{stem}-{mode}-{hours:.0f}h-{kind}.{what}", _only(place, what)
    if what == "build":
        await _run(build_words(shown, "--hours", f"0..{window.overview['max_hours']:g}", to=str(place / "aged")))
        return f"{stem}-aged.zip", zipped(place / "aged")
    if what == "report":
        await _run(report_words(asked, shown, to=str(place / "report.html")))
        return f"{stem}-report.html", (place / "report.html").read_bytes()
    raise LutgenError(f"take {what!r}: pick one of model, {', '.join(LUTS)}, build, report, patches, readings.")


async def _run(words: Sequence[str]) -> None:
    """Run a lutgen command; the command is ended when the request is cancelled."""
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
        raise LutgenError(error.decode(errors="replace").strip().removeprefix("lutgen: error: ") or "it was ended.")


def _only(folder: Path, suffix: str) -> bytes:
    """Read the one LUT of a build."""
    (file,) = folder.rglob(f"*.{suffix}")
    return file.read_bytes()


def zipped(folder: Path) -> bytes:
    """Pack a folder; the same files give the same bytes."""
    packed = io.BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        for path in sorted(each for each in folder.rglob("*") if each.is_file()):
            archive.writestr(ZipInfo(path.relative_to(folder.parent).as_posix()), path.read_bytes(), ZIP_DEFLATED)
    return packed.getvalue()
