"""The object of the imaging process, which reads one image, possibly a broken one, and then ends."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.pictures.distinct import count_colours
from lutgen.pictures.frame import plain_png, read_pixels
from lutgen.pictures.images import open_source

if TYPE_CHECKING:
    from collections.abc import Callable

#: Pixels of the picture that is shown, and in a row of it; larger images are shown smaller, and measured in full.
SHOWN, WIDEST = 2_000_000, 2560

#: Pixels of the largest image that the page accepts; larger images are for the command line.
MOST_PIXELS = 150_000_000


class Imaging:
    """An image, read by the window (:mod:`lutgen.explore.process`)."""

    beside = frozenset[str]()

    def __init__(self, _tell: Callable[..., None]) -> None:
        """Begin with none."""

    def idle(self) -> bool:
        """Return False: there is no work without a call."""
        return False

    def read(self, path: str, to: str) -> dict[str, Any]:
        """Write the picture that is shown (PNG), and say how large it and the image are."""
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
        """Write the colours of the whole image, for the showing process to measure."""
        Path(to).write_bytes(pickle.dumps(count_colours(Path(path))))
        return {}
