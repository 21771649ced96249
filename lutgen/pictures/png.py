"""PNG in memory, by Pillow: OpenImageIO writes no palettes, and adds chunks of its own."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from lutgen.errors import LutgenError

#: Pixels, uint8 of shape (height, width, 3).
Pixels = NDArray[np.uint8]

#: What 16 bits number, 0 aside.
MOST_LABELS = 65_535

#: How hard zlib tries: pictures of a page are sent by mail.
SMALLEST = 9


def plain_png(pixels: Pixels) -> bytes:
    """Return the PNG of pixels, uint8 of shape (height, width, 3), uncompressed: its size tells width and height alone.

    Gamma, chromaticities, resolution or texts would change how some programs show the picture.
    """
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "png", compress_level=0)
    return file.getvalue()


def labels_png(labels: NDArray[np.int32]) -> bytes:
    """Return the PNG of labels (h, w) as grey levels of 16 bit, which masks are read from; below 0 is ground.

    Raises
    ------
    LutgenError
        There are more labels than such a file can tell apart.

    """
    from PIL import Image

    if labels.max() > MOST_LABELS:
        message = f"{labels.max()} nuclei are more than a PNG of 16 bit can number ({MOST_LABELS}). Cut the image."
        raise LutgenError(message)
    file = io.BytesIO()
    Image.fromarray(np.maximum(labels, 0).astype(np.uint16)).save(file, "png")
    return file.getvalue()


def page_png(pixels: NDArray[np.uint8], palette: NDArray[np.uint8] | None = None) -> bytes:
    """Return the PNG of RGB or RGBA, (h, w, 3 or 4), or with a ``palette`` (n, 3) of its indices (h, w).

    It says that its colours are sRGB, and is as small as zlib makes it.
    """
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
