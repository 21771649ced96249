"""The section of the page of ``lutgen report`` that shows the picture as it lies on the screen.

The slider's tables are LUTs and know no places, so that the section holds stills: the un-aged display, and picture and
map of the last hour of each mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.pictures.placed import placed_differences, placed_picture
from lutgen.report.page_scenes import MODES_IN_WORDS, Still, colour_bar, map_address, picture_address
from lutgen.report.page_template import PageSection

if TYPE_CHECKING:
    from lutgen.display import DisplayModel
    from lutgen.display.on_screen import OnScreen
    from lutgen.report.page_scenes import Scenes


@dataclass(frozen=True)
class PlacedStills:
    """A picture on the screen at one hour."""

    #: Of the stills.
    hours: float
    #: Where the picture lies.
    on_screen: OnScreen
    #: Data address of what the un-aged display shows.
    unaged: str
    #: Mode → its still, and the mean ΔE2000 over the picture's pixels.
    modes: dict[str, tuple[Still, float]]
    #: ΔE2000 at the end of the maps' colours.
    reach: float


def placed_stills(scenes: Scenes, model: DisplayModel, on_screen: OnScreen) -> PlacedStills:
    """Draw the stills at the last hour of ``scenes``; ``model`` knows places (:meth:`OnScreen.aged`)."""
    frame, hours, reach = scenes.frame, scenes.hours[-1], scenes.reach
    code, unaged = frame.colours[frame.places], on_screen.unaged(model)
    found = {}
    for mode in scenes.modes:
        aged = model.at(mode, hours)
        (difference,) = placed_differences(code, unaged, [aged], on_screen)
        picture = picture_address(frame, placed_picture(code, aged, on_screen))
        found[mode] = Still(picture, map_address(frame, difference, reach)), float(difference[frame.visible].mean())
    before = picture_address(frame, placed_picture(code, unaged, on_screen))
    return PlacedStills(hours, on_screen, before, found, reach)


def on_screen_section(stills: PlacedStills) -> PageSection:
    """Gather the stills and what is to be said of them."""
    modes = [
        (mode, MODES_IN_WORDS.get(mode, mode), still, f"{mean:.1f}") for mode, (still, mean) in stills.modes.items()
    ]
    values = {
        "sentences": stills.on_screen.sentences(),
        "unaged": stills.unaged,
        "hours": spaced(stills.hours),
        "bar": colour_bar(stills.reach),
        "modes": modes,
    }
    return PageSection("on-screen", f"On the screen at {spaced(stills.hours)} h", "on_screen.html", values)
