"""Sheets of one image at several ages on neutral grey: rows of modes and columns of hours, or the paper's figures.

The paper's Figures 2, 3 and 4 show three images in the same layout: un-aged at the centre; clockwise from the top
chroma 10 000 h, chroma 18 000 h, chroma-luma 10 000 h, chroma-luma 18 000 h. Figures 5 and 6 show the first of these
images. The paper's images were never published, so each figure is drawn from an image that the user gives.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lutgen.display import DisplayModel
from lutgen.display.on_screen import OnScreen
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import FIGURES
from lutgen.numerals import spaced
from lutgen.pictures.difference_map import DifferenceMap, difference_map
from lutgen.pictures.frame import AgedSeries, aged_series
from lutgen.pictures.lifetime import lifetime
from lutgen.progress import Progress, part_of, unseen
from lutgen.report.difference_map import MAPS, plot_figure_6
from lutgen.report.drawing import Pixels, Text, grey_page, new_png, save_page, wrapped
from lutgen.report.lifetimes import plot_lifetime

#: The paper's Figures 2 to 4: the aged pictures around the un-aged one, clockwise from the top.
AGES = (("chroma", 10_000.0), ("chroma", 18_000.0), ("chroma-luma", 10_000.0), ("chroma-luma", 18_000.0))

#: Approximate width of a sheet in pixels: many pictures are reduced to fit.
ACROSS = 3600

#: Largest and smallest length of a picture's longest side, in pixels.
MOST, LEAST = 1000, 160

#: Most columns of a sheet: pictures in more columns would be too small to compare.
COLUMNS = 20

#: Places of the images of a contact sheet, in the order given: (column, row) of a 3 × 3 grid.
PLACES = {"centre": (1, 1), "top": (1, 0), "right": (2, 1), "bottom": (1, 2), "left": (0, 1)}


@dataclass(frozen=True)
class Layout:
    """The layout of a sheet of pictures of ``height`` × ``width`` pixels; by default of a contact sheet."""

    height: int
    width: int
    #: Number of columns of pictures.
    columns: int = 3
    #: Least width of a column in pixels, so that the captions of small pictures do not overlap.
    narrowest: int = 400
    #: Least height of the text in pixels. Text grows with the pictures, since people view the whole sheet at once.
    smallest: int = 13
    #: Width of the grey between columns and around the sheet, in heights of the text.
    gap_lines: int = 2

    @property
    def cell(self) -> int:
        """Width of a column."""
        return max(self.width, self.narrowest)

    @property
    def text(self) -> int:
        """Height of the text in pixels."""
        return max(self.smallest, self.cell // 30)

    @property
    def gap(self) -> int:
        """Width of the grey between cells and around the sheet."""
        return self.gap_lines * self.text

    @property
    def sheet_width(self) -> int:
        """Width of the whole sheet."""
        return max(self.columns * (self.cell + self.gap) + self.gap, 640)

    @property
    def caption(self) -> int:
        """Height of the space under each picture for a caption of two lines."""
        return 4 * self.text

    def top(self, row: int, first: int | None = None) -> int:
        """Return the top row of pixels of a row of pictures; the first row begins at ``first``, or below the gap."""
        return (self.gap if first is None else first) + row * (self.height + self.caption)

    def left(self, column: int) -> int:
        """Return the left column of pixels of the pictures in a column."""
        return self.gap + column * (self.cell + self.gap) + (self.cell - self.width) // 2

    def corner(self, place: str) -> tuple[int, int]:
        """Return row and column of the upper left pixel of the image at a place of a contact sheet."""
        column, row = PLACES[place]
        return self.top(row), self.left(column)


def check_hours(hours: Sequence[float]) -> list[float]:
    """Return the distinct hours, increasing. Raises LutgenError for more hours than ``COLUMNS``."""
    chosen = sorted(set(map(float, hours)))
    if len(chosen) > COLUMNS:
        raise LutgenError(
            f"{len(chosen)} hours are more than the {COLUMNS} columns of a sheet. Give a step, such as 0..18000:3000, "
            "or make an animation of them."
        )
    return chosen


def longest(columns: int) -> int:
    """Return the largest side of a picture on a sheet of ``columns`` columns, in pixels."""
    return min(max(ACROSS // columns, LEAST), MOST)


def age_sheet(series: AgedSeries, hours: Sequence[float], path: str | Path, *, force: bool = False) -> Path:
    """Write a sheet of the modes of ``series`` at some hours. Raises LutgenError: too many hours, or a bad path."""
    chosen, modes = check_hours(hours), list(series.curves)
    high, wide = series.frame.places.shape
    layout = Layout(high, wide, columns=len(chosen), narrowest=LEAST, smallest=12, gap_lines=1)
    last = chosen[-1]
    parts = ", ".join(f"{series.mean_in_words(mode, last)} in {mode}" for mode in modes)
    title = f"{Path(series.file).name} by {spaced(last)} h: {parts}"
    heading = wrapped(title, layout.sheet_width - 2 * layout.gap, round(1.5 * layout.text))
    above = round(2.0 * layout.text * len(heading)) + 2 * layout.gap
    pictures = [
        (layout.top(row, above), layout.left(column), _caption(series, mode, hour), series.seen(mode, hour))
        for row, mode in enumerate(modes)
        for column, hour in enumerate(chosen)
    ]
    return _write(
        layout, heading, pictures, footer(series), below=layout.top(len(modes), above), path=path, force=force
    )


def _write(
    layout: Layout,
    heading: list[str],
    pictures: list[tuple[int, int, str, Pixels]],
    footer: str,
    *,
    below: int,
    path: str | Path,
    force: bool,
) -> Path:
    """Write pictures with top, left and caption, the heading at the upper left, and the footer at row ``below``."""
    foot = wrapped(footer, layout.sheet_width - 2 * layout.gap, layout.text)
    texts = [
        Text(layout.gap, layout.gap, "\n".join(heading), round(1.5 * layout.text)),
        *(
            Text(left + layout.width // 2, top + layout.height + layout.text // 2, caption, layout.text, "center")
            for top, left, caption, _ in pictures
        ),
        Text(layout.gap, below, "\n".join(foot), layout.text),
    ]
    with new_png(path, force=force) as partial:
        height = below + round(1.5 * layout.text * len(foot)) + layout.gap
        sheet = grey_page(height, layout.sheet_width, texts)
        for top, left, _, pixels in pictures:
            sheet[top : top + layout.height, left : left + layout.width] = pixels
        save_page(sheet, partial)
    return Path(path)


def _caption(series: AgedSeries, mode: str, hour: float) -> str:
    return f"{mode}, {spaced(hour)} h\n{series.mean_in_words(mode, hour)}"


def footer(series: AgedSeries) -> str:
    """Return sentences on the pictures and the numbers, the model and the readings."""
    model = series.model
    smaller = f" Each pixel is the mean light of {series.factor} × {series.factor}." if series.factor > 1 else ""
    if series.frame.on_screen:
        smaller = f"{smaller} {' '.join(series.frame.on_screen.sentences())}"
    return (
        f"As an un-aged sRGB viewer shows it.{smaller} ΔE2000 against the un-aged display, over all "
        f"{spaced(series.pixels)} pixels. Model: Avanaki et al. 2015{' with effects' if model.effects else ''}, "
        f"selection {model.selection}, luminance law {model.luminance.name}. {model.measurements.provenance}"
    )


def contact_sheet(
    images: Mapping[str, Pixels], path: str | Path, *, title: str, footer: str, force: bool = False
) -> Path:
    """Write images (caption → uint8 (h, w, 3)) in the order of ``PLACES``; title and footer are wrapped."""
    if len(images) != len(PLACES):
        raise LutgenError(f"a contact sheet has {len(PLACES)} images ({', '.join(PLACES)}), not {len(images)}.")
    first = next(iter(images.values()))
    for caption, pixels in images.items():
        what = f"image {caption!r}"
        if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape:
            raise LutgenError(f"{what} is {pixels.dtype} of shape {pixels.shape}; give uint8 of shape (h, w, 3).")
        if pixels.shape != first.shape:
            raise LutgenError(f"{what} has shape {pixels.shape}, the first {first.shape}; all must be of one size.")
    layout = Layout(*first.shape[:2])
    pictures = [
        (*layout.corner(place), caption, pixels)
        for place, (caption, pixels) in zip(PLACES, images.items(), strict=True)
    ]
    heading = wrapped(title, layout.cell, round(1.5 * layout.text))
    return _write(layout, heading, pictures, footer, below=layout.top(3), path=path, force=force)


def draw_figure(
    number: str,
    image: str | Path,
    model: DisplayModel,
    path: str | Path,
    *,
    on_screen: OnScreen | None = None,
    source: str = "auto",
    force: bool = False,
    progress: Progress = unseen,
) -> Path:
    """Draw a figure of the paper from an image; arguments and errors as :func:`.frame.aged_series`."""
    refuse_unknown("figure", number, FIGURES)
    if number == "5" and on_screen:
        raise LutgenError(
            "Figure 5 counts colours at all places of the screen together. Leave --on-screen out, or take Figure 6, or "
            "lutgen sheet --on-screen with several hours."
        )
    if number == "5":
        lifetimes = lifetime([image], model, source=source, progress=progress)
        plot_lifetime(lifetimes, lifetimes.images[0], Path(path), force=force)
    elif number == "6":
        maps: list[DifferenceMap] = []
        for mode, hour in MAPS:
            part = part_of(progress, 1000 * len(maps), 1000, 1000 * len(MAPS))
            maps.append(difference_map(image, model, mode, hour, on_screen=on_screen, source=source, progress=part))
        plot_figure_6(maps, path, force=force)
    else:
        modes, hours = list(dict.fromkeys(mode for mode, _ in AGES)), sorted({hour for _, hour in AGES})
        series = aged_series(image, model, modes, hours, on_screen=on_screen, source=source, progress=progress)
        pictures = {"un-aged": series.seen("stable", 0.0)}
        pictures |= {_caption(series, mode, hour): series.seen(mode, hour) for mode, hour in AGES}
        mode, hour = AGES[-1]
        last, name = f"By {spaced(hour)} h {series.mean_in_words(mode, hour)} in {mode}", Path(series.file).name
        title = f"{last} (Figure {number}, {name})"
        contact_sheet(pictures, path, title=title, footer=footer(series), force=force)
    return Path(path)
