"""The page of ``lutgen cohort``: for each mode a line a slide, and the median over all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.pictures.cohort.spread import coverage
from lutgen.report.parts import Headline, Table
from lutgen.report.pictures.lifetime import COLUMNS, hours_or_never

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.pictures.cohort import Cohort
    from lutgen.pictures.cohort.spread import Lives
    from lutgen.report.parts import Part


def cohort_page(cohort: Cohort) -> Iterator[Part]:
    """Yield what ``lutgen cohort`` prints."""
    yield counted(cohort)
    yield ""
    if cohort.lives:
        for mode in cohort.modes:
            yield mode_table(cohort, mode)
            yield ""
        yield explained(cohort)
        yield cohort.slides.model.measurements.provenance
        yield from cohort.slides.remarks()
    for each in cohort.broken:
        yield Headline(f"Broken: {each.file}: {each.reason}")


def counted(cohort: Cohort) -> str:
    """Count the slides that were read, that were kept from an earlier run, and that are broken."""
    done, broken = len(cohort.slides.images), len(cohort.broken)
    sentence = f"{_slides(done)} in {cohort.folder}"
    if cohort.kept:
        sentence += f", {cohort.kept} of them from an earlier run"
    if not broken:
        return f"{sentence}."
    return (
        f"{sentence}; {_slides(broken)} broken, named below and left out of all figures. The same command tries again."
    )


def mode_table(cohort: Cohort, mode: str) -> Table:
    """Tabulate the hours until Max and Avg reach each tolerance: one row a slide, then the median and its interval."""
    columns = [(tolerance, statistic) for tolerance in cohort.slides.tolerances for statistic in COLUMNS]
    heads = (f"{COLUMNS[statistic]} ΔE2000 {tolerance:g}" for tolerance, statistic in columns)
    rows = []
    for image in cohort.slides.images:
        curve = image.curves[mode]
        lives = (curve.hours_until(statistic, tolerance) for tolerance, statistic in columns)
        rows.append((image.file, *map(hours_or_never, lives)))
    over_all = [cohort.lives[mode][tolerance][statistic] for tolerance, statistic in columns]
    medians = (hours_or_never(lives.median) for lives in over_all)
    rows.append((f"median of {_slides(len(cohort.slides.images))}", *medians))
    rows.append(("95 % interval" if over_all[0].interval else "range", *map(ends, over_all)))
    return Table((f"{mode}: hours until", *heads), rows, strong=[len(rows) - 2])


def ends(lives: Lives) -> str:
    """Write the interval of the median, or the range of the slides if there are too few for an interval."""
    low, high = map(hours_or_never, lives.interval or lives.range)
    return f"{low} to {high}"


def explained(cohort: Cohort) -> str:
    """Define the figures of the tables."""
    size = len(cohort.slides.images)
    sentence = (
        "Hours until the ΔE2000 between the un-aged and the aged display reaches a tolerance. Avg: mean over all "
        "pixels; Max: mean + 2 SD, as in the paper."
    )
    if any(lives.reached < size for of in cohort.lives.values() for by in of.values() for lives in by.values()):
        sentence += (
            f" –: not within the {spaced(cohort.slides.last)} h looked at; in medians such a slide is the longest."
        )
    chance = coverage(size)
    if chance is None:
        return f"{sentence} Fewer than six slides give no 95 % interval of a median."
    return (
        f"{sentence} The interval holds the median of all slides like these with {chance:.1%}, if they were drawn "
        f"independently; it does not carry the model's own uncertainty."
    )


def _slides(count: int) -> str:
    return f"{count} slide{'' if count == 1 else 's'}"
