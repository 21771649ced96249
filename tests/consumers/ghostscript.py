"""Ghostscript converts with LittleCMS at 8 bit: an image in a PDF, by the absolute intent, as the guide says."""

import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.consumers import Claim, Consumer, Job, Picture, module, program, run
from tests.consumers._claims import aged, profile

#: ICC's numbers of the intents.
RELATIVE, ABSOLUTE = 1, 3


@cache
def version() -> str:
    return run(program("gs", "ghostscript"), "--version").strip()


def page(pixels: NDArray[np.uint8], data: bytes) -> bytes:
    """Return a PDF of one page with a picture and its profile: one point per pixel."""
    height, width, _ = pixels.shape
    draw = f"{width} 0 0 {height} 0 0 cm /I Do".encode()
    image = (
        f"/Type/XObject/Subtype/Image/Width {width}/Height {height}/BitsPerComponent 8/ColorSpace[/ICCBased 6 0 R]"
        "/Filter/FlateDecode"
    )
    parts = [
        b"<</Type/Catalog/Pages 2 0 R>>",
        b"<</Type/Pages/Kids[3 0 R]/Count 1>>",
        f"<</Type/Page/Parent 2 0 R/MediaBox[0 0 {width} {height}]/Contents 4 0 R".encode()
        + b"/Resources<</XObject<</I 5 0 R>>>>>>",
        _stream("", draw),
        _stream(image, zlib.compress(pixels.tobytes())),
        _stream("/N 3/Alternate/DeviceRGB/Filter/FlateDecode", zlib.compress(data)),
    ]
    text, places = b"%PDF-1.5\n", []
    for number, part in enumerate(parts, 1):
        places.append(len(text))
        text += b"%d 0 obj\n%s\nendobj\n" % (number, part)
    rows = b"".join(b"%010d 00000 n \n" % place for place in places)
    end = b"trailer<</Size 7/Root 1 0 R>>\nstartxref\n%d\n%%%%EOF\n" % len(text)
    return text + b"xref\n0 7\n0000000000 65535 f \n" + rows + end


def _stream(words: str, data: bytes) -> bytes:
    return f"<<{words}/Length {len(data)}>>\nstream\n".encode() + data + b"\nendstream"


def converted(pixels: NDArray[np.uint8], data: bytes, folder: Path, intent: int) -> NDArray[np.uint8]:
    source, result = folder / "page.pdf", folder / "page.png"
    source.write_bytes(page(pixels, data))
    how = ("-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", "-sDEVICE=png16m", "-r72", f"-dRenderIntent={intent}")
    run(program("gs", "ghostscript"), *how, f"-sOutputFile={result}", source)
    return np.asarray(module("PIL.Image", "pillow").open(result).convert("RGB"))


def picture(job: Job) -> Picture:
    return converted(job.image, job.lut("icc").read_bytes(), job.scratch, ABSOLUTE)


def white(folder: Path) -> Iterator[str]:
    """Check that white stays un-aged by the relative intent, also with a matrix, and ages by the absolute intent."""
    pixels = np.full((8, 8, 3), 255, np.uint8)
    meant = aged().code_to_code(np.ones((1, 3)))[0] * 255
    for name in ("icc", "icc-matrix"):
        for intent, ages in ((RELATIVE, False), (ABSOLUTE, True)):
            seen = converted(pixels, profile(name), folder, intent)[0, 0]
            if (np.abs(seen - meant).max() <= 2) != ages:
                yield f"{name}, intent {intent}: white is {seen}, and {meant.round()} is meant"


CONSUMERS = [Consumer("Ghostscript, -dRenderIntent=3", version, "aged.icc", "tetrahedral", picture)]

CLAIMS = [Claim("Ghostscript", version, "ages white by the absolute intent alone, with a matrix too", white)]
