"""The paper's Table 1: lifetimes of images, those that the paper published, and the difference in percent."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.numerals import spaced
from lutgen.pictures.published import TABLE_1, TABLE_1_COLUMNS
from lutgen.pictures.schema import seen_on
from lutgen.report.parts import Headline, Table
from lutgen.report.pictures.lifetime import COLUMNS, counted, hours_or_never

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.pictures.lifetime import ImageLifetime, Lifetimes
    from lutgen.report.parts import Part


def table_1_page(lifetimes: Lifetimes) -> Iterator[Part]:
    """Yield what ``lutgen table 1`` prints; ``lifetimes`` has the tolerances and modes of the paper."""
    for image in lifetimes.images:
        yield Headline(counted(image))
        yield _table(image)
        yield ""
    yield (
        "Hours until the ΔE2000 between the un-aged and the aged display reaches 3 and 5; below: against the paper's. "
        "Avg: mean over all pixels; Max: mean + 2 SD. The paper's picture (its Figure 2) was never published: other "
        "pictures are expected to differ."
        f"{f' –: not within {spaced(lifetimes.last)} h.' if any(_misses(lifetimes)) else ''}"
    )
    yield lifetimes.model.measurements.provenance
    yield from lifetimes.remarks()


def table_1_json(lifetimes: Lifetimes) -> dict[str, Any]:
    """Return what ``--json`` writes: see ``lutgen/pictures/schema/table.json``."""
    return {
        "schema": 1,
        "table": 1,
        **seen_on(lifetimes.model),
        "rows": [
            {
                "file": image.file,
                "mode": mode,
                "tolerance": tolerance,
                "statistic": statistic,
                "hours": hours,
                "paper": paper,
                "difference": difference(hours, paper),
            }
            for image in lifetimes.images
            for mode in TABLE_1
            for (tolerance, statistic), hours, paper in _cells(image, mode)
        ],
    }


def table_1_csv(lifetimes: Lifetimes) -> str:
    """Return what ``--csv`` writes: a line a cell; hours and difference are empty where never reached."""
    lines = ["file,mode,tolerance,statistic,hours,paper_hours,difference_percent"]
    for row in table_1_json(lifetimes)["rows"]:
        quoted = row["file"].replace('"', '""')
        file = f'"{quoted}"' if set(quoted) & set('",\n') else quoted
        hours = "" if row["hours"] is None else f"{row['hours']:.1f}"
        off = "" if row["difference"] is None else f"{100.0 * row['difference']:.2f}"
        lines.append(f"{file},{row['mode']},{row['tolerance']:g},{row['statistic']},{hours},{row['paper']},{off}")
    return "\n".join([*lines, ""])


def difference(hours: float | None, paper: float) -> float | None:
    """Return by what share hours exceed the paper's; None where they are never reached."""
    return None if hours is None else hours / paper - 1.0


def _table(image: ImageLifetime) -> Table:
    heads = (f"{COLUMNS[statistic]} ΔE2000 {tolerance:g}" for tolerance, statistic in TABLE_1_COLUMNS)
    rows = []
    for mode, published in TABLE_1.items():
        rows.append([f"{mode}, the paper", *map(spaced, published)])
        cells = []
        for _, hours, paper in _cells(image, mode):
            off = difference(hours, paper)
            cells.append(hours_or_never(hours) + ("" if off is None else f"\n{100.0 * off:+.1f} %"))
        rows.append([f"{mode}, {Path(image.file).name}", *cells])
    return Table(("hours until", *heads), rows, unbroken=True)


def _cells(image: ImageLifetime, mode: str) -> Iterator[tuple[tuple[float, str], float | None, int]]:
    """Yield for each column the hours until its tolerance is reached, and the hours of the paper."""
    curve = image.curves[mode]
    for (tolerance, statistic), paper in zip(TABLE_1_COLUMNS, TABLE_1[mode], strict=True):
        yield (tolerance, statistic), curve.hours_until(statistic, tolerance), paper


def _misses(lifetimes: Lifetimes) -> Iterator[bool]:
    for image in lifetimes.images:
        for mode in TABLE_1:
            yield from (hours is None for _, hours, _ in _cells(image, mode))
