"""The paper's Figures 2 to 6, drawn from the user's own image.

Figures 2, 3 and 4 have one layout and show three images, 5 and 6 show the first of them again. The paper's images were
never published, so each figure is drawn from the image that is given.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.errors import pick_one
from lutgen.names import FIGURES
from lutgen.numerals import spaced
from lutgen.pictures.aged_series import aged_series
from lutgen.pictures.difference_map import difference_map
from lutgen.pictures.lifetime import lifetime
from lutgen.pictures.published import AGES, MAPS
from lutgen.report.pictures.difference_map import plot_figure_6
from lutgen.report.pictures.lifetime import plot_lifetime
from lutgen.report.pictures.sheets import contact_sheet, footer

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.display import DisplayModel
    from lutgen.pictures.difference_map import DifferenceMap


def draw_figure(
    number: str,
    image: str | Path,
    model: DisplayModel,
    path: str | Path,
    *,
    source: str = "auto",
    force: bool = False,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Path:
    """Draw a figure of the paper from an image, as a PNG: the same bytes on every run.

    Parameters
    ----------
    number
        One of ``FIGURES``.
    image
        PNG, JPEG, TIFF, EXR, RGB or RGBA; slides (.svs, .ndpi, .mrxs) with the extra ``slides``.
    model
        The display. Its measured span must hold the figure's hours.
    path
        A .png file.
    source
        What the numbers of the image are: ``auto``, ``signal`` or ``linear``, as for ``apply``.
    force
        Replace an existing file.
    progress
        Called with the work done and the work in all, in thousandths.

    Raises
    ------
    LutgenError
        Another figure, an image that cannot be read, hours outside the measured span, or a path that cannot be written.

    """
    if number not in FIGURES:
        raise pick_one("figure", number, FIGURES)
    if number == "5":
        lifetimes = lifetime([image], model, source=source, progress=progress)
        plot_lifetime(lifetimes, lifetimes.images[0], Path(path), force=force)
    elif number == "6":
        maps: list[DifferenceMap] = []
        for mode, hour in MAPS:

            def share(done: int, total: int, before: int = len(maps)) -> None:
                progress(before * total + done, len(MAPS) * total)

            maps.append(difference_map(image, model, mode, hour, source=source, progress=share))
        plot_figure_6(maps, path, force=force)
    else:
        _ages(number, image, model, Path(path), source=source, force=force, progress=progress)
    return Path(path)


def _ages(
    number: str,
    image: str | Path,
    model: DisplayModel,
    path: Path,
    *,
    source: str,
    force: bool,
    progress: Callable[[int, int], None],
) -> None:
    modes, hours = list(dict.fromkeys(mode for mode, _ in AGES)), sorted({hour for _, hour in AGES})
    series = aged_series(image, model, modes, hours, source=source, progress=progress)
    mode, hour = AGES[-1]
    contact_sheet(
        {"un-aged": series.seen("stable", 0.0)}
        | {f"{mode}, {spaced(hour)} h\n{series.told(mode, hour)}": series.seen(mode, hour) for mode, hour in AGES},
        path,
        title=f"By {spaced(hour)} h {series.told(mode, hour)} in {mode} (Figure {number}, {Path(series.file).name})",
        footer=footer(series),
        force=force,
    )
