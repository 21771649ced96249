"""mpv with ffmpeg's lut3d as its video filter; the shown frame is written to a PNG of 16 bit."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from tests.consumers import Consumer, Job, first_line, program, read_image, run

if TYPE_CHECKING:
    from tests.consumers import Picture


def tool() -> str:
    return program("mpv", "mpv")


@cache
def version() -> str:
    return first_line(run(tool(), "--no-config", "--version")).split()[1]


def lut3d(job: Job) -> Picture:
    folder = job.scratch / "mpv"
    flags = ("--no-config", "--no-terminal", "--no-audio", "--vo=image", "--vo-image-format=png")
    depth = "--vo-image-high-bit-depth=yes"
    filters = f"--vf=lavfi=[format=rgb48le,lut3d=file={job.cube.name}:interp=tetrahedral]"
    run(tool(), *flags, depth, f"--vo-image-outdir={folder}", filters, job.png16, cwd=job.cube.parent)
    return read_image(folder / "00000001.png")


CONSUMERS = [Consumer("mpv lut3d", version, "aged.cube", "tetrahedral", lut3d)]
