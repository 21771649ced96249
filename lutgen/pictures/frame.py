"""A picture reduced to the size of a screen, as displays show it hour by hour.

Each pixel of the reduced picture is the mean, in linear light, of the area that it covers. The means are summed block
by block. A small image is not reduced. The reduced picture is aged, as in a viewer that shows a large image whole. The
ΔE2000 are computed over all pixels of the original image, as in ``lifetime``.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, linear_to_code
from lutgen.display import AgedDisplay, DisplayModel
from lutgen.display.chain import viewer_code
from lutgen.display.on_screen import OnScreen, linear_at
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import AGING_MODES, LINEAR, SOURCES
from lutgen.pictures.blocks import Blocks, Place, open_blocks
from lutgen.pictures.difference import DifferenceCurve, curves_of, differences, statistics
from lutgen.pictures.distinct import count_colours
from lutgen.pictures.encoding import Decoder, Storage, Stored, joined, levels_of
from lutgen.pictures.images import turned, turned_size
from lutgen.progress import Progress, part_of, unseen

#: Pixels converted to double precision at a time.
BAND = 1 << 17

#: Code values, shape (height, width, 3).
Pixels = NDArray[np.uint8]


class Grid(NamedTuple):
    """Cells over a picture: their edges in pixels from the upper left corner, shapes (h + 1,) and (w + 1,)."""

    rows: Array
    columns: Array

    @classmethod
    def squares(cls, height: int, width: int, factor: int) -> Self:
        """Divide a picture into squares of ``factor`` × ``factor`` pixels, smaller at the lower and right edge."""
        rows, columns = (np.append(np.arange(0.0, length, factor), length) for length in (height, width))
        return cls(rows, columns)


def whole_factor(height: int, width: int, longest: int) -> int:
    """Return the smallest whole factor that reduces both sides to at most ``longest``."""
    return -(-max(height, width) // longest)


class AreaMeans:
    """Means over the cells of a grid. A pixel on an edge counts in each cell by the share of its area in the cell."""

    def __init__(self, grid: Grid, channels: int) -> None:
        """Begin with sums of 0; ``channels`` is the number of channels of the values that :meth:`add` gets."""
        self._grid = grid
        self._sums = np.zeros((len(grid.rows) - 1, len(grid.columns) - 1, channels + 1))

    def add(self, place: Place, values: Array, counted: Array) -> None:
        """Add a block: values (rows, columns, channels), and which pixels count, 0 or 1, (rows, columns)."""
        sums = np.zeros((*counted.shape, self._sums.shape[2]))
        np.copyto(sums[..., :-1], values, where=counted[..., np.newaxis] > 0)
        sums[..., -1] = counted
        cells = []
        spans = (place.top, place.bottom), (place.left, place.right)
        for axis, (edges, (start, stop)) in enumerate(zip(self._grid, spans, strict=True)):
            first = int(np.searchsorted(edges, start, side="right")) - 1
            last = int(np.searchsorted(edges, stop, side="left"))
            sums = _cut(sums, np.clip(edges[first : last + 1], start, stop) - start, axis)
            cells.append(slice(first, last))
        self._sums[tuple(cells)] += sums

    def means(self) -> Array:
        """Return the reduced picture, (h, w, channels); NaN where no pixel counts. Do not call :meth:`add` after it."""
        # The result overwrites the sums, which take most of the memory if there are many cells.
        sums, counted = self._sums[..., :-1], self._sums[..., -1:]
        np.divide(sums, counted, out=sums, where=counted > 0)
        np.copyto(sums, np.nan, where=counted == 0)
        np.copyto(counted, 1.0, where=counted > 0)
        return sums


def light_means(blocks: Blocks, grid: Grid, progress: Progress = unseen) -> Array:
    """Return the mean linear light of each cell, (h, w, 3); NaN: all transparent. NaN in the file is read as black."""
    decoder, means = Decoder(blocks.storage, LINEAR), AreaMeans(grid, 3)
    for place, stored in blocks.read(progress):
        # A whole block in double precision takes many times the memory of the stored block.
        for rows in bands(*stored.shape[:2]):
            band = place._replace(top=place.top + rows.start, bottom=place.top + rows.stop)
            means.add(band, *_light(stored[rows], blocks.storage, decoder))
    return means.means()


def bands(height: int, width: int) -> Iterator[slice]:
    """Divide rows of pixels into bands of at most ``BAND`` pixels, or of one row."""
    rows = max(BAND // width, 1)
    return (slice(top, min(top + rows, height)) for top in range(0, height, rows))


def _light(stored: Stored, storage: Storage, decoder: Decoder) -> tuple[Array, Array]:
    """Return the linear light of a block, (rows, columns, 3), and 1 where alpha is not 0, else 0, (rows, columns)."""
    flat = np.where(np.isfinite(stored), stored, 0).astype(stored.dtype).reshape(-1, storage.channels)
    if not storage.alpha:
        return decoder(flat)[0].T.reshape(*stored.shape[:2], 3), np.ones(stored.shape[:2])
    seen = flat[:, 3] != 0
    light = np.zeros((len(flat), 3))
    light[seen] = decoder(flat[seen])[0].T
    return light.reshape(*stored.shape[:2], 3), seen.astype(np.float64).reshape(stored.shape[:2])


def _cut(values: Array, edges: Array, axis: int) -> Array:
    """Add up values between consecutive ``edges`` along an axis; an edge within a pixel divides the pixel's value."""
    whole = edges.astype(np.intp)
    sums = np.add.reduceat(values, whole[:-1], axis=axis)
    across = np.moveaxis(sums, axis, 0)
    # For two edges within one pixel, reduceat returns the whole pixel.
    across[whole[:-1] == whole[1:]] = 0.0
    share = (edges - whole).reshape(-1, *[1] * (values.ndim - 1))
    if share.any():
        straddling = np.moveaxis(values, axis, 0)[np.minimum(whole, values.shape[axis] - 1)]
        across += np.diff(share * straddling, axis=0)
    return sums


