"""Pillow's colour table, filled by pillow_lut from a .cube: 8 bit in, 8 bit out, trilinear."""

from __future__ import annotations

from importlib.metadata import version as version_of
from typing import TYPE_CHECKING

import numpy as np

from lutgen.lint.programs import PILLOW_LUT
from tests.consumers import Consumer, Job, module
from tests.consumers._claims import cubes

if TYPE_CHECKING:
    from tests.consumers import Picture


def version() -> str:
    module("pillow_lut", "pillow_lut")
    return version_of("pillow_lut")


def cube(job: Job) -> Picture:
    table = module("pillow_lut", "pillow_lut").load_cube_file(str(job.cube))
    return np.asarray(module("PIL.Image", "pillow").fromarray(job.image).filter(table))


CLAIMS = [cubes(PILLOW_LUT)]

CONSUMERS = [Consumer("pillow_lut", version, "aged.cube", "trilinear", cube)]
