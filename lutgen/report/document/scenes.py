"""The scenes of a report: for each mode and hour the aged picture, its ΔE2000 map and the numbers beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_xyY
from lutgen.display.hours import parse_hours
from lutgen.errors import LutgenError
from lutgen.pictures.png import page_png
from lutgen.report.drawing import data_address

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from lutgen.display import AgedDisplay, DisplayModel
    from lutgen.pictures.difference import DifferenceCurve
    from lutgen.pictures.frame import Frame
    from lutgen.pictures.lifetime import Lifetimes

#: ΔE2000 at which the colours of the maps may end. A page takes the first of them that no map exceeds in more than 5 %
#: of its pixels, and takes it for all its maps, so that they can be compared.
REACHES = (2.0, 3.0, 5.0, 8.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 100.0)

#: Colours of a map: so many look continuous, and few colours keep the file small.
STEPS = 128

#: Pixels of all frames of a page together: with their maps about 10 MB as text.
PIXELS = 3_500_000

#: Width of a frame in pixels, at most.
WIDTH = 900

#: Hours for which a page shows frames by default.
USUAL = 7

#: Hours of a page, at most: with more, the frames would be too small.
MOST = 40


@dataclass(frozen=True)
class Numbers:
    """Numbers of a picture on one display: ΔE2000 over all pixels of the image, and the display's white.

    ``luminance`` is relative to the un-aged display's white.
    """

    mode: str
    hours: float
    mean: float
    sd: float
    p95: float
    max: float
    white_x: float
    white_y: float
    luminance: float


@dataclass(frozen=True)
class Scene:
    """One mode at one hour; ``picture`` and ``map`` are data addresses of a PNG."""

    numbers: Numbers
    picture: str
    map: str


@dataclass(frozen=True)
class Scenes:
    """All scenes.

    Attributes
    ----------
    frame
        The picture.
    unaged
        Data address of what the un-aged display shows.
    hours
        Increasing from 0.
    modes
        Mode → one scene for each hour.
    reach
        ΔE2000 at the end of the colours of all maps; larger values have the last colour.

    """

    frame: Frame
    unaged: str
    hours: tuple[float, ...]
    modes: dict[str, tuple[Scene, ...]]
    reach: float


def hours_of(text: str | None, model: DisplayModel) -> tuple[list[float], list[float]]:
    """Return the hours of the slider, hour 0 first, and of the curve, which adds the measured times up to the last.

    Raises
    ------
    LutgenError
        ``text`` holds no hours, hours outside the measured span, or more than ``MOST``.

    """
    measured = model.tips.hours
    if text is None:
        even = np.linspace(measured[0], measured[-1], USUAL)
        hours = [float(measured[np.abs(measured - hour).argmin()]) for hour in even]
    else:
        hours = parse_hours(text, model.tips)
    frames = sorted({0.0, *hours})
    if len(frames) > MOST:
        message = (
            f"--hours {text}: a page shows at most {MOST} hours, not {len(frames)}. Give a step, such as "
            f"0..{measured[-1]:g}:{measured[-1] / 6:g}."
        )
        raise LutgenError(message)
    return frames, sorted({*frames, *(float(hour) for hour in measured if hour <= frames[-1])})


def pixels_of_a_frame(hours: int, modes: int) -> int:
    """Return the most pixels of a frame, so that a page with this many hours stays small enough for mail.

    At hour 0 all modes share one frame.
    """
    return PIXELS // (1 + (hours - 1) * modes)


def scenes_of(
    frame: Frame,
    model: DisplayModel,
    lifetimes: Lifetimes,
    hours: Sequence[float],
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Scenes:
    """Make every scene.

    Parameters
    ----------
    frame
        The picture.
    model
        The display.
    lifetimes
        Lifetimes of the whole image, at least at these hours: the numbers are those of the image, not of the frame.
    hours
        Increasing from 0.
    progress
        Called with the number of finished scenes and the number of all scenes.

    """
    reach = reach_of(lifetimes, hours)
    curves, unaged = lifetimes.images[0].curves, model.at("stable", 0.0)
    count, modes = 0, {}
    for mode, curve in curves.items():
        scenes = []
        for hour in hours:
            scenes.append(_scene(frame, unaged, model.at(mode, hour), curve, reach))
            count += 1
            progress(count, len(curves) * len(hours))
        modes[mode] = tuple(scenes)
    return Scenes(frame, _picture(frame, frame.shown(unaged)), tuple(hours), modes, reach)


def _scene(frame: Frame, unaged: AgedDisplay, aged: AgedDisplay, curve: DifferenceCurve, reach: float) -> Scene:
    (row,) = np.flatnonzero(curve.hours == aged.hours)
    x, y, luminance = xyz_to_xyY(aged.code_to_xyz(np.ones(3)))
    luminance /= unaged.code_to_xyz(np.ones(3))[1]
    mean, sd, p95, largest = (float(values[row]) for values in (curve.mean, curve.sd, curve.p95, curve.largest))
    numbers = Numbers(aged.mode, aged.hours, mean, sd, p95, largest, float(x), float(y), float(luminance))
    (difference,) = frame.differences(unaged, [aged])
    return Scene(numbers, _picture(frame, frame.shown(aged)), _map(frame, difference, reach))


def _picture(frame: Frame, shown: NDArray[np.uint8]) -> str:
    if frame.visible.all():
        return data_address(page_png(shown))
    alpha = np.where(frame.visible, 255, 0).astype(np.uint8)
    return data_address(page_png(np.dstack([shown, alpha])))


def _map(frame: Frame, difference: NDArray[np.float64], reach: float) -> str:
    level = np.minimum(difference / reach * STEPS, STEPS - 1).astype(np.uint8)
    # The last colour of the palette is for transparent pixels.
    level[~frame.visible] = STEPS
    return data_address(page_png(level, np.vstack([map_colours(), np.full((1, 3), 255, np.uint8)])))


def reach_of(lifetimes: Lifetimes, hours: Sequence[float]) -> float:
    """Return the ΔE2000 at which the colours of all maps end: one of ``REACHES``, by the 95th percentiles."""
    largest = max(float(curve.p95[np.isin(curve.hours, hours)].max()) for curve in lifetimes.images[0].curves.values())
    return next((reach for reach in REACHES if reach >= largest), REACHES[-1])


def map_colours() -> NDArray[np.uint8]:
    """Return the colours of a map from 0 to its end, (STEPS, 3): viridis, which is even to the eye."""
    from matplotlib import colormaps

    colours = colormaps["viridis"](np.linspace(0.0, 1.0, STEPS))[:, :3]
    return np.rint(colours * 255.0).astype(np.uint8)
