"""The object in the imaging process, which reads one image and then ends. The image may be broken."""

import pickle
from pathlib import Path
from typing import Any

from lutgen.errors import LutgenError
from lutgen.explore.process import Hosted
from lutgen.pictures.distinct import count_colours
from lutgen.pictures.frame import plain_png, read_pixels
from lutgen.pictures.images import open_source

#: Most pixels of the shown picture, and of its rows. Larger images are shown reduced, but measured in full.
SHOWN, WIDEST = 2_000_000, 2560

#: Pixels of the largest image that the page accepts. Larger images need the command line.
MOST_PIXELS = 150_000_000


class Imaging(Hosted):
    """Reads an image. The window calls its methods."""

    def read(self, path: str, to: str) -> dict[str, Any]:
        """Write the shown picture (PNG); return its size and the image's size."""
        with open_source(Path(path)) as source:
            pixels = source.width * source.height
        if pixels > MOST_PIXELS:
            raise LutgenError(
                f"{Path(path).name}: has {pixels / 1e6:.0f} million pixels, more than {MOST_PIXELS / 1e6:.0f} million. "
                f"Use the command line for it: lutgen lifetime, lutgen report."
            )
        code, _, (width, height) = read_pixels(Path(path), pixels=SHOWN, width=WIDEST)
        Path(to).write_bytes(plain_png(code))
        note = "Shown pixel by pixel." if code.shape[1] == width else "Shown smaller, measured in full."
        shown = {"shown_width": code.shape[1], "shown_height": code.shape[0]}
        return {"width": width, "height": height, **shown, "note": note}

    def count(self, path: str, to: str) -> dict[str, Any]:
        """Write the counted colours of the whole image, for the showing process."""
        Path(to).write_bytes(pickle.dumps(count_colours(Path(path))))
        return {}
