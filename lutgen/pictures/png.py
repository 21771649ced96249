"""PNG in memory, by Pillow: OpenImageIO writes no palettes, and adds chunks of its own."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

#: Pixels, uint8 of shape (height, width, 3).
Pixels = NDArray[np.uint8]

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
