"""The sheet of ages: one image, in a row for each mode and a column for each hour, on neutral grey."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.numerals import spaced
from lutgen.report.drawing.grey_page import Text, grey_page, save_page, wrapped
from lutgen.report.drawing.png_file import new_png

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.pictures.aged_series import AgedSeries

#: Width of a sheet in pixels, about: pictures of many hours are reduced to fit.
ACROSS = 3600

#: Pixels of a picture's longest side, at most and at least.
MOST, LEAST = 1000, 160

#: Columns of a sheet, at most: more pictures would be too small to be compared.
COLUMNS = 20


@dataclass(frozen=True)
class _Layout:
    """Where everything is on a sheet of ``rows`` × ``columns`` pictures of ``height`` × ``width`` pixels."""

    rows: int
    columns: int
    height: int
    width: int

    @property
    def cell(self) -> int:
        return max(self.width, LEAST)

    @property
    def text(self) -> int:
        return max(12, self.cell // 30)

    @property
    def gap(self) -> int:
        return self.text

    @property
    def sheet_width(self) -> int:
        return max(self.columns * (self.cell + self.gap) + self.gap, 640)

    def top(self, row: int, heading: int) -> int:
        return heading + row * (self.height + 4 * self.text)

    def left(self, column: int) -> int:
        return self.gap + column * (self.cell + self.gap) + (self.cell - self.width) // 2


def check_hours(hours: Sequence[float]) -> list[float]:
    """Return hours, increasing, each once. Raises LutgenError for more than a sheet has columns for."""
    chosen = sorted(set(map(float, hours)))
    if len(chosen) > COLUMNS:
        message = (
            f"{len(chosen)} hours are more than the {COLUMNS} columns of a sheet. Give a step, such as 0..18000:3000, "
            "or make an animation of them."
        )
        raise LutgenError(message)
    return chosen


def longest(columns: int) -> int:
    """Return the longest side that a picture may have on a sheet of so many columns."""
    return min(max(ACROSS // columns, LEAST), MOST)


def age_sheet(series: AgedSeries, hours: Sequence[float], path: str | Path, *, force: bool = False) -> Path:
    """Write a sheet of the modes of ``series`` and of ``hours`` of it, as a PNG: the same bytes on every run.

    Raises
    ------
    LutgenError
        Too many hours, or a path that cannot be written.

    """
    chosen, modes = check_hours(hours), list(series.curves)
    layout = _Layout(len(modes), len(chosen), *series.source.shape[:2])
    heading = wrapped(title_of(series, chosen), layout.sheet_width - 2 * layout.gap, round(1.5 * layout.text))
    above = round(2.0 * layout.text * len(heading)) + 2 * layout.gap
    foot = wrapped(footer(series), layout.sheet_width - 2 * layout.gap, layout.text)
    below = layout.top(len(modes), above)
    height = below + round(1.5 * layout.text * len(foot)) + layout.gap

    def texts() -> Iterator[Text]:
        yield Text(layout.gap, layout.gap, "\n".join(heading), round(1.5 * layout.text))
        for row, mode in enumerate(modes):
            for column, hour in enumerate(chosen):
                top = layout.top(row, above) + layout.height + layout.text // 2
                caption = f"{mode}, {spaced(hour)} h\n{series.told(mode, hour)}"
                yield Text(layout.left(column) + layout.width // 2, top, caption, layout.text, "center")
        yield Text(layout.gap, below, "\n".join(foot), layout.text)

    with new_png(path, force=force) as partial:
        sheet = grey_page(height, layout.sheet_width, texts())
        for row, mode in enumerate(modes):
            for column, hour in enumerate(chosen):
                top, left = layout.top(row, above), layout.left(column)
                sheet[top : top + layout.height, left : left + layout.width] = series.seen(mode, hour)
        save_page(sheet, partial)
    return Path(path)


def title_of(series: AgedSeries, hours: Sequence[float]) -> str:
    """State the mean ΔE2000 at the last hour."""
    parts = [f"{series.told(mode, hours[-1])} in {mode}" for mode in series.curves]
    return f"{Path(series.file).name} by {spaced(hours[-1])} h: {', '.join(parts)}"


def footer(series: AgedSeries) -> str:
    """Explain the pictures and the numbers, and name model and readings."""
    model = series.model
    smaller = f" Each pixel is the mean light of {series.factor} × {series.factor}." if series.factor > 1 else ""
    return (
        f"As an un-aged sRGB viewer shows it.{smaller} ΔE2000 against the un-aged display, over all "
        f"{spaced(series.pixels)} pixels. Model: Avanaki et al. 2015{' with effects' if model.effects else ''}, "
        f"selection {model.selection}, luminance law {model.luminance.name}. {model.measurements.provenance}"
    )