@dataclass(frozen=True)
class Frame:
    """An 8-bit picture, stored as its distinct colours and an index for each pixel."""

    #: Distinct colours, code values 0..255, shape (n, 3).
    colours: Pixels
    #: Index of each pixel's colour, shape (h, w).
    places: NDArray[np.intp]
    #: Whether each pixel is visible: its alpha is not 0; (h, w).
    visible: NDArray[np.bool_]
    #: Size of the original image, turned as this picture is.
    source_width: int
    source_height: int
    #: Where on the screen the picture lies; None: all pixels lie at one place.
    on_screen: OnScreen | None = None

    @classmethod
    def of(
        cls, code: Pixels, visible: NDArray[np.bool_], width: int, height: int, on_screen: OnScreen | None = None
    ) -> Self:
        """Take code values (h, w, 3), visible pixels (h, w), and width and height of the original image."""
        keys, places = np.unique(joined(code.reshape(-1, 3).T, 8, np.uint32), return_inverse=True)
        colours = levels_of(keys, 8).T.astype(np.uint8)
        return cls(colours, places.reshape(code.shape[:2]), visible, width, height, on_screen)

    @property
    def code(self) -> Pixels:
        """The code values, (h, w, 3)."""
        return np.asarray(self.colours[self.places])

    @property
    def width(self) -> int:
        """Number of pixels in a row."""
        return int(self.places.shape[1])

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.places.shape[0])

    @property
    def whole(self) -> bool:
        """Whether the picture has every pixel of the original image."""
        return (self.width, self.height) == (self.source_width, self.source_height)

    def shown(self, display: AgedDisplay) -> Pixels:
        """Return how an un-aged sRGB viewer shows the picture on a display, code values (h, w, 3)."""
        if self.on_screen:
            linear = linear_at(display, self.code.reshape(-1, 3) / 255.0, self._where(self.on_screen))
            return np.rint(viewer_code(linear) * 255.0).astype(np.uint8).reshape(*self.places.shape, 3)
        code = np.rint(display.code_to_code(self.colours / 255.0) * 255.0).astype(np.uint8)
        return np.asarray(code[self.places])

    def differences(self, unaged: AgedDisplay, aged: Sequence[AgedDisplay]) -> Array:
        """Return ΔE2000 of each pixel between the un-aged and each aged display: shape (len(aged), h, w)."""
        code = self.colours / 255.0
        if self.on_screen:
            which, where = self.places.ravel(), self._where(self.on_screen)
            values = differences(lambda part: code[which[part]], which.size, unaged, aged, places=where.__getitem__)
            return values.reshape(len(aged), *self.places.shape)
        return differences(code.__getitem__, len(code), unaged, aged)[:, self.places]

    def curve(self, unaged: AgedDisplay, aged: Sequence[AgedDisplay]) -> DifferenceCurve:
        """Return the curve of a mode's displays, by hour, over the visible pixels."""
        values = self.differences(unaged, aged)[:, self.visible]
        figures = np.array([statistics(each, np.ones(len(each), np.int64)) for each in values])
        return DifferenceCurve(np.array([each.hours for each in aged]), *figures.T)

    def _where(self, on_screen: OnScreen) -> Array:
        """Return the place of each pixel on the screen, (h·w, 2)."""
        return on_screen.places(0, self.places.size, self.places.shape)


def read_frame(path: Path, *, pixels: int, width: int, source: str = "auto", progress: Progress = unseen) -> Frame:
    """Read a picture, reduced to at most ``pixels`` pixels and ``width`` in a row; NaN is black. Raises LutgenError."""
    code, visible, size = read_pixels(path, pixels=pixels, width=width, source=source, progress=progress)
    return Frame.of(code, visible, *size)


