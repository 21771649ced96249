"""The animation of an image over hours, as APNG, or as MP4 by ffmpeg. Every frame shows its hour.

APNG is animated PNG (PNG Third Edition, https://www.w3.org/TR/png-3/). It is written frame by frame, with the same
bytes on every run. Programs without support for animations show the first frame. Pillow compresses each frame. Pillow's
own writer of animations (``save_all``) is not used, since it holds all frames in memory, and joins equal frames.
"""

import shutil
import struct
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path

from lutgen.errors import LutgenError, in_one_line, pick_one
from lutgen.files import replacing
from lutgen.names import ANIMATION_SUFFIXES
from lutgen.numerals import spaced
from lutgen.pictures.frame import AgedSeries
from lutgen.progress import Progress, unseen
from lutgen.report.drawing import Pixels, Text, grey_page, wrapped
from lutgen.report.sheets import footer

#: Longest side of the picture, and least width of a frame, in pixels.
LONGEST, ACROSS = 640, 420

#: Seconds of a whole animation, and least and most seconds of a frame.
SECONDS = 8.0
_SHORTEST, _LONGEST = 0.02, 10.0

#: Height of the text, and of the bar whose filled part grows with the hours.
_TEXT, _BAR = 14, 6


def check_animation(path: str | Path, hours: Sequence[float], seconds: float) -> float:
    """Return the seconds of a frame. Raises LutgenError: a wrong suffix, no ffmpeg, too few hours, bad seconds."""
    path = Path(path)
    if path.suffix.lower() not in ANIMATION_SUFFIXES:
        raise pick_one("suffix of an animation", path.suffix or path.name, ANIMATION_SUFFIXES)
    if path.suffix.lower() == ".mp4":
        check_ffmpeg()
    if len(hours) < 2:
        raise LutgenError(f"an animation needs at least 2 hours, not {len(hours)}. Give several, such as 0..18000.")
    each = seconds / len(hours)
    if not _SHORTEST <= each <= _LONGEST:
        raise LutgenError(
            f"{seconds:g} seconds for {len(hours)} frames are {each:.3g} s a frame; {_SHORTEST:g} to {_LONGEST:g} s "
            "are allowed. Give other seconds, or other hours."
        )
    return each


def animate(
    series: AgedSeries,
    mode: str,
    hours: Sequence[float],
    path: str | Path,
    *,
    seconds: float = SECONDS,
    progress: Progress = unseen,
) -> Path:
    """Write an animation of ``hours``, which must be hours of ``mode``'s curve; errors as :func:`check_animation`."""
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
    """Return the picture at one hour, with hour and ΔE2000 above it, and a bar of hours and the readings below it."""
    high, wide = series.frame.places.shape
    width, gap = max(wide, ACROSS) + 2 * _TEXT, _TEXT
    foot = wrapped(footer(series), width - 2 * gap, _TEXT - 3)
    top = 3 * _TEXT
    below = top + high + gap
    texts = [
        Text(gap, gap, f"{mode}, {spaced(hour)} h", _TEXT),
        Text(width - gap, gap, series.mean_in_words(mode, hour), _TEXT, "right"),
        Text(gap, below + _BAR + gap // 2, "\n".join(foot), _TEXT - 3),
    ]
    page = grey_page(below + _BAR + gap + round(1.5 * (_TEXT - 3) * len(foot)), width, texts)
    left = (width - wide) // 2
    page[top : top + high, left : left + wide] = series.seen(mode, hour)
    page[below : below + _BAR, gap : width - gap] = 80
    filled = gap + round((width - 2 * gap) * hour / max(series.hours))
    page[below : below + _BAR, gap:filled] = 255
    return page


SIGNATURE = b"\x89PNG\r\n\x1a\n"

#: Kind of PNG: eight bits per channel, RGB; deflate, adaptive filters, not interlaced.
KIND = bytes((8, 2, 0, 0, 0))


def write_apng(frames: Iterable[Pixels], count: int, seconds: float, path: Path) -> None:
    """Write ``count`` frames, uint8 of one shape (h, w, 3), each shown for ``seconds``, in an endless loop."""
    from PIL import Image
    from PIL.PngImagePlugin import getchunks, putchunk

    delay = (max(round(1000 * seconds), 1), 1000)
    with path.open("wb") as file:
        file.write(SIGNATURE)
        for number, frame in enumerate(frames):
            size = (frame.shape[1], frame.shape[0])
            if number == 0:
                putchunk(file, b"IHDR", struct.pack(">2I", *size) + KIND)
                putchunk(file, b"sRGB", b"\0")
                putchunk(file, b"acTL", struct.pack(">2I", count, 0))
            sequence = max(2 * number - 1, 0)
            putchunk(file, b"fcTL", struct.pack(">5I2H2B", sequence, *size, 0, 0, *delay, 0, 0))
            # The image data of a frame's own PNG.
            data = b"".join(data for kind, data, _ in getchunks(Image.fromarray(frame)) if kind == b"IDAT")
            if number == 0:
                putchunk(file, b"IDAT", data)
            else:
                putchunk(file, b"fdAT", struct.pack(">I", sequence + 1), data)
        putchunk(file, b"IEND", b"")


#: Video that players support: BT.709, half the chroma resolution, and therefore an even number of rows and columns.
_COLOURS = (
    "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=0x777777,scale=in_range=pc:out_range=tv:out_color_matrix=bt709"
    ":flags=accurate_rnd+full_chroma_int,format=yuv420p"
)
_TAGS = ("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv")


def check_ffmpeg() -> str:
    """Return the path of ffmpeg. Raises LutgenError, which names how to install it and a format without ffmpeg."""
    program = shutil.which("ffmpeg")
    if program is None:
        raise LutgenError(
            "MP4 is written by the program ffmpeg, which is not on the PATH. Install it (Debian: apt install ffmpeg), "
            "or give a name that ends in .png: an animated PNG needs no other program."
        )
    return program


def write_mp4(frames: Iterable[Pixels], seconds: float, path: Path, name: str) -> None:
    """Write frames, uint8 of one shape (h, w, 3), of ``seconds`` each; ``name`` is the file's name in errors."""
    program, frames = check_ffmpeg(), iter(frames)
    first = next(frames)
    command = [
        program, "-v", "error", "-nostdin", "-y",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{first.shape[1]}x{first.shape[0]}",
        "-r", f"{1.0 / seconds:.6f}", "-i", "pipe:0",
        "-vf", _COLOURS, *_TAGS, "-movflags", "+faststart", "-fflags", "+bitexact", "-flags:v", "+bitexact",
        "-f", "mp4", str(path),
    ]  # fmt: skip
    with tempfile.TemporaryFile() as errors:
        running = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=errors)  # noqa: S603 - no shell
        # If ffmpeg closes the pipe early, its error output explains why.
        with running, suppress(BrokenPipeError):
            for frame in chain([first], frames):
                running.stdin.write(frame.tobytes())  # type: ignore[union-attr]
        if running.returncode:
            errors.seek(0)
            why = in_one_line(errors.read().decode(errors="replace")) or f"it ended with {running.returncode}"
            raise LutgenError(f"{name}: ffmpeg cannot write it: {why}. Write an animated PNG (.png) instead.")
