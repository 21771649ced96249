"""Pillow's colour table, filled by pillow_lut from a .cube: 8 bit in, 8 bit out, trilinear."""

from importlib.metadata import version as version_of

import numpy as np

from lutgen.lint.programs import PILLOW_LUT
from tests.consumers import Consumer, Job, Picture, module
from tests.consumers._claims import cubes


def version() -> str:
    module("pillow_lut", "pillow_lut")
    return version_of("pillow_lut")


def cube(job: Job) -> Picture:
    table = module("pillow_lut", "pillow_lut").load_cube_file(str(job.cube))
    return np.asarray(module("PIL.Image", "pillow").fromarray(job.image).filter(table))


CLAIMS = [cubes(PILLOW_LUT)]

CONSUMERS = [Consumer("pillow_lut", version, "aged.cube", "trilinear", cube)]
