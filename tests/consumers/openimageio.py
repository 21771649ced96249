"""OpenImageIO in Python, whichever binding this environment has."""

from typing import Any

import numpy as np

from lutgen.bake.config import AGED_VIEW, LOOK, SOURCE
from lutgen.bindings import oiio
from tests.consumers import Consumer, Job, Picture


def version() -> str:
    return str(oiio().VERSION_STRING)


def source(job: Job) -> Any:
    lib = oiio()
    buffer = lib.ImageBuf(str(job.png8))
    buffer.read(0, 0, True, lib.FLOAT)  # noqa: FBT003 - takes no keywords: subimage, miplevel, force, convert
    return buffer


def pixels(buffer: Any) -> Picture:
    if buffer.has_error:
        raise RuntimeError(buffer.geterror())
    return np.asarray(buffer.get_pixels(oiio().FLOAT))


def display(job: Job) -> Picture:
    call = oiio().ImageBufAlgo.ociodisplay
    return pixels(call(source(job), "sRGB", AGED_VIEW, fromspace=SOURCE, colorconfig=str(job.config)))


def variables(job: Job) -> Picture:
    call = oiio().ImageBufAlgo.ociodisplay
    context = {"context_key": ",".join(job.variables), "context_value": ",".join(job.variables.values())}
    config = str(job.common_config)
    return pixels(call(source(job), "sRGB", AGED_VIEW, fromspace=SOURCE, colorconfig=config, **context))


def look(job: Job) -> Picture:
    call = oiio().ImageBufAlgo.ociolook
    return pixels(call(source(job), LOOK, SOURCE, SOURCE, colorconfig=str(job.config)))


def cube(job: Job) -> Picture:
    call = oiio().ImageBufAlgo.ociofiletransform
    return pixels(call(source(job), str(job.cube), colorconfig=str(job.config)))


CONSUMERS = [
    Consumer("ImageBufAlgo.ociodisplay", version, "config.ocio", "tetrahedral", display),
    Consumer("ImageBufAlgo.ociodisplay, key", version, "common config.ocio", "tetrahedral", variables),
    Consumer("ImageBufAlgo.ociolook", version, "config.ocio", "tetrahedral", look),
    Consumer("ImageBufAlgo.ociofiletransform", version, "aged.cube", "tetrahedral", cube),
]
