"""How long pictures stay true: the finding of the page, its curves with Table 1, and the numbers of every frame."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.report.document.chart import chart
from lutgen.report.document.section import PageSection
from lutgen.report.document.viewer import MODES_IN_WORDS, TILES, numbers_in_words
from lutgen.report.parts import Table
from lutgen.report.pictures.lifetime import lifetime_page

if TYPE_CHECKING:
    from lutgen.pictures.lifetime import Lifetimes
    from lutgen.report.document.scenes import Scene, Scenes


def finding(lifetimes: Lifetimes) -> str:
    """Say in one sentence for how long the display is good for pictures."""
    tolerance = min(lifetimes.tolerances)
    parts = []
    for mode, curve in lifetimes.images[0].curves.items():
        hours = curve.hours_until("mean", tolerance)
        when = f"after {spaced(round(hours))} h" if hours is not None else f"not within {spaced(lifetimes.last)} h"
        how = f"{MODES_IN_WORDS[mode]} ({mode})" if mode in MODES_IN_WORDS else f"in mode {mode}"
        parts.append(f"{when} {how}")
    return f"This picture has changed by a mean ΔE2000 of {tolerance:g} {', and '.join(parts)}."


def picture_caption(lifetimes: Lifetimes, scenes: Scenes) -> str:
    """Say which image it is, and how much of it the frames show."""
    frame, name = scenes.frame, Path(lifetimes.images[0].file).name
    size = f"{spaced(frame.source_width)} × {spaced(frame.source_height)} pixels"
    if frame.whole:
        return f"{name}, {size}, shown whole."
    return f"{name}, {size}, shown at {frame.width} × {frame.height}; numbers are those of all pixels."


def lifetimes_section(lifetimes: Lifetimes, scenes: Scenes) -> PageSection:
    """Gather the curves, Table 1 and the numbers of every frame."""
    # The section on provenance names the source of the readings.
    source = lifetimes.model.measurements.provenance
    values = {
        "chart": chart(lifetimes),
        "page": [part for part in lifetime_page(lifetimes) if part != source],
        "tables": [_numbers(mode, of_mode) for mode, of_mode in scenes.modes.items()],
    }
    return PageSection("lifetimes", "How long pictures stay true", "lifetimes.html", values)


def _numbers(mode: str, scenes: tuple[Scene, ...]) -> Table:
    rows = [(spaced(each.numbers.hours), *numbers_in_words(each.numbers).values()) for each in scenes]
    return Table(("hours", *TILES.values()), rows, words=(), caption=f"{mode}, at the hours shown")
