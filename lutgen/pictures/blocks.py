"""An image or a slide block by block, each with its place, so that memory does not grow with the picture.

Whole slides (.svs, .ndpi, .mrxs) are read through OpenSlide, an optional extra: level 0, region by region. Colours are
taken as stored; a scanner's ICC profile is not applied, as for other images.
"""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lutgen.errors import LutgenError
from lutgen.names import SIGNAL
from lutgen.pictures.encoding import Storage
from lutgen.pictures.images import open_source
from lutgen.pictures.threads import threads

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from lutgen.pictures.encoding import Stored

#: Files that are read through OpenSlide. By name, because their first bytes are those of TIFF or JPEG.
SUFFIXES = (".svs", ".ndpi", ".mrxs")

#: Pixels along a region's side; a multiple of every usual tile's side, so that no tile is decoded twice.
REGION = 1024

#: The vendor whose scanner leaves out what holds no tissue: only there are missing tiles what was meant.
_SPARSE = "mirax"


class Slide:
    """An open slide: what is in it, region by region."""

    storage = Storage(np.dtype(np.uint8), SIGNAL, alpha=True)

    def __init__(self, path: Path, slide: Any) -> None:
        """Take a slide that OpenSlide has opened."""
        self.path, self._slide = path, slide
        self.width, self.height = slide.dimensions
        self._sparse = slide.properties.get("openslide.vendor") == _SPARSE

    def regions(self) -> list[tuple[int, int]]:
        """Left and upper corner of every region of level 0, row by row."""
        return [(x, y) for y in range(0, self.height, REGION) for x in range(0, self.width, REGION)]

    def read(self, x: int, y: int) -> Stored:
        """Read the region at (x, y): (rows, columns, 4); alpha is 0 where nothing was scanned. From any thread.

        Raises
        ------
        LutgenError
            The file is damaged there, or a tile is missing.

        """
        size = (min(REGION, self.width - x), min(REGION, self.height - y))
        try:
            region = np.asarray(self._slide.read_region((x, y), 0, size))
        except _openslide().OpenSlideError as error:
            message = f"{self.path}: the slide is damaged near pixel ({x}, {y}): {error}. Get a whole copy."
            raise LutgenError(message) from None
        missing = region[..., 3] == 0
        if missing.any() and not self._sparse:
            row, column = divmod(int(missing.argmax()), size[0])
            message = (
                f"{self.path}: the tile at pixel ({x + column}, {y + row}) is missing, so the slide cannot be counted "
                f"whole. Get a whole copy, or export the part that you need as TIFF."
            )
            raise LutgenError(message)
        return region


@contextmanager
def open_slide(path: Path) -> Iterator[Slide]:
    """Open a slide.

    Raises
    ------
    LutgenError
        OpenSlide is not installed, or the file is missing or no slide that it reads.

    """
    library = _openslide()
    if not path.is_file():
        raise LutgenError(f"{path}: there is no such slide.")
    try:
        slide = library.OpenSlide(str(path))
    except library.OpenSlideError as error:
        why = str(error).rstrip(".")
        message = f"{path}: OpenSlide cannot read this slide: {why}. Get a whole copy, or export it as tiled TIFF."
        raise LutgenError(message) from None
    with slide:
        yield Slide(path, slide)


def _openslide() -> Any:
    try:
        return import_module("openslide")
    except ImportError as error:
        message = (
            f"slides ({', '.join(SUFFIXES)}) are read through OpenSlide, which cannot be imported ({error}). Install "
            "it with `pip install lutgen[slides]`, or export the slide as TIFF."
        )
        raise LutgenError(message) from None


class Place(NamedTuple):
    """Rows and columns of a block, from (inclusive) and to (exclusive)."""

    top: int
    bottom: int
    left: int
    right: int


@dataclass(frozen=True)
class Blocks:
    """An open picture.

    Attributes
    ----------
    storage
        How its pixels are stored.
    height, width
        In pixels, as stored.
    tile
        Height and width of the file's tiles, in whole ones of which blocks are cut; None: blocks are whole rows.
    orientation
        The file's wish to be turned or mirrored, 1 to 8, as TIFF has it; 1: none.
    places
        Of all blocks, row by row.
    workers
        Blocks that may be read at the same time.

    """

    storage: Storage
    height: int
    width: int
    tile: tuple[int, int] | None
    orientation: int
    places: tuple[Place, ...]
    _read: Callable[[Place], Stored]
    workers: int = 1

    def read(self, progress: Callable[[int, int], None]) -> Iterator[tuple[Place, Stored]]:
        """Give each block, (rows, columns, channels), and read the next ones meanwhile. Errors as ``open_source``."""
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
    """Open a picture; ``source`` as for ``apply``.

    Raises
    ------
    LutgenError
        A file that is missing or cannot be read, as :func:`open_source` and :func:`open_slide` say.

    """
    if path.suffix.lower() in SUFFIXES:
        with open_slide(path) as slide:
            places = tuple(
                Place(y, min(y + REGION, slide.height), x, min(x + REGION, slide.width)) for x, y in slide.regions()
            )
            yield Blocks(
                storage=slide.storage,
                height=slide.height,
                width=slide.width,
                tile=(REGION, REGION),
                orientation=1,
                places=places,
                _read=lambda place: slide.read(place.left, place.top),
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
            orientation=int(spec.get_int_attribute("Orientation", 1)),
            places=tuple(Place(*block) for block in image.blocks()),
            _read=lambda place: image.read(*place),
        )
