"""Hald images with one fault each, and the effect in ffmpeg according to lint."""

import io
import struct
import zlib
from collections.abc import Callable
from functools import cache

import numpy as np
from PIL import Image

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler
from lutgen.bake.table_picture import tiles_of
from lutgen.display import DisplayModel, default_display
from lutgen.lint.finding import READS, REFUSES, WRONG
from lutgen.readings import read_measurements


@cache
def file_of(name: str) -> bytes:
    """Return a file of this format, of the default display at 10 000 h."""
    aged = DisplayModel(read_measurements(default_display()), selection="continuous").at("chroma", 10_000)
    form = format_named(name)
    return form.write(form.bake(Sampler(), aged, 17)[0], Provenance("display", "display", ("lutgen: invented",)))


def png(pixels: np.ndarray, mode: str = "RGB") -> bytes:
    data = io.BytesIO()
    Image.fromarray(pixels.astype(np.uint8)).convert(mode).save(data, "PNG")
    return data.getvalue()


def hald(level: int) -> np.ndarray:
    axis = np.linspace(0, 255, level * level)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.rint(np.stack([red, 0.8 * green, blue], axis=-1)).reshape(level**3, level**3, 3)


def chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def with_chunk(data: bytes, name: bytes, content: bytes) -> bytes:
    return data[:33] + chunk(name, content) + data[33:]


def with_pixels(data: bytes, packed: bytes) -> bytes:
    """Return the same header with other pixels, in two complete chunks."""
    half = len(packed) // 2
    return data[:33] + chunk(b"IDAT", packed[:half]) + chunk(b"IDAT", packed[half:]) + chunk(b"IEND", b"")


PLAIN = png(hald(4))
#: Rows of level 4, each after the byte of its PNG filter.
ROWS = b"".join(b"\0" + row.astype(np.uint8).tobytes() for row in hald(4))

#: The picture, what ffmpeg does with it, and lint's message.
HALDS: dict[str, tuple[Callable[[], bytes], str, str]] = {
    "ours": (lambda: file_of("hald"), READS, ""),
    "8 bit": (lambda: PLAIN, READS, "has 8 bits"),
    "level 2": (lambda: png(hald(2)), READS, "has 8 bits"),
    "with alpha": (lambda: png(hald(4), "RGBA"), READS, "has 8 bits"),
    "with gamma": (lambda: with_chunk(PLAIN, b"gAMA", struct.pack(">I", 45_455)), READS, "(gAMA)"),
    "in sRGB": (lambda: with_chunk(PLAIN, b"sRGB", b"\0"), READS, "(sRGB)"),
    "greys": (lambda: png(hald(4), "L"), WRONG, "a picture of greys or of a palette"),
    "a palette": (lambda: png(hald(4), "P"), WRONG, "a picture of greys or of a palette"),
    "100 pixels": (lambda: png(hald(5)[:100, :100]), REFUSES, "100 × 100 pixels; no Hald image has so many"),
    "a row less": (lambda: png(hald(4)[:-1]), REFUSES, "64 × 63 pixels; no Hald image has so many"),
    "a pixel": (lambda: png(hald(4)[:1, :1]), REFUSES, "1 × 1 pixels; no Hald image has so many"),
    "rows more": (lambda: png(np.vstack([hald(4), hald(4)])), WRONG, "64 × 128 pixels, and a Hald image is square"),
    "cut off": (lambda: file_of("hald")[: len(file_of("hald")) // 2], WRONG, "is cut off"),
    "all pixels in two chunks": (lambda: with_pixels(PLAIN, zlib.compress(ROWS)), READS, "has 8 bits"),
    "half of its pixels": (
        lambda: with_pixels(PLAIN, zlib.compress(ROWS[: len(ROWS) // 2])),
        WRONG,
        "bytes of pixels for",
    ),
    "pixels that are no stream": (lambda: with_pixels(PLAIN, ROWS), WRONG, "12352 bytes of pixels for 64 × 64"),
    "no PNG": (lambda: b"GIF89a" + bytes(100), REFUSES, "is not a PNG"),
    "level 8": (lambda: png(hald(8)), READS, "has 8 bits"),
    "of OBS Studio": (lambda: png(tiles_of(hald(8).reshape(64, 64, 64, 3))), WRONG, "the layout of OBS Studio"),
    "ours for OBS Studio": (lambda: file_of("obs"), WRONG, "the layout of OBS Studio"),
    "empty": (lambda: b"", REFUSES, "is empty"),
    "a long chunk": (lambda: PLAIN[:33] + b"\xff\xff\xff\xff" + PLAIN[37:], WRONG, "is cut off"),
}
