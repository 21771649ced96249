"""The page of ``lutgen nuclei``: one sentence, a table by hours, and what was measured and what not."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.appearance.conspicuity import Conspicuity
    from lutgen.report.parts import Part

#: Rows of the table of a mode, at most: the whole curve is in JSON and in the plot.
ROWS = 5

#: What the figures are, and what they are not.
MEASURED = (
    "ΔE2000 between the mean colour of each nucleus and that of a ring around it, as the un-aged and the aged display "
    "show them to an eye adapted to the un-aged white. It is a contrast of mean colours: no texture, no sharpness, no "
    "reader. What is outlined wrongly is in it: look at the outlines (--plots)."
)


def nuclei_page(found: Conspicuity) -> Iterator[Part]:
    """Yield what ``lutgen nuclei`` prints."""
    yield Headline(headline(found))
    yield table_of(found)
    yield ""
    yield f"{found.field.file}: {counted(found)}"
    yield (
        f"{MEASURED} In brackets: 95 % bootstrap over nuclei, as if drawn one by one."
        if next(iter(found.contrasts.values())).intervals is not None
        else f"{MEASURED} No intervals: too few nuclei to say how they scatter."
    )
    yield found.model.measurements.provenance
    yield from found.remarks()


def headline(found: Conspicuity) -> str:
    """Say the finding in a sentence."""
    contrasts = found.contrasts
    new = contrasts[next(iter(contrasts))].percentiles[0, 2]
    parts = [f"{each.median[-1]:.1f} in {mode} ({percent(each.change[-1])})" for mode, each in contrasts.items()]
    of = f"median of {spaced(found.nuclei.count)}" if found.nuclei.count > 1 else "the only one"
    return (
        f"Nuclei stand out by ΔE2000 {new:.1f} ({of}) when the display is new; at {spaced(found.hours[-1])} h by "
        f"{' and '.join(parts)}."
    )


def counted(found: Conspicuity) -> str:
    """Say in one sentence what was compared."""
    nuclei, rings = found.nuclei, found.rings
    said = (
        f"{spaced(nuclei.count)} {'nucleus' if nuclei.count == 1 else 'nuclei'}, {nuclei.found}, typically "
        f"{nuclei.width:.0f} pixels wide; rings of {rings.width} pixels after a gap of {rings.gap}"
    )
    left = [
        f"{spaced(number)} {why}"
        for number, why in (
            (nuclei.small, "too small"),
            (nuclei.large, "too large"),
            (found.ringless, "without room for a ring"),
        )
        if number
    ]
    return f"{said}. Left out: {', '.join(left)}." if left else f"{said}."


def table_of(found: Conspicuity) -> Table:
    """Rows are modes and some hours, columns the distribution over nuclei and its change."""
    heads = ("median ΔE2000", "middle half", "5–95 %", "change of the median", f"losing > {found.loss:g} %")
    rows = []
    for mode, contrast in found.contrasts.items():
        for place in shown_hours(len(found.hours)):
            low, first, median, third, high = contrast.percentiles[place]
            ends = None if contrast.intervals is None else contrast.intervals[place]
            row = (
                mode,
                spaced(found.hours[place]),
                f"{median:.1f}",
                f"{first:.1f}–{third:.1f}",
                f"{low:.1f}–{high:.1f}",
                f"{percent(contrast.change[place])}{_between(ends, 1)}",
                f"{contrast.lost[place]:.0%}{_between(ends, 2)}",
            )
            rows.append(row)
    return Table(("mode", "hours", *heads), rows, unbroken=True)


def shown_hours(count: int) -> Sequence[int]:
    """Places of at most ``ROWS`` of so many hours, the first and the last among them."""
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
