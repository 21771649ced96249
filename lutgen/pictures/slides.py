"""Whole slides (.svs, .ndpi, .mrxs) through OpenSlide, an optional extra: level 0, region by region.

Colours are taken as stored; a scanner's ICC profile is not applied, as for other images.
"""

from __future__ import annotations

from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError
from lutgen.names import SIGNAL
from lutgen.pictures.encoding import Storage

if TYPE_CHECKING:
    from collections.abc import Iterator
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
