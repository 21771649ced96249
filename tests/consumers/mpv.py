"""mpv with ffmpeg's lut3d as its video filter; the shown frame is written to a PNG of 16 bit."""

from functools import cache

from tests.consumers import Consumer, Job, Picture, first_line, program, read_image, run


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
