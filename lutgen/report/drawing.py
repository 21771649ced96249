"""Elements of all pictures: the figure with its title and foot, the grey page, the PNG file.

Each picture has the same bytes on every run. The path of a PNG is checked before any work, and the complete file is
renamed to the path.
"""

from __future__ import annotations

import io
import re
import textwrap
from base64 import b64encode
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.cells import first_doubled
from lutgen.errors import LutgenError
from lutgen.files import check_new_file, replacing
from lutgen.numerals import spaced

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from contextlib import AbstractContextManager

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lutgen.colorimetry import Array

    #: Horizontal and vertical coordinate.
    Point = tuple[float, float] | Array

#: Metadata of a PNG that matplotlib writes: no version of matplotlib, so that the bytes stay the same.
METADATA: Any = {"Software": None}


def check_new_png(path: str | Path, *, force: bool) -> Path:
    """Return ``path``. Raises LutgenError: not a .png, a folder, or a file that exists, without ``force``."""
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise LutgenError(f"{path}: pictures are written as PNG. Give a name that ends in .png.")
    return check_new_file(path, force=force)


def new_png(path: str | Path, *, force: bool) -> AbstractContextManager[Path]:
    """Return the context of a temporary path that becomes ``path`` on success; errors as in :func:`check_new_png`."""
    return replacing(check_new_png(path, force=force))


def data_address(image: bytes) -> str:
    """Return a PNG as a data URL (RFC 2397)."""
    return f"data:image/png;base64,{b64encode(image).decode()}"


#: Compression level of zlib for the smallest files, since pages with pictures are sent by mail.
SMALLEST = 9


