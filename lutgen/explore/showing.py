"""What the showing process holds: the model that is shown and the image, for tables and colour differences."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.bake.lut import SIZES, Sampler
from lutgen.bake.plan import display_to_bake
from lutgen.errors import LutgenError, pick_one
from lutgen.names import AGING_MODES, DIRECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.display import DisplayModel
    from lutgen.pictures.curve import Curve
    from lutgen.pictures.distinct import Colours

#: Kind of a table → the direction of ``lutgen build``.
KINDS = dict(zip(("aged", "compensated"), DIRECTIONS, strict=True))

#: Pixels of the picture that is shown, and in a row of it; larger images are shown smaller, and measured in full.
SHOWN, WIDEST = 3_000_000, 2560

#: Pixels of an image that is taken: larger ones are for the command line.
MOST_PIXELS = 150_000_000


class Showing:
    """A model and an image, asked by the window (:mod:`lutgen.explore.process`)."""

    #: Reading and measuring an image takes a while: tables do not wait.
    beside = frozenset({"image", "difference"})

    def __init__(self, _tell: Callable[..., None]) -> None:
        """Begin with neither."""
        self._model: DisplayModel | None = None
        self._sampler = Sampler()
        self._image: tuple[Path, Colours | None] | None = None
        self._curves: dict[str, Curve] = {}

    def idle(self) -> bool:
        """Nothing is done unasked."""
        return False

    def show(self, body: bytes) -> dict[str, Any]:
        """Show another model."""
        self._model, self._sampler, self._curves = pickle.loads(body), Sampler(), {}  # noqa: S301 - the other process's
        return {}

    @property
    def _shown(self) -> DisplayModel:
        if self._model is None:
            raise LutgenError("no readings are open. Drop a table of readings (.csv) first.")
        return self._model

    def table(self, mode: str, hours: float, size: int, kind: str) -> bytes:
        """Bake the table that ``lutgen build --format cube`` writes: RGBA of 16 bits, red fastest, little-endian."""
        if kind not in KINDS:
            raise pick_one("kind", kind, KINDS)
        if size not in SIZES:
            raise pick_one("size", size, map(str, SIZES))
        display = display_to_bake(self._shown, mode, hours, direction=KINDS[kind])
        table = self._sampler.lut(display, size, "code", clip=True).table
        pixels = np.full((*table.shape[:3], 4), 65535, "<u2")
        pixels[..., :3] = np.rint(table * 65535.0)
        return pixels.tobytes()

    def image(self, path: str, to: str) -> dict[str, Any]:
        """Take an image: write the picture that is shown of it (PNG), and say how large both are."""
        from lutgen.pictures.frame import read_pixels
        from lutgen.pictures.images import open_source
        from lutgen.pictures.png import plain_png

        with open_source(Path(path)) as source:
            if source.width * source.height > MOST_PIXELS:
                raise LutgenError(
                    f"the image has {source.width} × {source.height} pixels, more than {MOST_PIXELS // 1_000_000} "
                    f"million. Use the command line for it: lutgen lifetime, lutgen report."
                )
        code, _, (width, height) = read_pixels(Path(path), pixels=SHOWN, width=WIDEST)
        Path(to).write_bytes(plain_png(code))
        self._image, self._curves = (Path(path), None), {}
        shown = {"width": width, "height": height, "shown_width": code.shape[1], "shown_height": code.shape[0]}
        smaller = code.shape[1] < width
        note = "Shown smaller, measured in full." if smaller else "Shown pixel by pixel."
        return {**shown, "note": note}

    def difference(self, mode: str, hours: float) -> dict[str, float | None]:
        """Measure the whole image as ``lutgen lifetime`` does: at an hour, and the hours until it passes 3 and 5."""
        from lutgen.pictures.curve import curves_of
        from lutgen.pictures.difference import few_threads
        from lutgen.pictures.lifetime import TOLERANCES

        if mode not in AGING_MODES:
            raise pick_one("mode", mode, AGING_MODES)
        model = self._shown
        if self._image is None:
            return dict.fromkeys(("mean", "mean_2sd", "hours_to_3", "hours_to_5"))
        with few_threads(1):
            colours = self._colours(self._image)
            now = curves_of(colours, model, [mode], [hours])[mode]
            if mode not in self._curves or model is not self._model:
                measured = sorted({0.0, *map(float, model.tips.hours)})
                self._curves[mode] = curves_of(colours, model, [mode], measured)[mode]
        until = {f"hours_to_{each:g}": self._curves[mode].hours_until("mean", each) for each in TOLERANCES}
        return {"mean": float(now.mean[0]), "mean_2sd": float(now.max[0]), **until}

    def _colours(self, image: tuple[Path, Colours | None]) -> Colours:
        from lutgen.pictures.distinct import count_colours

        path, colours = image
        if colours is None:
            colours = count_colours(path)
            self._image = (path, colours)
        return colours
