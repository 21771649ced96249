"""The figure of a picture: a page with a finding as its title and a foot, the same bytes on every run."""

from __future__ import annotations

import textwrap
from contextlib import contextmanager
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.report.drawing.png_file import METADATA, new_png

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Dots per inch, and width in inches: 1500 pixels, which fit the screen of a laptop.
DPI, WIDTH = 100, 15.0

#: Colours that people with any colour vision tell apart: Okabe & Ito 2008, https://jfly.uni-koeln.de/color/.
BLACK, BLUE, RED, GREEN, YELLOW = "#222222", "#0072B2", "#D55E00", "#009E73", "#F0E442"
GREY, BAND = "#777777", "#d9d9d9"

#: Characters in a line of the title, of the second line and of the foot, at their font sizes.
_TITLE, _SECOND, _FOOT = 102, 150, 190

#: Height of a line of title, second line and foot, in inches.
_LINES = {"title": 0.30, "second": 0.22, "foot": 0.19}


@contextmanager
def new_figure(path: str | Path, size: tuple[float, float], *, force: bool) -> Iterator[Figure]:
    """Give an empty figure of ``size`` inches; on success it becomes a PNG, the same bytes on every run.

    Raises
    ------
    LutgenError
        ``path`` is no .png, cannot be written, or exists and ``force`` is not given.

    """
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context("default"), new_png(path, force=force) as partial:
        figure = Figure(figsize=size, dpi=DPI)
        FigureCanvasAgg(figure)
        yield figure
        figure.savefig(partial, format="png", metadata=METADATA)


@contextmanager
def picture(
    path: Path, title: str, *, second: str = "", foot: str = "", height: float = 9.0, force: bool
) -> Iterator[tuple[Figure, float, float]]:
    """Give a figure to draw into between bottom and top, shares of its height; on success it becomes a PNG.

    Raises
    ------
    LutgenError
        ``path`` cannot be written, or exists and ``force`` is not given.

    """
    with new_figure(path, (WIDTH, height), force=force) as figure:
        top = height - 0.2
        for text, letters, kind, look in (
            (title, _TITLE, "title", {"fontsize": 16, "weight": "bold"}),
            (second, _SECOND, "second", {"fontsize": 12}),
        ):
            lines = textwrap.wrap(text, letters, max_lines=2, placeholder=" …", break_on_hyphens=False)
            if lines:
                figure.text(0.04, top / height, "\n".join(lines), va="top", linespacing=1.2, **look)
                top -= len(lines) * _LINES[kind] + 0.08
        lines = textwrap.wrap(foot, _FOOT, max_lines=3, placeholder=" …", break_on_hyphens=False)
        figure.text(0.04, 0.12 / height, "\n".join(lines), fontsize=10, va="bottom", color="#444444")
        yield figure, (0.12 + len(lines) * _LINES["foot"]) / height, top / height


def named_once(names: list[str], what: str) -> list[str]:
    """Return the names of pictures of several ``what``. Raises LutgenError if two names are the same."""
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        message = f"{twice}: two {what} would be drawn into this file. Draw them one after the other, or rename one."
        raise LutgenError(message)
    return names


def tidy(axes: Axes) -> None:
    """Give axes a pale grid, and no frame above and to the right."""
    axes.grid(color="#eeeeee")
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
