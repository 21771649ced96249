"""The page of ``lutgen nuclei``: one sentence, a table by hours, and the definition of the contrast."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.pictures.conspicuity import Conspicuity
    from lutgen.report.parts import Part

#: Rows of the table of a mode, at most; JSON and the plot have all hours.
ROWS = 5

#: Definition of the contrast, and its limits.
MEASURED = (
    "ΔE2000 between the mean colour of each nucleus and that of a ring around it, as the un-aged and the aged display "
    "show them to an eye adapted to the un-aged white. It is a contrast of mean colours: no texture, no sharpness, no "
    "reader. What is outlined wrongly is in it: look at the outlines (--plots)."
)


def nuclei_page(conspicuity: Conspicuity) -> Iterator[Part]:
    """Yield what ``lutgen nuclei`` prints."""
    yield Headline(headline(conspicuity))
    yield table_of(conspicuity)
    yield ""
    yield f"{conspicuity.field.file}: {counted(conspicuity)}"
    yield (
        f"{MEASURED} In brackets: 95 % bootstrap over nuclei, as if drawn one by one."
        if next(iter(conspicuity.contrasts.values())).intervals is not None
        else f"{MEASURED} No intervals: too few nuclei to say how they scatter."
    )
    yield conspicuity.model.measurements.provenance
    yield from conspicuity.remarks()


def headline(conspicuity: Conspicuity) -> str:
    """Say how much nuclei stand out when the display is new and at the last hour."""
    contrasts = conspicuity.contrasts
    new = contrasts[next(iter(contrasts))].percentiles[0, 2]
    parts = [f"{each.median[-1]:.1f} in {mode} ({percent(each.change[-1])})" for mode, each in contrasts.items()]
    of = f"median of {spaced(conspicuity.nuclei.count)}" if conspicuity.nuclei.count > 1 else "the only one"
    return (
        f"Nuclei stand out by ΔE2000 {new:.1f} ({of}) when the display is new; at {spaced(conspicuity.hours[-1])} h by "
        f"{' and '.join(parts)}."
    )


def counted(conspicuity: Conspicuity) -> str:
    """Count the nuclei that are compared and those left out, in one sentence or two."""
    nuclei, rings = conspicuity.nuclei, conspicuity.rings
    sentence = (
        f"{spaced(nuclei.count)} {'nucleus' if nuclei.count == 1 else 'nuclei'}, {nuclei.found}, typically "
        f"{nuclei.width:.0f} pixels wide; rings of {rings.width} pixels after a gap of {rings.gap}"
    )
    left = [
        f"{spaced(number)} {why}"
        for number, why in (
            (nuclei.small, "too small"),
            (nuclei.large, "too large"),
            (conspicuity.ringless, "without room for a ring"),
        )
        if number
    ]
    return f"{sentence}. Left out: {', '.join(left)}." if left else f"{sentence}."


def table_of(conspicuity: Conspicuity) -> Table:
    """Tabulate for each mode and some hours the distribution over nuclei and its change."""
    heads = ("median ΔE2000", "middle half", "5–95 %", "change of the median", f"losing > {conspicuity.loss:g} %")
    rows = []
    for mode, contrast in conspicuity.contrasts.items():
        for place in shown_hours(len(conspicuity.hours)):
            low, first, median, third, high = contrast.percentiles[place]
            ends = None if contrast.intervals is None else contrast.intervals[place]
            row = (
                mode,
                spaced(conspicuity.hours[place]),
                f"{median:.1f}",
                f"{first:.1f}–{third:.1f}",
                f"{low:.1f}–{high:.1f}",
                f"{percent(contrast.change[place])}{_between(ends, 1)}",
                f"{contrast.lost[place]:.0%}{_between(ends, 2)}",
            )
            rows.append(row)
    return Table(("mode", "hours", *heads), rows, unbroken=True)


def shown_hours(count: int) -> Sequence[int]:
    """Return the indices of at most ``ROWS`` of ``count`` hours, the first and the last among them."""
    return sorted({round(step * (count - 1) / (ROWS - 1)) for step in range(ROWS)})


def percent(change: float) -> str:
    """Write a change with its sign: −14 %, +3.1 %; a dash where there is none."""
    if not isfinite(change):
        return "–"
    number = f"{abs(100.0 * change):.{0 if abs(change) >= 0.0995 else 1}f}"
    return "±0 %" if float(number) == 0.0 else f"{'+' if change > 0 else '−'}{number} %"


def _between(ends: Sequence[Sequence[float]] | None, number: int) -> str:
    if ends is None or not all(map(isfinite, ends[number])):
        return ""
    low, high = (percent(end) if number == 1 else f"{end:.0%}" for end in ends[number])
    return "" if low == high else f" ({low} to {high})"
