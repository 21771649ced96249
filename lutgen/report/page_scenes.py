"""The pictures of the page of ``lutgen report``: for each mode and hour a table that is applied to the picture.

A script blends the tables of two hours, so that the slider can stand between hours. The page states the error of the
blended picture against the model. The page also holds a picture and a map of the last hour of each mode, which are
printed. The picture at its place on the screen is printed only as a still: the slider applies LUTs, and a LUT cannot
depend on the position.
"""

import zlib
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.lut import Lut, Sampler
from lutgen.bake.spaces import tetrahedra
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab, xyz_to_xyY
from lutgen.display import AgedDisplay, DisplayModel
from lutgen.display.on_screen import OnScreen
from lutgen.display.tips import parse_hours
from lutgen.errors import LutgenError
from lutgen.numerals import spaced
from lutgen.pictures.difference import DifferenceCurve
from lutgen.pictures.frame import Frame
from lutgen.pictures.lifetime import Lifetimes
from lutgen.pictures.viewer import WHITE, viewer_table
from lutgen.progress import Progress, unseen
from lutgen.report.drawing import data_address, page_png
from lutgen.report.page_template import PageSection, ticks

#: Possible ends of the maps' scale in ΔE2000. A page uses the first end that no map exceeds in more than 5 % of its
#: pixels. All maps of a page have the same end, so that they can be compared.
REACHES = (2.0, 3.0, 5.0, 8.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 100.0)

#: Number of colours of a map: enough to look continuous, few enough for a small file.
STEPS = 128

#: Most pixels of the picture, and of its rows: the page also holds a still and a map of each mode, and is sent by mail.
PIXELS, WIDTH = 700_000, 1200

#: Points along an edge of a table; a table has 20 kB.
SIZE = 17

#: Most hours of a page: with more hours the file would be too large.
MOST = 40


@dataclass(frozen=True)
class Numbers:
    """ΔE2000 of a picture on one display, over all pixels, and the display's white relative to the un-aged white."""

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
class PageScene:
    """One mode at one hour; ``table`` is from :func:`lutgen.pictures.viewer.viewer_table`, (n, n, n, 4)."""

    numbers: Numbers
    table: NDArray[np.uint16]


@dataclass(frozen=True)
class Still:
    """The last hour of a mode: addresses of the PNGs of picture and map, and the mean ΔE2000 of visible pixels."""

    picture: str
    map: str
    mean: float


@dataclass(frozen=True)
class Scenes:
    """All that the page shows of one image, by mode and hour."""

    #: The picture.
    frame: Frame
    #: Data address of the picture on the un-aged display.
    unaged: str
    #: Data address of the picture itself, to which the tables are applied.
    source: str
    #: Hours, increasing from 0.
    hours: tuple[float, ...]
    #: Mode → one scene for each hour.
    modes: dict[str, tuple[PageScene, ...]]
    #: Mode → still of its last hour.
    stills: dict[str, Still]
    #: ΔE2000 at the end of the colours of all maps; larger values have the last colour.
    reach: float
    #: ΔE2000 of the slider's pictures against the model, over the picture's pixels, at hours and half way between:
    #: mean, 95th percentile and largest.
    blending: tuple[float, float, float]


def hours_of(text: str | None, model: DisplayModel) -> tuple[list[float], list[float]]:
    """Return the hours of the tables, 0 first, and of the curve. Raises LutgenError: none, too many, or outside."""
    measured = model.tips.hours
    if text is None:
        # By default a page has tables for at most 13 hours.
        even = np.linspace(measured[0], measured[-1], 13)
        hours = [float(measured[np.abs(measured - hour).argmin()]) for hour in even]
    else:
        hours = parse_hours(text, model.tips)
    frames = sorted({0.0, *hours})
    if len(frames) > MOST:
        raise LutgenError(
            f"--hours {text}: a page holds tables of at most {MOST} hours, not {len(frames)}. Give a step, such as "
            f"0..{measured[-1]:g}:{measured[-1] / 6:g}."
        )
    return frames, sorted({*frames, *(float(hour) for hour in measured if hour <= frames[-1])})


def scenes_of(
    frame: Frame, model: DisplayModel, lifetimes: Lifetimes, hours: Sequence[float], progress: Progress = unseen
) -> Scenes:
    """Compute tables, numbers and stills of every mode at ``hours``; ``lifetimes`` has the whole image's ΔE there."""
    reach = reach_of(lifetimes, hours)
    curves, unaged = lifetimes.images[0].curves, model.at("stable", 0.0)
    sampler = Sampler()
    modes: dict[str, tuple[PageScene, ...]] = {}
    for mode, curve in curves.items():
        scenes = []
        for hour in hours:
            scenes.append(_scene(sampler, unaged, model.at(mode, hour), curve))
            progress(len(modes) * len(hours) + len(scenes), len(curves) * len(hours))
        modes[mode] = tuple(scenes)
    stills = {mode: _still(frame, unaged, model.at(mode, hours[-1]), reach) for mode in modes}
    seen, source = (picture_address(frame, shown) for shown in (frame.shown(unaged), frame.code))
    return Scenes(frame, seen, source, tuple(hours), modes, stills, reach, _blending(frame, model, modes))


