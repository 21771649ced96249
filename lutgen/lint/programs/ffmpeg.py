"""ffmpeg's ``lut3d`` filter on 16-bit pictures."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lutgen.lint.finding import FFMPEG
from lutgen.lint.programs import TIMEOUT, Absent, Program, Refusal

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array


@cache
def version() -> str:
    """Return the program's version."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise Absent("ffmpeg is not on the PATH (Debian: apt install ffmpeg)")
    said = subprocess.run([found, "-version"], capture_output=True, check=False, timeout=TIMEOUT).stdout  # noqa: S603 - no shell
    words = said.decode(errors="replace").split()
    return words[2] if len(words) > 2 else "of no version"


def apply(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file; runs in its folder, so that the filter's path needs no quotes."""
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb48le")
    command = [
        "ffmpeg", "-nostdin", "-loglevel", "error", *raw, "-s", f"{len(code)}x1", "-i", "pipe:0",
        "-vf", f"lut3d=file={path.name}:interp=trilinear", *raw, "pipe:1",
    ]  # fmt: skip
    pixels = (code.astype("<u2") * 257).tobytes()
    try:
        done = subprocess.run(  # noqa: S603 - no shell
            command, input=pixels, capture_output=True, cwd=path.parent, check=False, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        message = f"gives no answer in {TIMEOUT} s"
        raise Refusal(message) from None
    if done.returncode or len(done.stdout) != len(pixels):
        raise Refusal(
            done.stderr.decode(errors="replace").partition("\n")[0].partition("] ")[2] or "ends with an error"
        )
    return np.frombuffer(done.stdout, "<u2").reshape(-1, 3) / 65535


PROGRAM = Program(lambda: FFMPEG, version, apply, tolerance=4 / 65535, clips=True)
