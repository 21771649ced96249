"""GraphicsMagick's ``-hald-clut`` at 16 bit."""

from functools import cache

from tests.consumers import Consumer, Job, Picture, first_line, program, read_image, run


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
