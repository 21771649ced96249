"""ffmpeg's lut3d and haldclut at 16 bit; at 8 bit they truncate. Runs in the LUT's folder: its name needs no quotes.

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


def haldclut(job: Job) -> Picture:
    result = job.scratch / "ffmpeg.tif"
    result.unlink(missing_ok=True)
    deep = "[0]format=rgb48le[image];[1]format=rgb48le[table];[image][table]haldclut=interp=tetrahedral"
    inputs = ("-nostdin", "-loglevel", "error", "-y", "-i", job.png16, "-i", job.lut("hald"))
    run(tool(), *inputs, "-filter_complex", deep, "-frames:v", "1", "-pix_fmt", "rgb48le", result)
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
    Consumer("ffmpeg haldclut", version, "aged-hald.png", "tetrahedral", haldclut),
    Consumer("ffmpeg zscale, lut3d", version, "aged.cube", "tetrahedral", zscale),
]
