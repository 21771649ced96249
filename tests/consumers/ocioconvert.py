"""OpenColorIO's converter, from Debian's opencolorio-tools. It writes in the depth of its input."""

import re
from functools import cache
from pathlib import Path

from lutgen.bake.config import AGED, AGED_VIEW, SOURCE
from tests.consumers import Consumer, Job, Picture, program, read_image, run


def tool() -> str:
    return program("ocioconvert", "opencolorio-tools")


@cache
def version() -> str:
    # The program has no version option; it prints the version beside the error that the picture does not exist.
    help_text = run("sh", "-c", '"$0" -v --lut none none none || true', tool())
    match = re.search(r"OCIO Version: (\S+)", help_text)
    return match[1] if match else "?"


def call(job: Job, *before: str | Path, after: tuple[str, ...] = ()) -> Picture:
    result = job.scratch / "ocioconvert.tif"
    result.unlink(missing_ok=True)
    run(tool(), *before, result, *after, env={"OCIO": str(job.config)})
    return read_image(result)


def convert(job: Job) -> Picture:
    return call(job, job.png16, AGED, after=(SOURCE,))


def view(job: Job) -> Picture:
    return call(job, "--view", job.png16, SOURCE, after=("sRGB", AGED_VIEW))


def clf(job: Job) -> Picture:
    return call(job, "--lut", job.clf, job.png16)


CONSUMERS = [
    Consumer("ocioconvert", version, "config.ocio", "tetrahedral", convert),
    Consumer("ocioconvert --view", version, "config.ocio", "tetrahedral", view),
    Consumer("ocioconvert --lut", version, "aged.clf", "tetrahedral", clf),
]