def _scene(sampler: Sampler, unaged: AgedDisplay, aged: AgedDisplay, curve: DifferenceCurve) -> PageScene:
    (row,) = np.flatnonzero(curve.hours == aged.hours)
    x, y, luminance = xyz_to_xyY(aged.code_to_xyz(np.ones(3)))
    luminance /= unaged.code_to_xyz(np.ones(3))[1]
    mean, sd, p95, largest = (float(values[row]) for values in (curve.mean, curve.sd, curve.p95, curve.largest))
    numbers = Numbers(aged.mode, aged.hours, mean, sd, p95, largest, float(x), float(y), float(luminance))
    before, after = (sampler.lut(display, SIZE, "code", clip=True, whole=True).table for display in (unaged, aged))
    return PageScene(numbers, viewer_table(sampler.lut(aged, SIZE, "code", clip=True).table, (before, after)))


def _still(frame: Frame, unaged: AgedDisplay, aged: AgedDisplay, reach: float) -> Still:
    (difference,) = frame.differences(unaged, [aged])
    picture, map_ = picture_address(frame, frame.shown(aged)), map_address(frame, difference, reach)
    return Still(picture, map_, float(difference[frame.visible].mean()))


def _blending(frame: Frame, model: DisplayModel, modes: dict[str, tuple[PageScene, ...]]) -> tuple[float, float, float]:
    places = frame.places[frame.visible]
    # About 20 000 pixels are compared with the model.
    code = frame.colours[places[:: max(1, len(places) // 20_000)]] / 255.0
    nodes, weights = tetrahedra(code, "code", SIZE)
    differences = []
    for mode, scenes in modes.items():
        # The hours of the tables and the hours half way between, each with the table that the viewer applies.
        tables = [(each.numbers.hours, each.table[..., :3] / WHITE) for each in scenes]
        tables += [((one + two) / 2.0, (first + second) / 2.0) for (one, first), (two, second) in pairwise(tables)]
        for hours, table in tables:
            drawn = Lut("code", table).mix(nodes, weights)
            both = (linear_to_lab(code_to_linear(each)) for each in (drawn, model.at(mode, hours).code_to_code(code)))
            differences.append(delta_e_2000(*both))
    away = np.concatenate(differences)
    return float(away.mean()), float(np.quantile(away, 0.95)), float(away.max())


def picture_address(frame: Frame, shown: NDArray[np.uint8]) -> str:
    """Return the data address of a picture, which is transparent where the frame is transparent."""
    if frame.visible.all():
        return data_address(page_png(shown))
    alpha = np.where(frame.visible, 255, 0).astype(np.uint8)
    return data_address(page_png(np.dstack([shown, alpha])))


def map_address(frame: Frame, difference: NDArray[np.float64], reach: float) -> str:
    """Return the data address of a map of ΔE2000 (h, w) whose colours end at ``reach``."""
    level = np.minimum(difference / reach * STEPS, STEPS - 1).astype(np.uint8)
    # The last colour of the palette is for transparent pixels.
    level[~frame.visible] = STEPS
    return data_address(page_png(level, np.vstack([map_colours(), np.full((1, 3), 255, np.uint8)])))


def reach_of(lifetimes: Lifetimes, hours: Sequence[float]) -> float:
    """Return the end of the scale of all maps in ΔE2000: one of ``REACHES``, from the 95th percentiles."""
    largest = max(float(curve.p95[np.isin(curve.hours, hours)].max()) for curve in lifetimes.images[0].curves.values())
    return next((reach for reach in REACHES if reach >= largest), REACHES[-1])


def map_colours() -> NDArray[np.uint8]:
    """Return the colours of a map from 0 to its end, (STEPS, 3): viridis, which is perceptually uniform."""
    from matplotlib import colormaps

    return np.rint(colormaps["viridis"](np.linspace(0.0, 1.0, STEPS))[:, :3] * 255.0).astype(np.uint8)


#: Mode → clause on the display in this mode.
MODES_IN_WORDS = {"chroma": "while a sensor holds the luminance", "chroma-luma": "when the luminance falls as well"}

#: Numbers beside the picture: key → name.
TILES = {
    "mean": "mean ΔE2000",
    "sd": "SD",
    "p95": "95 % are below",
    "max": "largest ΔE2000",
    "white": "white x, y",
    "luminance": "white's luminance",
}


def colour_bar(reach: float) -> dict[str, Any]:
    """Return the colour bar of all maps with the end ``reach``: picture, and marks in percent of its length."""
    marks = [(f"{100 * value / reach:g}", f"{value:g}") for value in ticks(reach) if value <= 0.9 * reach]
    marks.append(("100", f"≥\N{NARROW NO-BREAK SPACE}{reach:g}"))
    return {
        "address": data_address(page_png(map_colours()[None])),
        "steps": STEPS,
        "reach": f"{reach:g}",
        "marks": marks,
    }


def numbers_in_words(numbers: Numbers) -> dict[str, str]:
    """Return the numbers as text."""
    return {
        **{name: f"{getattr(numbers, name):.2f}" for name in ("mean", "sd", "p95", "max")},
        "white": f"{numbers.white_x:.4f}, {numbers.white_y:.4f}",
        "luminance": f"{100 * numbers.luminance:.1f} %",
    }


def viewer_section(scenes: Scenes) -> PageSection:
    """Return the section with the slider, the wiper and the map."""
    (mean, p95, largest), hours = scenes.blending, len(scenes.hours)
    between = "a table an hour, blended between hours" if hours > 1 else "one table"
    blending = (
        f"The slider draws through {hours} × {SIZE}³ colours a mode, {between}: ΔE2000 {mean:.2f} from the model "
        f"in mean, {p95:.2f} at 95 % and {largest:.1f} at most, over this picture's pixels."
    )
    values = {
        "modes": list(scenes.modes),
        "hours": scenes.hours,
        "tiles": TILES,
        "source": scenes.source,
        "width": scenes.frame.width,
        "height": scenes.frame.height,
        "bar": colour_bar(scenes.reach),
        "blending": blending,
    }
    title, label = "The picture as the display ages", "The picture on the aged display"
    return PageSection("viewer", title, "viewer.html", values, kind="live", label=label)


def frames_section(scenes: Scenes) -> PageSection:
    """Return the section with the un-aged picture, and with picture, map and numbers at each mode's last hour."""
    modes = [
        (mode, MODES_IN_WORDS.get(mode, mode), still, scenes.modes[mode][-1].numbers)
        for mode, still in scenes.stills.items()
    ]
    values = {"unaged": scenes.unaged, "bar": colour_bar(scenes.reach), "modes": modes}
    return PageSection("frames", f"The picture at {spaced(scenes.hours[-1])} h", "frames.html", values, kind="still")


def script_data(scenes: Scenes) -> dict[str, Any]:
    """Return the data of the script, which other programs may read too."""
    return {
        "schema": 2,
        "hours": list(scenes.hours),
        "modes": {mode: [asdict(each.numbers) for each in all_hours] for mode, all_hours in scenes.modes.items()},
        "table_size": SIZE,
        "tables": {mode: [packed(each.table) for each in all_hours] for mode, all_hours in scenes.modes.items()},
        "map_reach": scenes.reach,
    }


def packed(table: NDArray[np.uint16]) -> str:
    """Pack a table (n, n, n, 4): differences along red, all high bytes before all low bytes, deflated, in base64."""
    steps = table.copy()
    steps[:, :, 1:] -= table[:, :, :-1]
    planes = steps.astype(">u2").reshape(-1, 1).view(np.uint8).T
    return b64encode(zlib.compress(np.ascontiguousarray(planes).tobytes(), 9)).decode()


@dataclass(frozen=True)
class PlacedStills:
    """A picture on the screen at the last hour of its scenes."""

    #: Where the picture lies.
    on_screen: OnScreen
    #: Data address of the picture on the un-aged display.
    unaged: str
    #: Mode → its still.
    modes: dict[str, Still]


def placed_stills(scenes: Scenes, model: DisplayModel, on_screen: OnScreen) -> PlacedStills:
    """Compute the stills at the last hour of ``scenes``; ``model`` depends on the place (:meth:`OnScreen.aged`)."""
    frame, unaged = replace(scenes.frame, on_screen=on_screen), on_screen.unaged(model)
    stills = {mode: _still(frame, unaged, model.at(mode, scenes.hours[-1]), scenes.reach) for mode in scenes.modes}
    return PlacedStills(on_screen, picture_address(frame, frame.shown(unaged)), stills)


def on_screen_section(stills: PlacedStills, scenes: Scenes) -> PageSection:
    """Return the section with the stills and their sentences."""
    hours, titles = spaced(scenes.hours[-1]), MODES_IN_WORDS
    modes = [(mode, titles.get(mode, mode), still, f"{still.mean:.1f}") for mode, still in stills.modes.items()]
    sentences, bar = stills.on_screen.sentences(), colour_bar(scenes.reach)
    values = {"sentences": sentences, "unaged": stills.unaged, "hours": hours, "bar": bar, "modes": modes}
    return PageSection("on-screen", f"On the screen at {hours} h", "on_screen.html", values)
