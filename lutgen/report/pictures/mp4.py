"""MP4 through the program ffmpeg, which only MP4 needs."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from contextlib import suppress
from itertools import chain
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from lutgen.report.drawing.grey_page import Pixels

#: Video as players expect it: BT.709 and half the colour resolution, so an even number of rows and columns.
_COLOURS = (
    "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=0x777777,scale=in_range=pc:out_range=tv:out_color_matrix=bt709"
    ":flags=accurate_rnd+full_chroma_int,format=yuv420p"
)
_TAGS = ("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv")


def check_ffmpeg() -> str:
    """Return the path of ffmpeg. Raises LutgenError that says how to install it, and which format needs no program."""
    program = shutil.which("ffmpeg")
    if program is None:
        message = (
            "MP4 is written by the program ffmpeg, which is not on the PATH. Install it (Debian: apt install ffmpeg), "
            "or give a name that ends in .png: an animated PNG needs no other program."
        )
        raise LutgenError(message)
    return program


def write_mp4(frames: Iterable[Pixels], seconds: float, path: Path, name: str) -> None:
    """Write frames, uint8 of one shape (h, w, 3), each shown for ``seconds``; error messages call the file ``name``.

    Raises
    ------
    LutgenError
        ffmpeg is not installed, or cannot write the file; the message quotes ffmpeg.

    """
    program, frames = check_ffmpeg(), iter(frames)
    first = next(frames)
    command = [
        program, "-v", "error", "-nostdin", "-y",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{first.shape[1]}x{first.shape[0]}",
        "-r", f"{1.0 / seconds:.6f}", "-i", "pipe:0",
        "-vf", _COLOURS, *_TAGS, "-movflags", "+faststart", "-fflags", "+bitexact", "-flags:v", "+bitexact",
        "-f", "mp4", str(path),
    ]  # fmt: skip
    with tempfile.TemporaryFile() as errors:
        running = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=errors)  # noqa: S603 - no shell
        # If ffmpeg closes the pipe early, its error output explains why.
        with running, suppress(BrokenPipeError):
            for frame in chain([first], frames):
                running.stdin.write(frame.tobytes())  # type: ignore[union-attr]
        if running.returncode:
            errors.seek(0)
            why = " ".join(errors.read().decode(errors="replace").split()) or f"it ended with {running.returncode}"
            message = f"{name}: ffmpeg cannot write it: {why}. Write an animated PNG (.png) instead."
            raise LutgenError(message)
