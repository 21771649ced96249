"""Read an image or a slide block by block, so that memory does not grow with its size; or read a whole field of view.

Whole slides (.svs, .ndpi, .mrxs) are read through OpenSlide, an optional extra: level 0, region by region. Colours are
used as stored: as for other images, a scanner's ICC profile is not applied.

Work that needs the neighbours of a pixel, such as segmentation of nuclei, holds one field of view in memory. The
field's colours have 16 bits per channel. Colours of 8- and 16-bit images are exact, those of float images are rounded.
"""

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.bindings import optional
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError
from lutgen.names import SIGNAL
from lutgen.pictures.encoding import Decoder, NotFiniteError, Storage, Stored, joined, level_of, levels_of, not_finite
from lutgen.pictures.images import open_source, turned
from lutgen.progress import Progress

#: Threads that the current work may use; 0: one for each core.
_FEW = ContextVar("lutgen_threads", default=0)


def threads() -> int:
    """Return the number of threads to use: as :func:`few_threads` set it, else the cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return _FEW.get() or cores


@contextmanager
def few_threads(count: int) -> Iterator[None]:
    """Use at most ``count`` threads in the ``with`` block; 0: one for each core. For processes that share cores."""
    before = _FEW.set(count)
    try:
        yield
    finally:
        _FEW.reset(before)


#: Suffixes of files that are read through OpenSlide. The first bytes of such files are those of TIFF or JPEG.
SUFFIXES = (".svs", ".ndpi", ".mrxs")

#: Side of a region in pixels: a multiple of the side of every usual tile, so that no tile is decoded twice.
REGION = 1024


def _openslide() -> Any:
    use = f"slides ({', '.join(SUFFIXES)}) are read through OpenSlide"
    return optional("openslide", use, extra="slides", otherwise="export the slide as TIFF")


class Place(NamedTuple):
    """Rows and columns of a block, from (inclusive) and to (exclusive)."""

    top: int
    bottom: int
    left: int
    right: int


def _region(path: Path, slide: Any, place: Place) -> Stored:
    """Read a region of a slide that OpenSlide has opened, (rows, columns, 4); alpha 0: not scanned."""
    size = (place.right - place.left, place.bottom - place.top)
    try:
        region = np.asarray(slide.read_region((place.left, place.top), 0, size))
    except _openslide().OpenSlideError as error:
        message = f"{path}: the slide is damaged near pixel ({place.left}, {place.top}): {error}. Get a whole copy."
        raise LutgenError(message) from None
    missing = region[..., 3] == 0
    # Scanners of mirax store no tiles without tissue. In slides of other vendors a missing tile is damage.
    if missing.any() and slide.properties.get("openslide.vendor") != "mirax":
        row, column = divmod(int(missing.argmax()), size[0])
        raise LutgenError(
            f"{path}: the tile at pixel ({place.left + column}, {place.top + row}) is missing, so the slide cannot be "
            f"counted whole. Get a whole copy, or export the part that you need as TIFF."
        )
    return region


def _opened_slide(path: Path) -> Any:
    library = _openslide()
    if not path.is_file():
        raise LutgenError(f"{path}: there is no such slide.")
    try:
        return library.OpenSlide(str(path))
    except library.OpenSlideError as error:
        why = str(error).rstrip(".")
        message = f"{path}: OpenSlide cannot read this slide: {why}. Get a whole copy, or export it as tiled TIFF."
        raise LutgenError(message) from None


@dataclass(frozen=True)
class Blocks:
    """An image or a slide that is open for reading, block by block."""

    #: How the picture stores its pixels.
    storage: Storage
    #: Size in pixels, as stored.
    height: int
    width: int
    #: Height and width of the file's tiles; a block is a number of whole tiles. None: blocks are whole rows.
    tile: tuple[int, int] | None
    #: TIFF's Orientation, 1 to 8: how viewers turn or mirror the picture; 1: as stored.
    orientation: int
    #: Places of all blocks, row by row.
    places: tuple[Place, ...]
    #: Reads one block.
    _read: Callable[[Place], Stored]
    #: Number of blocks that may be read at the same time.
    workers: int = 1

    def read(self, progress: Progress) -> Iterator[tuple[Place, Stored]]:
        """Yield each block, (rows, columns, channels), while the next blocks are read. Errors as ``open_source``."""
        with ThreadPoolExecutor(self.workers) as files:
            running = deque(files.submit(self._read, place) for place in self.places[: self.workers])
            try:
                for number, place in enumerate(self.places, 1):
                    stored = running.popleft().result()
                    following = number - 1 + self.workers
                    running += [files.submit(self._read, each) for each in self.places[following : following + 1]]
                    yield place, stored
                    progress(number, len(self.places))
            finally:
                for each in running:
                    each.cancel()


@contextmanager
def open_blocks(path: Path, source: str = "auto") -> Iterator[Blocks]:
    """Open a picture; ``source`` as for ``apply``. Raises LutgenError: as :func:`open_source`, or no OpenSlide."""
    if path.suffix.lower() in SUFFIXES:
        with _opened_slide(path) as slide:
            width, height = slide.dimensions
            yield Blocks(
                storage=Storage(np.dtype(np.uint8), SIGNAL, alpha=True),
                height=height,
                width=width,
                tile=(REGION, REGION),
                orientation=1,
                places=tuple(
                    Place(y, min(y + REGION, height), x, min(x + REGION, width))
                    for y in range(0, height, REGION)
                    for x in range(0, width, REGION)
                ),
                _read=partial(_region, path, slide),
                workers=threads(),
            )
        return
    with open_source(path, source) as image:
        spec = image.spec
        yield Blocks(
            storage=image.storage,
            height=image.height,
            width=image.width,
            tile=(int(spec.tile_height), int(spec.tile_width)) if spec.tile_width else None,
            orientation=image.orientation,
            places=tuple(Place(*block) for block in image.blocks()),
            _read=lambda place: image.read(*place),
        )


#: Pixels of the largest field: 4096 × 4096. About ten thousand nuclei take half a minute and up to 2 GB on two cores.
FIELD_PIXELS = 1 << 24

#: A truth value for each pixel, shape (rows, columns).
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Field:
    """A field of view, held whole in memory."""

    #: Its path.
    file: str
    #: Colour of each pixel as one number, shape (rows, columns).
    keys: NDArray[np.uint64]
    #: Where alpha is not 0, shape (rows, columns).
    visible: Mask

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.keys.shape
        return rows, columns

    def rgb(self) -> NDArray[np.uint8]:
        """Return 8-bit code values, as a screen shows them, (rows, columns, 3); invisible pixels are white."""
        pixels = np.full((*self.shape, 3), 255, np.uint8)
        for channel in range(3):
            level = level_of(self.keys, channel, 16)
            pixels[..., channel][self.visible] = ((level + np.uint64(128)) // np.uint64(257))[self.visible]
        return pixels


def code_of(keys: NDArray[np.uint64]) -> Array:
    """Return the code values of colours given as keys: (n,) → (n, 3) in 0..1."""
    return np.asarray(levels_of(keys, 16).T / 65535.0)


def read_field(file: str | Path, source: str = "auto") -> Field:
    """Read a field of view of at most ``FIELD_PIXELS`` pixels, turned as viewers turn it.

    Raises LutgenError: unreadable, or only one colour.
    """
    path = Path(file)
    if path.suffix.lower() in SUFFIXES:
        raise LutgenError(
            f"{file}: is a slide. Give a field of it, at most {FIELD_PIXELS:,} pixels, exported as TIFF or PNG."
        )
    with open_source(path, source) as image:
        if image.height * image.width > FIELD_PIXELS:
            raise LutgenError(
                f"{file}: {image.width} × {image.height} pixels are more than the {FIELD_PIXELS:,} in which nuclei are "
                "looked for. Crop a field of view, such as 4096 × 4096 pixels."
            )
        decoder = Decoder(image.storage, SIGNAL)
        keys = np.empty((image.height, image.width), np.uint64)
        visible = np.ones(keys.shape, np.bool_)
        for first, last in image.bands():
            stored = image.read(first, last)
            if image.storage.alpha:
                visible[first:last] = stored[..., 3] != 0
                stored = np.where(visible[first:last, :, np.newaxis], stored, np.zeros((), stored.dtype))
            try:
                planes, _ = decoder(stored.reshape(-1, image.storage.channels))
            except NotFiniteError as error:
                row, column = divmod(error.index, image.width)
                raise not_finite(file, column, first + row) from None
            keys[first:last] = joined(np.rint(planes * 65535.0), 16).reshape(last - first, image.width)
    keys, visible = turned(keys, image.orientation), turned(visible, image.orientation)
    if not visible.any():
        raise LutgenError(f"{file}: every pixel is transparent (alpha 0): there is nothing to see.")
    seen = keys[visible]
    if (seen == seen[0]).all():
        raise LutgenError(f"{file}: all pixels have one colour, so that nothing stands out. Give an image of tissue.")
    return Field(str(file), keys, visible)
