"""colour-science's ``LUT3D``, in double precision."""

from functools import partial

import numpy as np

from lutgen.lint.programs import COLOUR_SCIENCE
from tests.consumers import Consumer, Job, Picture, module
from tests.consumers._claims import cubes


def version() -> str:
    return str(module("colour", "colour-science").__version__)


def cube(job: Job, interpolation: str) -> Picture:
    colour = module("colour", "colour-science")
    interpolator = getattr(colour.algebra, f"table_interpolation_{interpolation}")
    return np.asarray(colour.read_LUT(str(job.cube)).apply(job.image / 255, interpolator=interpolator))


CLAIMS = [cubes(COLOUR_SCIENCE)]

CONSUMERS = [
    Consumer("colour.LUT3D", version, "aged.cube", how, partial(cube, interpolation=how))
    for how in ("tetrahedral", "trilinear")
]
