"""GraphicsMagick's ``-hald-clut`` at 16 bit."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from tests.consumers import Consumer, Job, first_line, program, read_image, run

if TYPE_CHECKING:
    from tests.consumers import Picture


def tool() -> str:
    return program("gm", "graphicsmagick")


@cache
def version() -> str:
    return first_line(run(tool(), "version")).removeprefix("GraphicsMagick ").partition(" ")[0]


def picture(job: Job) -> Picture:
    result = job.scratch / "graphicsmagick.png"
    run(tool(), "convert", job.png16, "-hald-clut", job.lut("hald"), "-depth", "16", result)
    return read_image(result)


CONSUMERS = [Consumer("gm convert -hald-clut", version, "aged-hald.png", "trilinear", picture)]
