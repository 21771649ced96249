"""ffmpeg's lut3d filter at 16 bit; at 8 bit it truncates. Runs in the LUT's folder: a filter's path needs no quotes.

From an 8-bit picture, ``format=rgb48le`` would make 255 into 65280, a code too dark at white; ``zscale`` makes 65535.
"""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING

from tests.consumers import Consumer, Job, first_line, program, read_image, run

if TYPE_CHECKING:
    from pathlib import Path

    from tests.consumers import Picture


def tool() -> str:
    return program("ffmpeg", "ffmpeg")


@cache
def version() -> str:
    return first_line(run(tool(), "-version")).removeprefix("ffmpeg version ").partition(" ")[0]


def call(job: Job, source: Path, filters: str) -> Picture:
    result = job.scratch / "ffmpeg.tif"
    result.unlink(missing_ok=True)
    quiet = ("-nostdin", "-loglevel", "error", "-y")
    run(tool(), *quiet, "-i", source, "-vf", filters, "-pix_fmt", "rgb48le", result, cwd=job.cube.parent)
    return read_image(result)


def lut3d(job: Job, interpolation: str) -> Picture:
    return call(job, job.png16, f"format=rgb48le,lut3d=file={job.cube.name}:interp={interpolation}")


def zscale(job: Job) -> Picture:
    return call(job, job.png8, f"zscale=dither=none,format=gbrp16le,lut3d=file={job.cube.name}:interp=tetrahedral")


CONSUMERS = [
    *(
        Consumer("ffmpeg lut3d", version, "aged.cube", how, partial(lut3d, interpolation=how))
        for how in ("tetrahedral", "trilinear")
    ),
    Consumer("ffmpeg zscale, lut3d", version, "aged.cube", "tetrahedral", zscale),
]
