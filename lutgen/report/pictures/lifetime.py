"""The page of ``lutgen lifetime``: for each image the paper's Table 1, and the pixels that are counted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.numerals import pixels_of_colours, spaced
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.pictures.lifetime import ImageLifetime, Lifetimes
    from lutgen.report.parts import Part

#: The columns of Table 1 for each tolerance: statistic and its name in the paper.
COLUMNS = {"max": "Max", "mean": "Avg"}


def lifetime_page(lifetimes: Lifetimes) -> Iterator[Part]:
    """Yield what ``lutgen lifetime`` prints."""
    yield lifetimes.model.luminance.sentence()
    for image in lifetimes.images:
        yield Headline(counted(image))
        yield life_table(lifetimes, image)
        yield ""
    never = f" –: not within the {spaced(lifetimes.last)} h looked at." if _any_never(lifetimes) else ""
    known = lifetimes.images[0].intervals is not None
    within = " Below: 95 % intervals from the model's own uncertainty." if known else ""
    yield (
        "Hours until the ΔE2000 between the un-aged and the aged display reaches a tolerance. Avg: mean over all "
        f"pixels; Max: mean + 2 SD, as in the paper.{never}{within}"
    )
    yield lifetimes.model.measurements.provenance
    yield from lifetimes.remarks()


def counted(image: ImageLifetime) -> str:
    """Count pixels, colours and pixels left out, in one sentence."""
    sentence = f"{image.file}: {pixels_of_colours(image.pixels, image.colours)}"
    if image.binning_error:
        sentence += f" ({image.bits} bits a channel: ΔE2000 of a pixel to ± {image.binning_error:.1g})"
    if image.tissue is None:
        return f"{sentence}."
    if image.tissue.threshold is None:
        return f"{sentence}; no bare glass was found, nothing was left out."
    share, threshold = image.tissue.left_out_share, image.tissue.threshold
    return f"{sentence}; {share:.1%} left out as bare glass, L* of {threshold:.1f} and more."


def life_table(lifetimes: Lifetimes, image: ImageLifetime) -> Table:
    """Table 1: rows are modes, columns the hours until Max and Avg reach each tolerance."""
    columns = [(tolerance, statistic) for tolerance in lifetimes.tolerances for statistic in COLUMNS]
    heads = (f"{COLUMNS[statistic]} ΔE2000 {tolerance:g}" for tolerance, statistic in columns)
    rows = []
    for mode, curve in image.curves.items():
        cells = []
        for tolerance, statistic in columns:
            cell = hours_or_never(curve.hours_until(statistic, tolerance))
            if image.intervals:
                low, high = map(hours_or_never, image.intervals[mode][tolerance][statistic])
                cell += f"\n{low} to {high}" if (low, high) != ("–", "–") else ""
            cells.append(cell)
        rows.append((mode, *cells))
    return Table(("hours until", *heads), rows, unbroken=True)


def hours_or_never(hours: float | None) -> str:
    """Write hours to the hour; a dash for never."""
    return "–" if hours is None else spaced(round(hours))


def _any_never(lifetimes: Lifetimes) -> bool:
    return any(
        curve.hours_until(statistic, tolerance) is None
        for image in lifetimes.images
        for curve in image.curves.values()
        for tolerance in lifetimes.tolerances
        for statistic in COLUMNS
    )
