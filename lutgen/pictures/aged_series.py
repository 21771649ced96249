"""``aged_series``: one image at several ages, as a person sees it whole on a screen, with its ΔE2000 at each.

A large image is made smaller first, by means of light over squares, and aged then: that is what a viewer does that
shows a large image whole. Its ΔE2000 are those of all its pixels, as ``lifetime`` finds them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import linear_to_code
from lutgen.errors import LutgenError, pick_one
from lutgen.names import AGING_MODES, SOURCES
from lutgen.pictures.blocks import open_blocks
from lutgen.pictures.difference import DifferenceCurve, curves_of
from lutgen.pictures.distinct import count_colours
from lutgen.pictures.frame import Grid, light_means, whole_factor

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.display import DisplayModel

Pixels = NDArray[np.uint8]

#: Code value of L* = 50, which stands where alpha is 0.
GREY = 119

#: Pixels of the longest side of a picture.
LONGEST = 1000


@dataclass(frozen=True)
class AgedSeries:
    """One image at several ages.

    Attributes
    ----------
    file
        Its path.
    model
        The display.
    source
        The image as it is sent to the display, uint8 of shape (h, w, 3): its code values, or means over ``factor`` ×
        ``factor`` pixels.
    factor
        1 for images that are no larger than was asked for.
    pixels, colours
        How many pixels count for ΔE2000, and of how many distinct colours.
    curves
        Mode → ΔE2000 at hour 0 and the hours asked for.

    """

    file: str
    model: DisplayModel
    source: Pixels
    factor: int
    pixels: int
    colours: int
    curves: dict[str, DifferenceCurve]

    @property
    def hours(self) -> list[float]:
        """Hour 0 and those asked for, increasing."""
        return [float(hour) for hour in next(iter(self.curves.values())).hours]

    def seen(self, mode: str, hours: float) -> Pixels:
        """Show the image as an un-aged sRGB viewer shows what the display makes of it, uint8 of shape (h, w, 3)."""
        flat = self.source.reshape(-1, 3).astype(np.uint32)
        colours, which = np.unique(flat[:, 0] << 16 | flat[:, 1] << 8 | flat[:, 2], return_inverse=True)
        code = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1) / 255.0
        aged = np.clip(self.model.at(mode, hours).code_to_code(code), 0.0, 1.0)
        return np.rint(255.0 * aged).astype(np.uint8)[which].reshape(self.source.shape)

    def told(self, mode: str, hours: float) -> str:
        """Say the mean ΔE2000 at one of the hours."""
        curve = self.curves[mode]
        (place,) = np.flatnonzero(curve.hours == hours)
        return f"mean ΔE2000 {curve.mean[place]:.1f}"


def aged_series(
    image: str | Path,
    model: DisplayModel,
    modes: Sequence[str],
    hours: Sequence[float],
    *,
    longest: int = LONGEST,
    source: str = "auto",
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> AgedSeries:
    """Look at an image at several ages.

    Parameters
    ----------
    image
        PNG, JPEG, TIFF, EXR, RGB or RGBA; slides (.svs, .ndpi, .mrxs) with the extra ``slides``.
    model
        The display.
    modes, hours
        Modes that age, and operating hours; hour 0 is added.
    longest
        Pixels of the longest side; a larger image is made smaller by a whole factor.
    source
        What the numbers of the image are: ``auto``, ``signal`` or ``linear``, as for ``apply``.
    progress
        Called with the work done and the work in all, in thousandths.

    Raises
    ------
    LutgenError
        An image that cannot be read, a mode that does not age, an unknown source, a size below 1, or an hour outside
        the measured span or the luminance law's.

    """
    path = Path(image)
    for mode in modes:
        if mode not in AGING_MODES:
            raise pick_one("mode that ages", mode, AGING_MODES)
    if source not in SOURCES:
        raise pick_one("source", source, SOURCES)
    if longest < 1:
        raise LutgenError(f"a longest side of {longest} pixels shows nothing. Give at least 1, such as {LONGEST}.")
    chosen = sorted({0.0, *map(float, hours)})
    for mode, hour in product(modes, chosen):
        model.at(mode, hour)
    colours = count_colours(path, source, lambda done, total: progress(400 * done // total, 1000))
    with open_blocks(path, source) as blocks:
        factor = whole_factor(blocks.height, blocks.width, longest)
        grid = Grid.squares(blocks.height, blocks.width, factor)
        light = light_means(blocks, grid, lambda done, total: progress(400 + 400 * done // total, 1000))
    code = np.where(np.isfinite(light), linear_to_code(np.nan_to_num(light)), GREY / 255.0)
    return AgedSeries(
        file=str(image),
        model=model,
        source=np.rint(255.0 * code).astype(np.uint8),
        factor=factor,
        pixels=colours.pixels,
        colours=len(colours),
        curves=curves_of(
            colours, model, modes, chosen, lambda done, total: progress(800 + 200 * done // max(total, 1), 1000)
        ),
    )
