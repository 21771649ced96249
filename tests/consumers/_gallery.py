"""A picture of two real tissues, the builds for the consumers, and the expected pictures from the direct model."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import tifffile
from numpy.typing import NDArray
from skimage.data import immunohistochemistry

from configs.displays.table1 import SLIDE
from lutgen.bake.build import BuildPlan, build
from lutgen.bake.formats import format_names
from lutgen.bake.lut import Lut
from lutgen.bake.spaces import lattice
from lutgen.colorimetry import Array
from lutgen.display import AgedDisplay, DisplayModel, default_display
from lutgen.readings import read_measurements
from tests.consumers import Consumer, Job, Picture

MODES, HOURS = ("chroma", "chroma-luma"), (10_000.0, 18_000.0)

#: Largest error in 8-bit codes for 99 % of the values. The goal is one code for the interpolation for which the
#: files are made. With another interpolation the picture must only be the right one: an un-aged picture is 16 or more
#: codes off.
GATES = {"tetrahedral": 1.0, "trilinear": 2.0, "matrix": 2.0}

#: For pictures of 16 bit, LittleCMS combines a profile and the screen's profile into its own table, with this number of
#: points per edge, clipped (cmspcs.c, _cmsReasonableGridpointsByColorspace). No profile can reduce its error near the
#: clip.
RESAMPLED, RESAMPLED_POINTS = "resampled", 33

#: The nodes and the result of this table are rounded to 16 bit: a further error of two steps, in 8-bit codes.
ROUNDED = 2 * 255 / 65_535


@dataclass(frozen=True)
class Case:
    """A display that every consumer must show."""

    selection: str
    mode: str
    hours: float

    def __str__(self) -> str:
        """Return the name of the case in pytest."""
        return f"{self.selection}-{self.mode}-{self.hours:g}h"


CASES = (
    *(Case("nearest", mode, hours) for mode in MODES for hours in HOURS),
    Case("continuous", "chroma-luma", 18_000.0),
)


@dataclass(frozen=True)
class Errors:
    """Absolute differences from the direct model over all pixels and channels, in 8-bit codes."""

    mean: float
    p99: float
    max: float

    def passes(self, limit: float) -> bool:
        """Return whether the errors meet a gate; NaN does not."""
        return self.p99 <= limit


class Gallery:
    """Build all files into ``folder`` once, or those of ``formats`` and CLF; make and judge one picture at a time."""

    def __init__(self, folder: Path, formats: Iterable[str] = ()) -> None:
        self.folder = folder
        self.image = tissue()
        for selection in dict.fromkeys(case.selection for case in CASES):
            # Certificates have their own tests.
            written = tuple(dict.fromkeys(("clf", *(formats or format_names()))))
            plan = BuildPlan(hours=HOURS, modes=MODES, formats=written, certify=False)
            build(model(selection), plan, self.build(selection), jobs=1)

    def build(self, selection: str) -> Path:
        """Return the folder of the build of a selection."""
        return self.folder / selection

    def job(self, case: Case) -> Job:
        scratch = self.folder / "pictures" / str(case)
        scratch.mkdir(parents=True, exist_ok=True)
        return Job(self.build(case.selection), case.mode, case.hours, self.image, scratch)

    def render(self, consumer: Consumer, case: Case) -> Picture:
        """Make a picture. Raises Unavailable."""
        consumer.version()
        return consumer.render(self.job(case))

    def errors(self, picture: Picture, case: Case) -> Errors:
        """Return the errors of a picture."""
        return errors(picture, expected(case))


@cache
def tissue() -> NDArray[np.uint8]:
    """Return immunohistochemistry beside pale H&E.

    White and rose of the H&E lie where aged colours are clipped.
    """
    stained: NDArray[np.uint8] = immunohistochemistry()
    if not SLIDE.is_file():
        return stained
    height, width, _ = stained.shape
    pale = tifffile.imread(SLIDE)[600 : 600 + height, 600 : 600 + width]
    return np.ascontiguousarray(np.concatenate([stained, pale], axis=1))


@cache
def model(selection: str) -> DisplayModel:
    return DisplayModel(read_measurements(default_display()), selection=selection)


def aged(case: Case) -> AgedDisplay:
    return model(case.selection).at(case.mode, case.hours)


@cache
def expected(case: Case) -> Array:
    """Return the direct model's code values, in double precision, not rounded."""
    return aged(case).code_to_code(tissue() / 255)


@cache
def gates(case: Case) -> dict[str, float]:
    """Return the gate of every interpolation, in 8-bit codes.

    The gate of ``resampled`` is at least the error of such a table of the model itself.
    """
    size = RESAMPLED_POINTS
    nodes = aged(case).code_to_code(lattice(size, "code")).reshape(size, size, size, 3)
    shown = Lut("code", nodes).apply(tissue().reshape(-1, 3) / 255).reshape(tissue().shape)
    return GATES | {RESAMPLED: max(GATES["tetrahedral"], errors(shown, expected(case)).p99 + ROUNDED)}


def errors(picture: Picture, reference: Array) -> Errors:
    """Compare a picture with code values of the same shape."""
    if picture.shape != reference.shape:
        raise ValueError(f"a picture of shape {picture.shape} instead of {reference.shape}")
    error = np.abs(as_code(picture) - reference) * 255
    return Errors(float(error.mean()), float(np.quantile(error, 0.99)), float(error.max()))


def as_code(picture: Picture) -> Array:
    """Return a picture's code values 0..1; floats are clipped, as on a screen."""
    largest = {"uint8": 255.0, "uint16": 65_535.0}.get(str(picture.dtype), 1.0)
    return np.clip(picture.astype(np.float64) / largest, 0.0, 1.0)