def page_png(pixels: NDArray[np.uint8], palette: NDArray[np.uint8] | None = None) -> bytes:
    """Return the sRGB PNG of RGB or RGBA pixels, (h, w, 3 or 4), or of indices (h, w) of a ``palette`` (n, 3)."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    image = Image.fromarray(pixels)
    if palette is not None:
        image.putpalette(palette.tobytes())
    info = PngInfo()
    info.add(b"sRGB", b"\0")  # perceptual intent (PNG Third Edition, 11.3.2.5)
    file = io.BytesIO()
    image.save(file, "png", compress_level=SMALLEST, pnginfo=info)
    return file.getvalue()


#: Dots per inch, and width in inches: 1500 pixels, which fit the screen of a laptop.
DPI, WIDTH = 100, 15.0

#: Colours that people with any colour vision can distinguish: Okabe & Ito 2008, https://jfly.uni-koeln.de/color/.
BLACK, BLUE, RED, GREEN, YELLOW = "#222222", "#0072B2", "#D55E00", "#009E73", "#F0E442"
GREY, BAND = "#777777", "#d9d9d9"

#: Most characters in a line of the title, of the second text and of the foot, at their font sizes.
_TITLE, _SECOND, _FOOT = 102, 150, 190

#: Height in inches of a line of the title, of the second text and of the foot.
_LINES = {"title": 0.30, "second": 0.22, "foot": 0.19}


@contextmanager
def new_figure(path: str | Path, size: tuple[float, float], *, force: bool) -> Iterator[Figure]:
    """Yield an empty figure of ``size`` inches, which is then written as PNG; errors as in :func:`check_new_png`."""
    from matplotlib import style
    from matplotlib.figure import Figure

    with style.context("default"), new_png(path, force=force) as partial:
        figure = Figure(figsize=size, dpi=DPI)
        yield figure
        figure.savefig(partial, format="png", metadata=METADATA)


def _wrapped(text: str, letters: int, lines: int) -> list[str]:
    """Wrap a text at words, never within a number such as 18 000. A text that is too long loses its last sentences."""
    whole = re.sub(r"(?<=\d) (?=\d{3}\b)", "\N{NO-BREAK SPACE}", text)
    wrap = partial(textwrap.wrap, width=letters, break_on_hyphens=False)
    sentences = [whole[: end.start()] + "." for end in re.finditer(r"\.(?= )", whole)]
    fitting = (wrapped for part in (whole, *reversed(sentences)) if len(wrapped := wrap(part)) <= lines)
    return next(fitting, None) or wrap(whole, max_lines=lines, placeholder=" …")


@contextmanager
def picture(
    path: Path, title: str, *, second: str = "", foot: str = "", height: float = 9.0, force: bool
) -> Iterator[tuple[Figure, float, float]]:
    """Yield a figure, and bottom and top of its free area as shares of its height; errors as :func:`check_new_png`."""
    with new_figure(path, (WIDTH, height), force=force) as figure:
        top = height - 0.2
        for text, letters, kind, look in (
            (title, _TITLE, "title", {"fontsize": 16, "weight": "bold"}),
            (second, _SECOND, "second", {"fontsize": 12}),
        ):
            lines = _wrapped(text, letters, 2)
            if lines:
                figure.text(0.04, top / height, "\n".join(lines), va="top", linespacing=1.2, **look)
                top -= len(lines) * _LINES[kind] + 0.08
        lines = _wrapped(foot, _FOOT, 3)
        figure.text(0.04, 0.12 / height, "\n".join(lines), fontsize=10, va="bottom", color="#444444")
        yield figure, (0.12 + len(lines) * _LINES["foot"]) / height, top / height


def named_once(names: list[str], what: str) -> list[str]:
    """Return the names of pictures of several ``what``. Raises LutgenError if two names are equal."""
    if twice := first_doubled(names):
        raise LutgenError(
            f"{twice}: two {what} would be drawn into this file. Draw them one after the other, or rename one."
        )
    return names


def plain_log(axes: Axes, which: Literal["x", "y"]) -> None:
    """Make the axis ``x`` or ``y`` logarithmic, with plain numbers only at its major ticks."""
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(lambda _value, _: "")


def hour_axis(axes: Axes) -> None:
    """Write the hours at the horizontal axis with spaces between thousands: 18 000."""
    axes.xaxis.set_major_formatter(lambda value, _: spaced(value))


def tidy(axes: Axes, *, grid: Literal["both", "x", "y"] = "both") -> None:
    """Draw a pale grid for one axis or both, and remove the frame at the top and at the right."""
    axes.grid(color="#eeeeee", axis=grid)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def beside(axes: Axes, text: str, place: Point, offset: Point, **look: Any) -> None:
    """Write a text at an offset in points (right, up) from a place in the axes."""
    axes.annotate(text, (place[0], place[1]), (offset[0], offset[1]), textcoords="offset points", **look)


Pixels = NDArray[np.uint8]

#: Code value of L* = 50: a surround halfway between light and dark pictures.
SURROUND = 119


class Text(NamedTuple):
    """A text: column, top row, letters, height in pixels, and the side of the text at the column (``left``, …)."""

    column: int
    top: int
    letters: str
    size: int
    side: str = "left"


def grey_page(height: int, width: int, texts: Iterable[Text]) -> Pixels:
    """Return a grey page with texts, shape (height, width, 3)."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context("default"):
        # At 72 dots per inch a point is a pixel. A tenth of a pixel is added so that rounding does not lose a row.
        figure = Figure(figsize=((width + 0.1) / 72, (height + 0.1) / 72), dpi=72, facecolor=(SURROUND / 255,) * 3)
        canvas: Any = FigureCanvasAgg(figure)
        for text in texts:
            place = (text.column / width, 1.0 - text.top / height)
            look: dict[str, Any] = {"color": "white", "va": "top", "linespacing": 1.3, "parse_math": False}
            figure.text(*place, text.letters, fontsize=text.size, ha=text.side, **look)
        canvas.draw()
        return np.array(canvas.buffer_rgba())[..., :3]


def wrapped(text: str, width: int, size: int) -> list[str]:
    """Wrap a text into lines of ``width`` pixels: a character of DejaVu Sans is on average at most 0.6 em wide."""
    return textwrap.wrap(text, max(int(width / (0.6 * size)), 10))


def save_page(page: Pixels, path: Path) -> None:
    """Write a page as PNG to a path of any suffix, with the same bytes on every run."""
    from matplotlib.image import imsave

    imsave(path, page, format="png", metadata=METADATA)
