"""The picture as the display ages: the viewer, which needs a script, and the last hours, which are printed."""

from __future__ import annotations

import zlib
from base64 import b64encode
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.numerals import spaced
from lutgen.pictures.png import page_png
from lutgen.report.document.chart import ticks
from lutgen.report.document.scenes import SIZE, map_colours
from lutgen.report.document.section import PageSection
from lutgen.report.drawing import data_address

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.report.document.scenes import Numbers, Scenes

#: Mode → what happens to the display in it.
MODES_IN_WORDS = {
    "chroma": "while a sensor holds the luminance",
    "chroma-luma": "when the luminance falls as well",
}

#: Numbers that are shown beside the picture: key → name.
TILES = {
    "mean": "mean ΔE2000",
    "sd": "SD",
    "p95": "95 % are below",
    "max": "largest ΔE2000",
    "white": "white x, y",
    "luminance": "white's luminance",
}


@dataclass(frozen=True)
class ColourBar:
    """What the colours of a map mean: its picture, ΔE2000 at its end, and marks as percent of its length and text."""

    address: str
    steps: int
    reach: str
    marks: list[tuple[str, str]]


def colour_bar(reach: float) -> ColourBar:
    """Make the bar of all maps, whose colours end at ``reach``."""
    colours = map_colours()
    marks = [(f"{100 * value / reach:g}", f"{value:g}") for value in ticks(reach) if value <= 0.9 * reach]
    last = f"≥\N{NARROW NO-BREAK SPACE}{reach:g}"
    return ColourBar(data_address(page_png(colours[None])), len(colours), f"{reach:g}", [*marks, ("100", last)])


def numbers_in_words(numbers: Numbers) -> dict[str, str]:
    """Write the numbers as people read them."""
    return {
        "mean": f"{numbers.mean:.2f}",
        "sd": f"{numbers.sd:.2f}",
        "p95": f"{numbers.p95:.2f}",
        "max": f"{numbers.max:.2f}",
        "white": f"{numbers.white_x:.4f}, {numbers.white_y:.4f}",
        "luminance": f"{100 * numbers.luminance:.1f} %",
    }


def viewer_section(scenes: Scenes) -> PageSection:
    """Gather what the slider, the wiper and the map show."""
    return PageSection(
        "viewer",
        "The picture as the display ages",
        "viewer.html",
        {
            "modes": list(scenes.modes),
            "hours": scenes.hours,
            "tiles": TILES,
            "source": scenes.source,
            "width": scenes.frame.width,
            "height": scenes.frame.height,
            "bar": colour_bar(scenes.reach),
            "blending": blending_in_words(scenes),
        },
        kind="live",
        label="The picture on the aged display",
    )


def blending_in_words(scenes: Scenes) -> str:
    """Say how far the slider's picture is from the model."""
    found, hours = scenes.blending, len(scenes.hours)
    between = "a table an hour, blended between hours" if hours > 1 else "one table"
    return (
        f"The slider draws through {hours} × {SIZE}³ colours a mode, {between}: ΔE2000 {found.mean:.2f} from the model "
        f"in mean, {found.p95:.2f} at 95 % and {found.max:.1f} at most, over this picture's pixels."
    )


def frames_section(scenes: Scenes) -> PageSection:
    """Gather the un-aged picture, and picture, map and numbers at the last hour of each mode."""
    modes = [
        (mode, MODES_IN_WORDS.get(mode, mode), still, scenes.modes[mode][-1].numbers)
        for mode, still in scenes.stills.items()
    ]
    values = {"unaged": scenes.unaged, "bar": colour_bar(scenes.reach), "modes": modes}
    title = f"The picture at {spaced(scenes.hours[-1])} h"
    return PageSection("frames", title, "frames.html", values, kind="still")


def script_data(scenes: Scenes) -> dict[str, Any]:
    """Return what the script needs, and other programs may read."""
    return {
        "schema": 2,
        "hours": list(scenes.hours),
        "modes": {mode: [asdict(each.numbers) for each in all_hours] for mode, all_hours in scenes.modes.items()},
        "table_size": SIZE,
        "tables": {mode: [packed(each.table) for each in all_hours] for mode, all_hours in scenes.modes.items()},
        "map_reach": scenes.reach,
    }


def packed(table: NDArray[np.uint16]) -> str:
    """Pack a table (n, n, n, 4) as text: what changes along red, first all high bytes, then all low ones, deflated."""
    steps = table.copy()
    steps[:, :, 1:] -= table[:, :, :-1]
    planes = steps.astype(">u2").reshape(-1, 1).view(np.uint8).T
    return b64encode(zlib.compress(np.ascontiguousarray(planes).tobytes(), 9)).decode()
