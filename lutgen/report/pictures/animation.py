"""The animation of an image over hours, as APNG, or as MP4 by ffmpeg. Every frame shows its hour."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError, pick_one
from lutgen.files import replacing
from lutgen.names import ANIMATION_SUFFIXES
from lutgen.numerals import spaced
from lutgen.report.drawing.grey_page import Text, grey_page, wrapped
from lutgen.report.pictures.age_sheet import footer
from lutgen.report.pictures.apng import write_apng
from lutgen.report.pictures.mp4 import check_ffmpeg, write_mp4

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from lutgen.pictures.aged_series import AgedSeries
    from lutgen.report.drawing.grey_page import Pixels

#: Pixels of the longest side of the picture, and across a frame at least.
LONGEST, ACROSS = 640, 420

#: Seconds of a whole animation, and the shortest and the longest that a frame may be shown.
SECONDS = 8.0
_SHORTEST, _LONGEST = 0.02, 10.0

#: Height of the text, and of the bar whose filled part grows with the hours.
_TEXT, _BAR = 14, 6


def check_animation(path: str | Path, hours: Sequence[float], seconds: float) -> float:
    """Return the seconds of a frame.

    Raises
    ------
    LutgenError
        A suffix that is not of ``ANIMATION_SUFFIXES``, MP4 without ffmpeg, fewer than two hours, or frames shown too
        short or too long.

    """
    path = Path(path)
    if path.suffix.lower() not in ANIMATION_SUFFIXES:
        raise pick_one("suffix of an animation", path.suffix or path.name, ANIMATION_SUFFIXES)
    if path.suffix.lower() == ".mp4":
        check_ffmpeg()
    if len(hours) < 2:
        message = f"an animation of {len(hours)} hour stands still. Give several, such as 0..18000."
        raise LutgenError(message)
    each = seconds / len(hours)
    if not _SHORTEST <= each <= _LONGEST:
        message = (
            f"{seconds:g} seconds for {len(hours)} frames are {each:.3g} s a frame; {_SHORTEST:g} to {_LONGEST:g} s "
            "are allowed. Give other seconds, or other hours."
        )
        raise LutgenError(message)
    return each


def animate(
    series: AgedSeries,
    mode: str,
    hours: Sequence[float],
    path: str | Path,
    *,
    seconds: float = SECONDS,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Path:
    """Write an animation; an existing file is replaced. APNG: the same bytes on every run.

    Parameters
    ----------
    series
        The image, with the curve of ``mode`` at ``hours``.
    mode, hours
        The mode, and the hours in the order of the frames.
    path
        .png or .apng (animated PNG), or .mp4.
    seconds
        Duration of the animation.
    progress
        Called with the frames done and the frames in all.

    Raises
    ------
    LutgenError
        As :func:`check_animation`, or a file that cannot be written.

    """
    path, each = Path(path), check_animation(path, hours, seconds)

    def frames() -> Iterator[Pixels]:
        for number, hour in enumerate(hours, 1):
            yield frame(series, mode, hour)
            progress(number, len(hours))

    with replacing(path) as partial:
        if path.suffix.lower() == ".mp4":
            write_mp4(frames(), each, partial, str(path))
        else:
            write_apng(frames(), len(hours), each, partial)
    return path


def frame(series: AgedSeries, mode: str, hour: float) -> Pixels:
    """Return the picture at one hour: hour and ΔE2000 above it, a bar of the hours and the readings below."""
    high, wide = series.source.shape[:2]
    width, gap = max(wide, ACROSS) + 2 * _TEXT, _TEXT
    foot = wrapped(footer(series), width - 2 * gap, _TEXT - 3)
    top = 3 * _TEXT
    below = top + high + gap
    texts = [
        Text(gap, gap, f"{mode}, {spaced(hour)} h", _TEXT),
        Text(width - gap, gap, series.told(mode, hour), _TEXT, "right"),
        Text(gap, below + _BAR + gap // 2, "\n".join(foot), _TEXT - 3),
    ]
    page = grey_page(below + _BAR + gap + round(1.5 * (_TEXT - 3) * len(foot)), width, texts)
    left = (width - wide) // 2
    page[top : top + high, left : left + wide] = series.seen(mode, hour)
    page[below : below + _BAR, gap : width - gap] = 80
    gone = gap + round((width - 2 * gap) * hour / max(series.hours))
    page[below : below + _BAR, gap:gone] = 255
    return page
