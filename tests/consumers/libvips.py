"""libvips converts with LittleCMS at 8 bit, by the absolute intent, as the guide says, and by the relative intent."""

from collections.abc import Iterator
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.consumers import Claim, Consumer, Job, Picture, module, program, run
from tests.consumers._claims import aged, profile


@cache
def version() -> str:
    return run(program("vips", "libvips-tools"), "--version").strip().removeprefix("vips-")


def converted(pixels: NDArray[np.uint8], data: bytes, folder: Path, intent: str) -> NDArray[np.uint8]:
    images, file = module("PIL.Image", "pillow"), BytesIO()
    images.fromarray(pixels).save(file, "PNG", icc_profile=data)
    source, result = folder / "vips-in.png", folder / "vips-out.png"
    source.write_bytes(file.getvalue())
    how = ("--embedded", "--intent", intent)
    run(program("vips", "libvips-tools"), "icc_transform", source, result, "srgb", *how)
    return np.asarray(images.open(result).convert("RGB"))


def picture(job: Job) -> Picture:
    return converted(job.image, job.lut("icc").read_bytes(), job.scratch, "absolute")


def white(folder: Path) -> Iterator[str]:
    """Check white.

    By the relative intent white stays un-aged, by the absolute intent it ages; with a matrix it ages by both intents.
    """
    pixels = np.full((8, 8, 3), 255, np.uint8)
    meant = aged().code_to_code(np.ones((1, 3)))[0] * 255
    for name, intent, ages in (
        ("icc", "relative", False), ("icc", "absolute", True), ("icc-matrix", "relative", True),
    ):  # fmt: skip
        seen = converted(pixels, profile(name), folder, intent)[0, 0]
        if (np.abs(seen - meant).max() <= 2) != ages:
            yield f"{name}, {intent}: white is {seen}, and {meant.round()} is meant"


CONSUMERS = [Consumer("vips icc_transform, absolute", version, "aged.icc", "tetrahedral", picture)]

CLAIMS = [Claim("libvips", version, "ages white by the absolute intent, and by the relative with a matrix", white)]
