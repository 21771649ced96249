"""OpenColorIO in Python, whichever binding this environment has."""

import copy
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.bake.config import AGED_VIEW, NAMED_TRANSFORM, SOURCE
from lutgen.bindings import ocio
from lutgen.lint.programs import OPENCOLORIO
from tests.consumers import Consumer, Job, Picture
from tests.consumers._claims import cubes


def version() -> str:
    return str(ocio().__version__)


def apply(processor: Any, image: Picture) -> Picture:
    result = image.astype(np.float32) / np.float32(255)
    processor.getDefaultCPUProcessor().applyRGB(result)
    return np.asarray(result)


def through_display(config_file: Path, display: str, image: Picture) -> Picture:
    """Return the picture of the view Aged on a viewer's display; not clipped."""
    lib = ocio()
    config = lib.Config.CreateFromFile(str(config_file))
    return apply(config.getProcessor(lib.DisplayViewTransform(SOURCE, display, AGED_VIEW)), image)


def view(job: Job) -> Picture:
    return through_display(job.config, "sRGB", job.image)


def variables(job: Job) -> Picture:
    lib = ocio()
    config = lib.Config.CreateFromFile(str(job.common_config))
    context = copy.deepcopy(config.getCurrentContext())
    for key, value in job.variables.items():
        context[key] = value
    transform = lib.DisplayViewTransform(SOURCE, "sRGB", AGED_VIEW)
    return apply(config.getProcessor(context, transform, lib.TRANSFORM_DIR_FORWARD), job.image)


def named(job: Job) -> Picture:
    lib = ocio()
    config = lib.Config.CreateFromFile(str(job.config))
    # OpenColorIO 2.1 accepts no name of a named transform here, only the transform inside it.
    transform = config.getNamedTransform(NAMED_TRANSFORM).getTransform(lib.TRANSFORM_DIR_FORWARD)
    return apply(config.getProcessor(transform), job.image)


CLAIMS = [cubes(OPENCOLORIO)]

CONSUMERS = [
    Consumer("PyOpenColorIO, view", version, "config.ocio", "tetrahedral", view),
    Consumer("PyOpenColorIO, context", version, "common config.ocio", "tetrahedral", variables),
    Consumer("PyOpenColorIO, named transform", version, "config.ocio", "tetrahedral", named),
]
