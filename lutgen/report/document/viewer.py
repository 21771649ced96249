"""The picture as the display ages: the viewer, which needs a script, and all frames, which are printed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from lutgen.numerals import spaced
from lutgen.pictures.png import page_png
from lutgen.report.document.chart import ticks
from lutgen.report.document.scenes import map_colours
from lutgen.report.document.section import PageSection
from lutgen.report.drawing import data_address

if TYPE_CHECKING:
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
            "width": scenes.frame.width,
            "height": scenes.frame.height,
            "bar": colour_bar(scenes.reach),
        },
        kind="live",
        label="The picture on the aged display",
    )


def frames_section(scenes: Scenes) -> PageSection:
    """Gather every frame and map, and the numbers."""
    modes = [
        (
            mode,
            MODES_IN_WORDS.get(mode, mode),
            [
                {
                    "hours": each.numbers.hours,
                    "picture": each.picture,
                    "map": each.map,
                    "mean": f"{each.numbers.mean:.1f}",
                    "p95": f"{each.numbers.p95:.1f}",
                    "as_unaged": each.picture == scenes.unaged,
                }
                for each in scenes_of_mode
            ],
        )
        for mode, scenes_of_mode in scenes.modes.items()
    ]
    values = {"unaged": scenes.unaged, "bar": colour_bar(scenes.reach), "modes": modes}
    return PageSection("frames", "The picture at each hour", "frames.html", values, kind="still")


def script_data(scenes: Scenes) -> dict[str, Any]:
    """Return what the script needs, and other programs may read."""
    return {
        "schema": 1,
        "hours": list(scenes.hours),
        "modes": {
            mode: [asdict(each.numbers) for each in scenes_of_mode] for mode, scenes_of_mode in scenes.modes.items()
        },
        "shown": {
            mode: [numbers_in_words(each.numbers) for each in scenes_of_mode]
            for mode, scenes_of_mode in scenes.modes.items()
        },
        "map_reach": scenes.reach,
        "hour_names": [f"{spaced(hours)} h" for hours in scenes.hours],
    }
