"""Argyll's ``cctiff``, another colour engine than LittleCMS, at 16 bit."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from tests.consumers import Consumer, Job, Unavailable, first_line, program, read_image, run

if TYPE_CHECKING:
    from tests.consumers import Picture

#: Where Debian's argyll keeps its sRGB profile.
SRGB = Path("/usr/share/color/argyll/ref/sRGB.icm")


def tool() -> str:
    return program("cctiff", "argyll")


@cache
def version() -> str:
    # It has no option for it, says it with its help, and calls that a failure.
    said = first_line(run("sh", "-c", '"$0" "-?" 2>&1 || true', tool()))
    return said.rpartition(", V")[2]


def cctiff(job: Job, *profiles: str | Path) -> Picture:
    result = job.scratch / "cctiff.tif"
    result.unlink(missing_ok=True)
    run(tool(), "-p", *profiles, job.tif16, result)
    return read_image(result)


def profile(job: Job) -> Picture:
    if not SRGB.is_file():
        raise Unavailable(f"{SRGB} is missing; Debian has it in the package argyll")
    return cctiff(job, "-ir", job.lut("icc"), "-ir", SRGB)


def link(job: Job) -> Picture:
    return cctiff(job, job.lut("devicelink"))


CONSUMERS = [
    Consumer("cctiff", version, "aged.icc", "trilinear", profile),
    Consumer("cctiff, link", version, "aged-link.icc", "trilinear", link),
]
