"""LittleCMS: its own ``tificc`` at 16 bit, and Pillow's ``ImageCms`` at 8, as many viewers call it."""

from __future__ import annotations

from functools import cache, partial
from importlib.metadata import version as version_of
from typing import TYPE_CHECKING

import numpy as np

from tests.consumers import Consumer, Job, first_line, module, program, read_image, run

if TYPE_CHECKING:
    from tests.consumers import Picture

#: Rendering intents by their numbers.
PERCEPTUAL, RELATIVE = 0, 1


def tool() -> str:
    return program("tificc", "liblcms2-utils")


@cache
def version() -> str:
    # It has no option for it, says it with its help, and calls that a failure.
    said = first_line(run("sh", "-c", '"$0" -h 2>&1 || true', tool()))
    return said.rpartition("LittleCMS ")[2].rstrip("]")


def tificc(job: Job, *options: str) -> Picture:
    result = job.scratch / "tificc.tif"
    result.unlink(missing_ok=True)
    run(tool(), "-w16", *options, job.tif16, result)
    return read_image(result)


def profile(job: Job, intent: int) -> Picture:
    return tificc(job, f"-t{intent}", f"-i{job.lut('icc')}", "-o*sRGB")


def link(job: Job) -> Picture:
    return tificc(job, f"-l{job.lut('devicelink')}")


def pillow_version() -> str:
    module("PIL.ImageCms", "pillow")
    return version_of("pillow")


def pillow(job: Job, form: str = "icc") -> Picture:
    cms = module("PIL.ImageCms", "pillow")
    image = module("PIL.Image", "pillow").fromarray(job.image)
    return np.asarray(cms.profileToProfile(image, str(job.lut(form)), cms.createProfile("sRGB")))


CONSUMERS = [
    *(
        Consumer(f"tificc, {name}", version, "aged.icc", "tetrahedral", partial(profile, intent=intent))
        for name, intent in (("perceptual", PERCEPTUAL), ("relative", RELATIVE))
    ),
    Consumer("tificc, link", version, "aged-link.icc", "tetrahedral", link),
    Consumer("Pillow ImageCms", pillow_version, "aged.icc", "tetrahedral", pillow),
    Consumer(
        "Pillow ImageCms, matrix", pillow_version, "aged-matrix.icc", "matrix", partial(pillow, form="icc-matrix")
    ),
]
