"""ImageMagick's ``-hald-clut`` at 16 bit; Debian names the program of version 6 ``convert-im6.q16``."""

from functools import cache

from tests.consumers import Consumer, Job, Picture, first_line, program, read_image, run


def tool() -> str:
    return program("convert-im6.q16", "imagemagick")


@cache
def version() -> str:
    return first_line(run(tool(), "-version")).removeprefix("Version: ImageMagick ").partition(" ")[0]


def picture(job: Job) -> Picture:
    result = job.scratch / "imagemagick.png"
    run(tool(), job.png16, job.lut("hald"), "-hald-clut", "-depth", "16", result)
    return read_image(result)


CONSUMERS = [Consumer("convert -hald-clut", version, "aged-hald.png", "trilinear", picture)]
