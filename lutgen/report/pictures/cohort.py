"""The page of ``lutgen cohort``: for each mode a line a slide, and the median over all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.appearance.cohort.spread import coverage
from lutgen.numerals import spaced
from lutgen.report.parts import Headline, Table
from lutgen.report.pictures.lifetime import COLUMNS, hours_or_never

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.appearance.cohort import Cohort
    from lutgen.appearance.cohort.spread import Lives
    from lutgen.report.parts import Part


def cohort_page(found: Cohort) -> Iterator[Part]:
    """Yield what ``lutgen cohort`` prints."""
    yield counted(found)
    yield ""
    if found.lives:
        for mode in found.modes:
            yield mode_table(found, mode)
            yield ""
        yield explained(found)
        yield found.slides.model.measurements.provenance
        yield from found.slides.remarks()
    for each in found.broken:
        yield Headline(f"Broken: {each.file}: {each.reason}")


def counted(found: Cohort) -> str:
    """Say in one or two sentences what was done."""
    done, broken = len(found.slides.images), len(found.broken)
    said = f"{_slides(done)} in {found.folder}"
    if found.kept:
        said += f", {found.kept} of them from an earlier run"
    if not broken:
        return f"{said}."
    return f"{said}; {_slides(broken)} broken, named below and left out of all figures. The same command tries again."


def mode_table(found: Cohort, mode: str) -> Table:
    """Rows are slides, then what they have in common; columns the hours until Max and Avg reach each tolerance."""
    columns = [(tolerance, statistic) for tolerance in found.slides.tolerances for statistic in COLUMNS]
    heads = (f"{COLUMNS[statistic]} ΔE2000 {tolerance:g}" for tolerance, statistic in columns)
    rows = []
    for image in found.slides.images:
        curve = image.curves[mode]
        lives = (curve.hours_until(statistic, tolerance) for tolerance, statistic in columns)
        rows.append((image.file, *map(hours_or_never, lives)))
    over_all = [found.lives[mode][tolerance][statistic] for tolerance, statistic in columns]
    medians = (hours_or_never(lives.median) for lives in over_all)
    rows.append((f"median of {_slides(len(found.slides.images))}", *medians))
    rows.append(("95 % interval" if over_all[0].interval else "range", *map(ends, over_all)))
    return Table((f"{mode}: hours until", *heads), rows, strong=[len(rows) - 2])


def ends(lives: Lives) -> str:
    """Write the interval of the median, or where there is none the range of the slides."""
    low, high = map(hours_or_never, lives.interval or lives.range)
    return f"{low} to {high}"


def explained(found: Cohort) -> str:
    """Say what the figures are."""
    size = len(found.slides.images)
    said = (
        "Hours until the ΔE2000 between the un-aged and the aged display reaches a tolerance. Avg: mean over all "
        "pixels; Max: mean + 2 SD, as in the paper."
    )
    if any(lives.reached < size for of in found.lives.values() for by in of.values() for lives in by.values()):
        said += f" –: not within the {spaced(found.slides.last)} h looked at; in medians such a slide is the longest."
    chance = coverage(size)
    if chance is None:
        return f"{said} Fewer than six slides give no 95 % interval of a median."
    return (
        f"{said} The interval holds the median of all slides like these with {chance:.1%}, if they were drawn "
        f"independently; it does not carry the model's own uncertainty."
    )


def _slides(count: int) -> str:
    return f"{count} slide{'' if count == 1 else 's'}"
