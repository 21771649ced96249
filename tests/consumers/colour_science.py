"""colour-science's ``LUT3D``, in double precision."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from lutgen.lint.programs import COLOUR_SCIENCE
from tests.consumers import Consumer, Job, module
from tests.consumers._claims import cubes

if TYPE_CHECKING:
    from tests.consumers import Picture


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
