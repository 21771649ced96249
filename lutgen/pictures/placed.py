"""A small picture as it lies on a screen: each pixel is aged at its own place, and its ΔE2000 found there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lutgen.display.chain import viewer_code
from lutgen.display.on_screen import linear_at
from lutgen.pictures.difference import DifferenceCurve, differences, statistics

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay, DisplayModel
    from lutgen.display.on_screen import OnScreen

#: Code values, shape (h, w, 3).
Pixels = NDArray[np.uint8]


def placed_picture(code: Pixels, display: AgedDisplay, on_screen: OnScreen) -> Pixels:
    """Return what an un-aged sRGB viewer shows of a picture on the screen of a display, code values (h, w, 3)."""
    linear = linear_at(display, code.reshape(-1, 3) / 255.0, _places(code, on_screen))
    return np.rint(viewer_code(linear) * 255.0).astype(np.uint8).reshape(code.shape)


def placed_differences(code: Pixels, unaged: AgedDisplay, aged: Sequence[AgedDisplay], on_screen: OnScreen) -> Array:
    """ΔE2000 of each pixel on each aged display, against the un-aged one: shape (len(aged), h, w)."""
    flat, place = code.reshape(-1, 3), _places(code, on_screen)
    found = differences(lambda part: flat[part] / 255.0, len(flat), unaged, aged, places=place.__getitem__)
    return found.reshape(len(aged), *code.shape[:2])


def placed_curves(
    code: Pixels,
    counted: NDArray[np.bool_],
    model: DisplayModel,
    on_screen: OnScreen,
    *,
    modes: Sequence[str],
    hours: Sequence[float],
) -> dict[str, DifferenceCurve]:
    """Return the curve of each mode, over the pixels that count: where ``counted`` (h, w)."""
    unaged, curves = on_screen.unaged(model), {}
    for mode in modes:
        found = placed_differences(code, unaged, [model.at(mode, hour) for hour in hours], on_screen)[:, counted]
        figures = np.array([statistics(each, np.ones(len(each), np.int64)) for each in found])
        curves[mode] = DifferenceCurve(np.array(hours), *figures.T)
    return curves


def _places(code: Pixels, on_screen: OnScreen) -> Array:
    """Place of each pixel on the screen, (h·w, 2)."""
    high, wide = code.shape[:2]
    return on_screen.places(0, high * wide, (high, wide))
