"""An image or a slide block by block, each with its place, so that memory does not grow with the picture."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from lutgen.pictures.images import open_source
from lutgen.pictures.slides import REGION, SUFFIXES, open_slide

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from lutgen.pictures.encoding import Storage, Stored


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

    """

    storage: Storage
    height: int
    width: int
    tile: tuple[int, int] | None
    orientation: int
    places: tuple[Place, ...]
    _read: Callable[[Place], Stored]

    def read(self, progress: Callable[[int, int], None]) -> Iterator[tuple[Place, Stored]]:
        """Give each block, (rows, columns, channels), the next one being read meanwhile. Errors as ``open_source``."""
        with ThreadPoolExecutor(1) as files:
            reading = files.submit(self._read, self.places[0])
            for number, place in enumerate(self.places, 1):
                stored = reading.result()
                if number < len(self.places):
                    reading = files.submit(self._read, self.places[number])
                yield place, stored
                progress(number, len(self.places))


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
