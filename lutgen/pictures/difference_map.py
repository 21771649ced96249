"""``difference_map``: ΔE2000 of every pixel between the un-aged and the aged display, the paper's Figure 6.

The file is read twice. The first pass counts distinct colours, from which the statistics are computed as in
``lifetime``. The second pass computes ΔE2000 of each pixel: of 8-bit pixels by a table of colours, of other pixels from
their own code values, not from the centre of a bin. The map to look at is smaller than a large picture: its pixels are
means over squares. The map in numbers (EXR, TIFF: one channel of single floats) has every pixel; those of alpha 0 are
NaN.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.bindings import oiio
from lutgen.colorimetry import Array
from lutgen.display import AgedDisplay, DisplayModel, seen_on, what_pictures_carry
from lutgen.display.on_screen import OnScreen
from lutgen.errors import LutgenError, pick_one, refuse_unknown
from lutgen.files import check_name, check_new_file, replacing
from lutgen.names import AGING_MODES, MAP_SUFFIXES, SIGNAL, SOURCES
from lutgen.pictures.blocks import Blocks, Place, open_blocks
from lutgen.pictures.difference import differences, statistics
from lutgen.pictures.distinct import Counts, count_colours
from lutgen.pictures.encoding import Decoder, Keys, Storage, Stored, joined
from lutgen.pictures.frame import LONGEST, AreaMeans, Grid, whole_factor
from lutgen.pictures.images import new_by_oiio, turned
from lutgen.pictures.lifetime import binning_error
from lutgen.progress import Progress, part_of, unseen

#: Width of the histogram's bins in ΔE2000.
BIN = 0.1

#: Most pixels of a picture on a screen: the pixels of 8K.
MOST_PLACED = 7680 * 4320

Singles = NDArray[np.float32]

#: Function from pixels as stored, (n, channels), and their places, (n, 2) or None, to their ΔE2000, (n,).
Find = Callable[[Stored, Array | None], Singles]


@dataclass(frozen=True)
class DifferenceMap:
    """ΔE2000 of an image's pixels in one mode at one hour."""

    #: The image, the mode and the hour.
    file: str
    mode: str
    hours: float
    #: The display.
    model: DisplayModel
    #: Number of pixels with alpha above 0, and of their distinct colours.
    pixels: int
    colours: int
    #: Largest error of a statistic because colours were counted in bins, as in ``lifetime``; 0: exact. The maps
    #: themselves are always exact.
    binning_error: float
    #: Statistics as in ``DifferenceCurve``.
    mean: float
    sd: float
    p95: float
    p99: float
    largest: float
    #: The map to look at, (h, w), turned as viewers turn the image: means over ``factor`` × ``factor`` pixels. NaN: all
    #: pixels are transparent.
    shown: Array
    #: 1 for images of up to ``LONGEST`` pixels per side.
    factor: int
    #: ΔE2000 of each distinct colour, and its number of pixels, both (n,); with ``on_screen`` an entry for each pixel.
    values: Array = field(repr=False)
    counts: Counts = field(repr=False)
    #: Where on the screen the image lies; None: all pixels lie at one place.
    on_screen: OnScreen | None = None

    def share(self, above: float) -> float:
        """Return the share of the pixels whose ΔE2000 is larger than ``above``."""
        return float(self.counts[self.values > above].sum() / self.pixels)

    def histogram(self) -> NDArray[np.int64]:
        """Return the number of pixels in bins of ``BIN`` ΔE2000 from 0 to the largest ΔE2000, shape (n,)."""
        bins: NDArray[np.intp] = (self.values / BIN).astype(np.intp)
        return np.rint(np.bincount(bins, self.counts)).astype(np.int64)

    def remarks(self) -> list[str]:
        """Return sentences on the viewing conditions of the display; none where the model depends on none."""
        return what_pictures_carry(self.model, self.on_screen)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: see ``lutgen/pictures/schema/map.json``."""
        named = ("file", "mode", "hours", "pixels", "colours", "binning_error")
        return {
            "schema": 1,
            **seen_on(self.model, self.on_screen),
            **{name: getattr(self, name) for name in named},
            "delta_e": {
                "mean": self.mean,
                "sd": self.sd,
                "mean_plus_2_sd": self.mean + 2.0 * self.sd,
                "p95": self.p95,
                "p99": self.p99,
                "max": self.largest,
            },
            "histogram": {"bin": BIN, "pixels": [int(count) for count in self.histogram()]},
        }


def difference_map(
    image: str | Path,
    model: DisplayModel,
    mode: str,
    hours: float,
    *,
    floats: Sequence[str | Path] = (),
    on_screen: OnScreen | None = None,
    source: str = "auto",
    force: bool = False,
    progress: Progress = unseen,
) -> DifferenceMap:
    """Compute ΔE2000 of each pixel; arguments as in :func:`.frame.aged_series`. Also write the map to ``floats``."""
    path = Path(image)
    refuse_unknown("mode that ages", mode, AGING_MODES)
    refuse_unknown("source", source, SOURCES)
    model.at(mode, hours)
    files = [_check_floats(Path(file), path, force=force) for file in floats]
    colours = count_colours(path, source, part_of(progress, 0, 500))
    unaged, aged = (on_screen or OnScreen).unaged(model), model.at(mode, hours)
    values, counts = np.zeros(0), colours.counts
    if not on_screen:
        (values,) = differences(colours.code, len(colours), unaged, [aged])
    each_pixel: list[Singles] = []
    with open_blocks(path, source) as blocks:
        if on_screen:
            check_placed(str(image), blocks.height, blocks.width)
        eight_bits = blocks.storage.dtype == np.uint8 and not blocks.storage.associated
        if eight_bits and not on_screen:
            find = _from_table(colours.keys, values)
        else:
            find = _computed(unaged, aged, blocks.storage)
        factor = whole_factor(blocks.height, blocks.width, LONGEST)
        means = AreaMeans(Grid.squares(blocks.height, blocks.width, factor), 1)
        with ExitStack() as stack:
            writers = [stack.enter_context(_floats(file, blocks)) for file in files]
            for place, stored in blocks.read(part_of(progress, 500, 500)):
                block = _of_block(find, stored, blocks.storage, _places(on_screen, blocks, place))
                if on_screen:
                    each_pixel.append(block[np.isfinite(block)])
                means.add(place, block[..., np.newaxis].astype(np.float64), np.isfinite(block).astype(np.float64))
                for write in writers:
                    write(place, block)
    if on_screen:
        values = np.concatenate(each_pixel).astype(np.float64)
        counts = np.ones(len(values), colours.counts.dtype)
    mean, sd, p95, p99, largest = statistics(values, counts)
    return DifferenceMap(
        file=str(image),
        mode=mode,
        hours=float(hours),
        model=model,
        pixels=colours.pixels,
        colours=len(colours),
        binning_error=0.0 if on_screen else binning_error(colours, model, [mode], [float(hours)]),
        mean=mean,
        sd=sd,
        p95=p95,
        p99=p99,
        largest=largest,
        shown=turned(means.means()[..., 0], blocks.orientation),
        factor=factor,
        values=values,
        counts=counts,
        on_screen=on_screen,
    )


def check_placed(file: str, rows: int, columns: int) -> None:
    """Raise LutgenError for a picture of more than ``MOST_PLACED`` pixels."""
    if rows * columns > MOST_PLACED:
        raise LutgenError(
            f"{file}: {columns} × {rows} pixels are more than the {MOST_PLACED:,} of the largest screens. Crop what "
            f"the screen shows, or make it smaller first."
        )


def _places(on_screen: OnScreen | None, blocks: Blocks, block: Place) -> Array | None:
    """Return where on the screen the pixels of a block lie, (n, 2); None: all at one place."""
    if on_screen is None:
        return None
    shape, count = (blocks.height, blocks.width), block.right - block.left
    starts = (row * blocks.width + block.left for row in range(block.top, block.bottom))
    return np.concatenate([on_screen.places(start, count, shape, blocks.orientation) for start in starts])


def _computed(unaged: AgedDisplay, aged: AgedDisplay, storage: Storage) -> Find:
    decoder = Decoder(storage, SIGNAL)

    def find(stored: Stored, places: Array | None) -> Singles:
        code = decoder(stored)[0].T
        where = None if places is None else places.__getitem__
        (values,) = differences(code.__getitem__, len(code), unaged, [aged], places=where)
        return np.asarray(values, np.float32)

    return find


def _from_table(keys: Keys, values: Array) -> Find:
    # ΔE2000 of all 8-bit colours: 64 MB; 0 for a colour that does not occur.
    table = np.zeros(1 << 24, np.float32)
    table[keys] = values
    return lambda stored, _places: table.take(joined(stored[:, :3].T, 8, np.uint32))


def _of_block(find: Find, stored: Stored, storage: Storage, places: Array | None) -> Singles:
    """Return ΔE2000 of a block, (rows, columns); NaN where alpha is 0."""
    flat = stored.reshape(-1, storage.channels)
    values = np.full(len(flat), np.nan, np.float32)
    seen = flat[:, 3] != 0 if storage.alpha else slice(None)
    values[seen] = find(flat[seen], None if places is None else places[seen])
    return values.reshape(stored.shape[:2])


def _check_floats(path: Path, image: Path, *, force: bool) -> Path:
    if path.suffix.lower() not in MAP_SUFFIXES:
        raise pick_one("suffix of a map in numbers", path.suffix or path.name, MAP_SUFFIXES)
    check_name(path)
    if path.exists() and image.exists() and path.samefile(image):
        raise LutgenError(f"{path}: is the image itself, which is never written to. Choose another name.")
    return check_new_file(path, force=force)


@contextmanager
def _floats(path: Path, blocks: Blocks) -> Iterator[Callable[[Place, Singles], None]]:
    """Open a map in numbers for writing; yield the function that writes a block of the map."""

    def check(done: bool) -> None:
        if not done:
            raise OSError(f"OpenImageIO cannot finish the {path.suffix} file")

    kind = MAP_SUFFIXES[path.suffix.lower()]
    with replacing(path) as partial, new_by_oiio(partial, kind, _spec(blocks), check) as file:

        def write(place: Place, block: Singles) -> None:
            rows, values = (place.top, place.bottom), np.ascontiguousarray(block[..., np.newaxis])
            if blocks.tile:
                check(file.write_tiles(place.left, place.right, *rows, 0, 1, values))
            else:
                check(file.write_scanlines(*rows, 0, values))

        yield write


def _spec(blocks: Blocks) -> Any:
    spec = oiio().ImageSpec(blocks.width, blocks.height, 1, "float")
    spec.channelnames = ("Y",)
    spec.attribute("compression", "zip")
    spec.attribute("ImageDescription", "CIEDE2000 between the un-aged and the aged display")
    spec.attribute("Orientation", blocks.orientation)
    # OpenImageIO writes today's date unless a date is given; then two runs would not give the same bytes.
    spec.attribute("DateTime", "")
    if blocks.tile:
        spec.tile_height, spec.tile_width = blocks.tile
        spec.tile_depth = 1
    return spec