def read_pixels(
    path: Path, *, pixels: int, width: int, source: str = "auto", progress: Progress = unseen
) -> tuple[Pixels, NDArray[np.bool_], tuple[int, int]]:
    """Return, as :func:`read_frame`, code values (h, w, 3), visible pixels (h, w), and the image's width and height."""
    with open_blocks(path, source) as opened:
        high, wide = fitting(opened.height, opened.width, pixels, width)
        grid = Grid(np.linspace(0.0, opened.height, high + 1), np.linspace(0.0, opened.width, wide + 1))
        linear = light_means(opened, grid, progress)
        size = turned_size(opened.width, opened.height, opened.orientation)
    linear = turned(linear, opened.orientation)
    code = np.empty(linear.shape, np.uint8)
    for rows in bands(*linear.shape[:2]):
        code[rows] = np.rint(linear_to_code(np.clip(np.nan_to_num(linear[rows]), 0.0, 1.0)) * 255.0)
    return code, np.isfinite(linear[..., 0]), size


def fitting(height: int, width: int, pixels: int, most: int) -> tuple[int, int]:
    """Return height and width of the largest frame within the limits: not larger than the image, at least 1 × 1."""
    share = min((pixels / (height * width)) ** 0.5, most / width, 1.0)
    # Rounding errors may make a whole number of pixels too small by up to a millionth.
    return max(int(height * share + 1e-6), 1), max(int(width * share + 1e-6), 1)


#: Code value of L* = 50, shown in place of pixels of alpha 0.
GREY = 119

#: Longest side of a picture in pixels.
LONGEST = 1000


@dataclass(frozen=True)
class AgedSeries:
    """One image at several ages."""

    #: Path of the image.
    file: str
    #: The display.
    model: DisplayModel
    #: The image as it is sent to the display, turned as viewers turn it: its code values, or means over ``factor`` ×
    #: ``factor`` pixels.
    frame: Frame
    #: 1 for images that are not reduced.
    factor: int
    #: Number of pixels that count for ΔE2000.
    pixels: int
    #: Mode → ΔE2000 at hour 0 and the chosen hours.
    curves: dict[str, DifferenceCurve]

    @property
    def hours(self) -> list[float]:
        """Hour 0 and the chosen hours, increasing."""
        return [float(hour) for hour in next(iter(self.curves.values())).hours]

    def seen(self, mode: str, hours: float) -> Pixels:
        """Return how an un-aged sRGB viewer shows the image on the aged display, uint8 of shape (h, w, 3)."""
        on_screen = self.frame.on_screen
        if on_screen and mode == "stable":
            return self.frame.shown(on_screen.unaged(self.model))
        return self.frame.shown(self.model.at(mode, hours))

    def mean_in_words(self, mode: str, hours: float) -> str:
        """Return the mean ΔE2000 at one of the hours, as text for captions."""
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
    on_screen: OnScreen | None = None,
    source: str = "auto",
    progress: Progress = unseen,
) -> AgedSeries:
    """Age an image, reduced to at most ``longest`` pixels per side, to several hours; ``progress`` in thousandths."""
    path = Path(image)
    for mode in modes:
        refuse_unknown("mode that ages", mode, AGING_MODES)
    refuse_unknown("source", source, SOURCES)
    if longest < 1:
        raise LutgenError(f"a longest side of {longest} pixels shows nothing. Give at least 1, such as {LONGEST}.")
    chosen = sorted({0.0, *map(float, hours)})
    for mode, hour in product(modes, chosen):
        model.at(mode, hour)
    colours = count_colours(path, source, part_of(progress, 0, 400))
    with open_blocks(path, source) as blocks:
        factor = whole_factor(blocks.height, blocks.width, longest)
        grid = Grid.squares(blocks.height, blocks.width, factor)
        light = turned(light_means(blocks, grid, part_of(progress, 400, 400)), blocks.orientation)
        size = turned_size(blocks.width, blocks.height, blocks.orientation)
    seen = np.isfinite(light)
    code = np.rint(255.0 * np.where(seen, linear_to_code(np.nan_to_num(light)), GREY / 255.0)).astype(np.uint8)
    frame = Frame.of(code, seen[..., 0], *size, on_screen)
    if on_screen:
        unaged, pixels = on_screen.unaged(model), int(frame.visible.sum())
        curves = {mode: frame.curve(unaged, [model.at(mode, hour) for hour in chosen]) for mode in modes}
    else:
        curves, pixels = curves_of(colours, model, modes, chosen, part_of(progress, 800, 200)), colours.pixels
    return AgedSeries(str(image), model, frame, factor, pixels, curves)


def plain_png(pixels: Pixels) -> bytes:
    """Return the uncompressed PNG of pixels (h, w, 3), without gamma or text, since some programs apply the gamma."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "png", compress_level=0)
    return file.getvalue()
